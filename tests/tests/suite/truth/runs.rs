use std::ops::ControlFlow;

use aogrid_bake_core::UNOBSERVED;
use aogrid_baker_cpu::RayScene;
use aogrid_scene::reference::{Lighting, ReferenceError, ReferenceOptions, shade};

use super::{cube, sunny};

#[test]
fn results_depend_on_the_seed_and_not_on_the_number_of_threads() {
    let known = cube();
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let options = ReferenceOptions {
            samples: 100,
            error: None,
            seed,
            max_distance: None,
        };
        let occluder = RayScene::new(&known.mesh);
        let (environment, _) = sunny();
        let lighting = Lighting {
            environment: Some(&environment),
            ..Lighting::default()
        };
        let run = || {
            shade(
                Some(&occluder),
                &known.receivers,
                &lighting,
                &options,
                UNOBSERVED,
            )
        };
        pool.unwrap().install(run).unwrap()
    };
    assert_eq!(with(1, 0), with(3, 0));
    assert_ne!(with(1, 0), with(1, 1));
}

#[test]
fn an_observer_sees_every_receiver_and_can_cancel() {
    let known = cube();
    let occluder = RayScene::new(&known.mesh);
    let run = |observer: aogrid_bake_core::Observer<'_>| {
        let options = ReferenceOptions {
            samples: 2,
            ..ReferenceOptions::recommended()
        };
        let lighting = Lighting::default();
        shade(
            Some(&occluder),
            &known.receivers,
            &lighting,
            &options,
            observer,
        )
    };
    let last = std::sync::atomic::AtomicUsize::new(0);
    run(&|progress| {
        assert_eq!(progress.total, known.receivers.len());
        last.fetch_max(progress.done, std::sync::atomic::Ordering::Relaxed);
        ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(last.into_inner(), known.receivers.len());
    assert_eq!(
        run(&|_| ControlFlow::Break(())),
        Err(ReferenceError::Cancelled)
    );
}
