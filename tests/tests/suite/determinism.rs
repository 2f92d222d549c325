use aogrid_bake_core::models::Model;
use aogrid_bake_core::{BakeOptions, Placement};
use aogrid_grid_format::Sampling;
use aogrid_tests::grid;

#[test]
fn one_thread_two_threads_and_two_runs_give_the_same_file() {
    let mesh = Model::SpaceShip.mesh(None).unwrap();
    let placement = Placement {
        resolution: [16; 3],
        ..Placement::paper()
    };
    let mut options = BakeOptions::paper();
    for sampling in [
        Sampling::CubeFaces { size: 16 },
        Sampling::MonteCarlo {
            count: 256,
            seed: 3,
        },
    ] {
        options.sampling = sampling;
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
