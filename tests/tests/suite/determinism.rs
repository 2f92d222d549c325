use aogrid_bake_core::models::Model;
use aogrid_bake_core::{ALGORITHM_VERSION, BakeOptions, Placement, Preset};
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

/// The bytes of one bake belong to [`ALGORITHM_VERSION`]: caches rely on it. Where this fails and the
/// change is meant, raise the version, and put the new hash here.
#[test]
fn other_bytes_are_another_version_of_the_algorithm() {
    let mesh = Model::Robot.mesh(None).unwrap();
    let placement = Placement {
        resolution: [12; 3],
        ..Preset::Default.placement()
    };
    let grid = grid(&mesh, &placement, &Preset::Default.options());
    let hash = blake3::hash(grid.texels()).to_hex();
    let expected = (1, "86a36692867a737f");
    assert_eq!((ALGORITHM_VERSION, &hash[..16]), expected);
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    builder.build().expect("threads can be started")
}
