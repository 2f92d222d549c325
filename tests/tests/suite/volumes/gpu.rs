//! Modes with volumes on a GPU against the CPU's.

use aogrid_scene::GBuffer;
use aogrid_scene::shade::{Gpu, Mode, ShadeInput, Target};

use super::scene;

/// The largest difference of triangles that are rounded to single precision, 2.4e-7 for coordinates up to
/// 4, as seen from 4e-4 over a surface: the lift of receivers. With grids, that of the weights of
/// texture filters, rounded to 8 bits: two occluders, and AO is twice what a grid holds.
const TOLERANCES: [(&str, f32); 2] = [("volumes", 6e-4), ("volumes+cone", 4.0 / 256.0)];

/// The same over all pixels, few of which are near an edge.
const MAX_RMS: f32 = 2e-5;

#[test]
fn a_gpu_draws_the_volumes_that_the_cpu_sums() {
    let Some(context) = aogrid_tests::gpu() else {
        return;
    };
    // Far from zero, mirrored, excluded from one another and with layers.
    let text = "[volumes]\nextent = 0.5\n[camera]\nposition = [5000, 2, -98]\n\
                target = [5000, 0.3, -101]\nresolution = [96, 72]\n\
                [[mesh]]\nname = 'floor'\nrectangle = [8, 8]\n\
                [[mesh]]\nname = 'ring'\nsample = 'torus'\ntriangles = 300\n\
                [[mesh]]\nname = 'box'\nsample = 'box'\n\
                [[instance]]\nmesh = 'floor'\ntranslate = [5000, 0, -101]\n\
                [[instance]]\nmesh = 'ring'\nid = 7\nscale = [-0.6, 0.8, 0.6]\nexcludes = [9]\n\
                translate = [4999.3, 0.2, -101]\nstrength = 0.8\n\
                [[instance]]\nmesh = 'box'\nid = 9\ntranslate = [5000.4, 0.5, -101]\nlayers = [1]\n";
    let scene = scene(text);
    let target = Target::of_picture(GBuffer::trace(&scene, aogrid_bake_core::UNOBSERVED).unwrap());
    let on_cpu = ShadeInput::new(&scene, &target);
    let mut on_gpu = ShadeInput::new(&scene, &target);
    on_gpu.gpu = Some(Gpu {
        device: context.device(),
        queue: context.queue(),
    });
    for (name, tolerance) in TOLERANCES {
        let mode = Mode::named(name).unwrap();
        assert!(mode.runs_on_gpu());
        let [cpu, gpu] = [&on_cpu, &on_gpu].map(|input| mode.shade(input).unwrap().occlusion);
        let dark = cpu.iter().filter(|ao| **ao > 0.05).count();
        assert!(dark > 300, "{name}: {dark}");
        let pairs = cpu.iter().zip(&gpu);
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        let squares = cpu.iter().zip(&gpu).map(|(a, b)| (a - b).powi(2));
        let rms = (squares.sum::<f32>() / cpu.len() as f32).sqrt();
        println!("{name}: {worst:.1e}, rms {rms:.1e}");
        assert!(worst <= tolerance, "{name}: {worst}");
        assert!(rms <= MAX_RMS || name != "volumes", "{name}: {rms}");
    }
}
