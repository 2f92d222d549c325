//! Extents and weights against rays that apply the same, on the floor around a box.

use aogrid_runtime::VolumeWeight;
use aogrid_scene::VolumeSettings;
use aogrid_scene::shade::Target;
use glam::DVec3;

use super::rays::Weighted;
use super::{rmse, scene, shaded_at};

#[test]
fn every_weight_is_that_of_rays_that_apply_it() {
    /// The noise of 6,400 stratified rays a receiver.
    const NOISE: f64 = 1e-3;
    let mut scene = scene(
        "[receivers]\ncorner = [-1.2, 0, 1.2]\nu = [2.4, 0, 0]\nv = [0, 0, -2.4]\ncount = [11, 11]\n\
         [[mesh]]\nname = 'a'\nsample = 'box'\n\
         [[instance]]\nmesh = 'a'\ntranslate = [0, 0.13, 0]\nrotate = { axis = [1, 0, 2], degrees = 9 }\n",
    );
    let instance = &scene.instances[0];
    let corners = scene.meshes[0].mesh.corners();
    let placed = |p: [f32; 3]| {
        let p = DVec3::from(p.map(f64::from));
        instance.world_from_object.transform_point3(p)
    };
    let triangles: Vec<[DVec3; 3]> = corners.map(|corners| corners.map(placed)).collect();
    let target = Target::of_list(scene.receivers.as_ref().unwrap());
    let weights = [
        VolumeWeight::None,
        VolumeWeight::Linear { exponent: 1.0 },
        VolumeWeight::Linear { exponent: 2.5 },
        VolumeWeight::Edges { exponent: 1.0 },
    ];
    // A quarter, half and all of the box's height.
    for extent in [0.25, 0.5, 1.0] {
        for weight in weights {
            scene.volumes = VolumeSettings {
                extent: Some(extent),
                weight,
                two_sided: false,
            };
            let weighted = Weighted {
                triangles: triangles.clone(),
                extent: extent.into(),
                weight,
            };
            let [volumes] = shaded_at(&scene, &target, ["volumes"]);
            let rays = target.receivers.iter();
            let rays: Vec<f32> = rays.map(|r| weighted.count(r).every as f32).collect();
            let shaded = volumes.iter().filter(|ao| **ao > 0.01).count();
            assert!(shaded > 10, "{extent}, {weight:?}: {shaded}");
            let error = rmse(&[volumes, rays]);
            println!("extent {extent}, {weight:?}: {error:.1e}");
            assert!(error <= NOISE, "{extent}, {weight:?}: {error}");
        }
    }
}
