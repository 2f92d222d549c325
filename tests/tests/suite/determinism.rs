use aogrid_bake_core::samples::Sample;
use aogrid_bake_core::{BakeOptions, Placement};
use aogrid_grid_format::Method;
use aogrid_tests::grid;

#[test]
fn one_thread_two_threads_and_two_runs_give_the_same_file() {
    let mesh = Sample::SpaceShip.mesh(None).unwrap();
    let placement = Placement {
        resolution: [16; 3],
        ..Placement::default()
    };
    let mut options = BakeOptions::recommended();
    for method in [
        Method::Faces { size: 16 },
        Method::Rays {
            count: 256,
            seed: 3,
        },
    ] {
        options.method = method;
        let with = |threads| {
            let pool = rayon_pool(threads);
            pool.install(|| grid(&mesh, &placement, &options).to_bytes())
        };
        let one = with(1);
        assert_eq!(one, with(1), "two runs");
        assert_eq!(one, with(2), "two threads");
        assert_eq!(one, with(7), "seven threads");
    }
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    builder.build().expect("threads can be started")
}
