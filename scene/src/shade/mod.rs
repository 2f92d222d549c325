//! Shading of a scene by any mode, on the CPU or a GPU.
//!
//! A [`Mode`] turns a [`ShadeInput`] into a [`Shaded`]: an entry for each receiver of the
//! [`Target`]. A new mode is a file here with a `MODE`, and its entry in [`ALL`].

mod accessibility;
mod casters;
mod cone;
mod environment;
mod environment_merge;
mod glossy;
mod light;
mod lookups;
mod mean;
mod merge;
mod occlusion;
mod own_surface;
mod raster;
mod surface_cone;
mod surface_environment;
mod target;
mod triangles;
mod truth;
mod volumes;
mod volumes_cone;

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::ControlFlow;
use std::rc::Rc;

use aogrid_bake_core::Progress;
use aogrid_runtime::wgpu;

use own_surface::OwnSurface;

use crate::error::Result;
use crate::reference::Environment;
use crate::{Grids, Instance, Scene};

pub use target::{Shaded, Target};

/// Every mode.
pub const ALL: [&Mode; 12] = [
    &truth::MODE,
    &occlusion::MODE,
    &cone::MODE,
    &merge::MODE,
    &mean::MODE,
    &environment::MODE,
    &environment_merge::MODE,
    &accessibility::MODE,
    &surface_cone::MODE,
    &surface_environment::MODE,
    &volumes::MODE,
    &volumes_cone::MODE,
];

/// A way to shade a scene.
#[derive(Debug)]
pub struct Mode {
    /// The name on command lines, in channels and in columns.
    pub name: &'static str,
    /// The description, one line.
    pub summary: &'static str,
    /// Whether the mode computes the light of an environment and refuses scenes without one. Other
    /// modes compute AO, and in a lit scene the light that AO leaves.
    pub needs_light: bool,
    on_cpu: fn(&ShadeInput<'_>) -> Result<Shaded>,
    on_gpu: Option<fn(&ShadeInput<'_>, &Gpu<'_>) -> Result<Shaded>>,
}

/// The input of every mode.
pub struct ShadeInput<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The points to shade.
    pub target: &'a Target,
    /// The scene's environment, if it has one.
    pub environment: Option<&'a Environment>,
    /// The device for modes that run on one; they need a picture as their target.
    pub gpu: Option<Gpu<'a>>,
    /// The observers of progress.
    pub stages: Stages<'a>,
    /// The grids that some mode has asked for, shared by the modes.
    grids: RefCell<Grids>,
    /// The surface bakes at the receivers, if some mode has asked for them.
    own_surfaces: RefCell<Option<Rc<Vec<OwnSurface>>>>,
    instances: InstancesById<'a>,
}

/// A GPU that looks up grids. The modes submit to its queue and wait for it.
#[derive(Clone, Copy)]
pub struct Gpu<'a> {
    /// The device.
    pub device: &'a wgpu::Device,
    /// The device's queue.
    pub queue: &'a wgpu::Queue,
}

/// Makes the observer of a stage of the work from the stage's name; the stage ends when the
/// observer is dropped.
pub type Stages<'a> = &'a dyn Fn(&str) -> StageObserver;

/// The observer of a stage; see [`aogrid_bake_core::Observer`].
pub type StageObserver = Box<dyn Fn(Progress) -> ControlFlow<()> + Sync>;

/// The instances of a scene by their ids.
struct InstancesById<'a>(HashMap<u32, &'a Instance>);

impl Mode {
    /// Returns the mode with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        ALL.into_iter().find(|mode| mode.name == name)
    }

    /// Whether the mode can use a GPU; otherwise it always runs on the CPU.
    pub fn runs_on_gpu(&self) -> bool {
        self.on_gpu.is_some()
    }

    /// Shades all receivers of the input's target.
    ///
    /// # Errors
    ///
    /// The scene does not fit the mode, a grid cannot be read or baked, the GPU is out of memory,
    /// or an observer cancelled.
    pub fn shade(&self, input: &ShadeInput<'_>) -> Result<Shaded> {
        match (&input.gpu, self.on_gpu) {
            (Some(gpu), Some(on_gpu)) => on_gpu(input, gpu),
            _ => (self.on_cpu)(input),
        }
    }
}

impl<'a> ShadeInput<'a> {
    /// Returns the input for shading a scene on the CPU, without observers.
    pub fn new(scene: &'a Scene, target: &'a Target) -> Self {
        Self {
            scene,
            target,
            environment: None,
            gpu: None,
            stages: &|_| Box::new(aogrid_bake_core::UNOBSERVED),
            grids: RefCell::default(),
            own_surfaces: RefCell::default(),
            instances: InstancesById::new(scene),
        }
    }

    /// Returns and forgets the warnings of all modes since the last call, one line each.
    pub fn take_warnings(&self) -> Vec<String> {
        let warnings = self.grids.borrow_mut().take_warnings().into_iter();
        let named = |warning| format!("{}: {warning}", self.scene.path.display());
        warnings.map(named).collect()
    }

    /// Returns the albedo of receiver `idx`: that of its instance's material, or 1 if the instance
    /// is unknown.
    pub fn albedo(&self, idx: usize) -> [f32; 3] {
        let instance = self.instances.get(self.target.ids[idx]);
        instance.map_or([1.0; 3], |i| self.scene.materials[i.material].albedo)
    }
}

impl<'a> InstancesById<'a> {
    fn new(scene: &'a Scene) -> Self {
        Self(scene.instances.iter().map(|i| (i.id, i)).collect())
    }

    /// Returns the instance that receivers with this id lie on.
    fn get(&self, id: u32) -> Option<&'a Instance> {
        self.0.get(&id).copied()
    }

    /// Returns the layers of receivers with this id: all if the id is unknown.
    fn layers(&self, id: u32) -> u32 {
        self.get(id).map_or(u32::MAX, |instance| instance.layers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_have_distinct_names() {
        for (idx, mode) in ALL.iter().enumerate() {
            let first = ALL.iter().position(|m| m.name == mode.name);
            assert_eq!(first, Some(idx), "{}", mode.name);
        }
    }
}
