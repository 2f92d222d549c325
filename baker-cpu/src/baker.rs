//! The choice between the sweep and rays, and one object for both.

use aogrid_bake_core::{
    BakeOptions, Kernel, Observer, PreparedMesh, RawGrid, SignedLayers, TriangleMesh, WhyRays,
};
use aogrid_grid_format::{GridSpec, Method};

use crate::{BakeError, Occluder, Sweeper};

/// Bakes by the sweep or by rays, and keeps the buffers that it may need again.
pub struct Baker {
    choice: Option<Kernel>,
    sweeper: Sweeper,
}

/// A mesh made ready for one bake.
pub struct Prepared<'a> {
    spec: GridSpec,
    options: &'a BakeOptions,
    ready: Ready<'a>,
    why_rays: Option<WhyRays>,
}

enum Ready<'a> {
    Sweep {
        sweeper: &'a mut Sweeper,
        mesh: PreparedMesh,
        size: u32,
    },
    Rays {
        occluder: Occluder,
        layers: Option<SignedLayers>,
    },
}

impl Baker {
    /// With the kernel that is chosen; none: the sweep wherever it can be used and is faster.
    pub fn new(choice: Option<Kernel>) -> Self {
        Self::with_sweeper(choice, Sweeper::new())
    }

    /// [`Baker::new`], with a sweeper that is there already.
    pub fn with_sweeper(choice: Option<Kernel>, sweeper: Sweeper) -> Self {
        Self { choice, sweeper }
    }

    /// Everything before the first direction, on all threads.
    ///
    /// # Errors
    ///
    /// An option out of its range; the sweep was chosen and cannot be used.
    pub fn prepare<'a>(
        &'a mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &'a BakeOptions,
    ) -> Result<Prepared<'a>, BakeError> {
        options.validate()?;
        let rays = || Ready::Rays {
            occluder: Occluder::new(mesh),
            layers: options.layers(mesh, spec),
        };
        let (ready, why_rays) = match self.choice {
            Some(Kernel::Rays) => (rays(), None),
            choice => match ready_to_sweep(mesh, spec, options, choice.is_none()) {
                Ok((mesh, size)) => {
                    let sweeper = &mut self.sweeper;
                    let ready = Ready::Sweep {
                        sweeper,
                        mesh,
                        size,
                    };
                    (ready, None)
                }
                Err(why) if choice.is_some() => return Err(BakeError::NoSweep(why)),
                Err(why) => (rays(), Some(why)),
            },
        };
        Ok(Prepared {
            spec,
            options,
            ready,
            why_rays,
        })
    }
}

fn ready_to_sweep(
    mesh: &TriangleMesh,
    spec: GridSpec,
    options: &BakeOptions,
    only_if_faster: bool,
) -> Result<(PreparedMesh, u32), WhyRays> {
    let size = match (WhyRays::of_options(options), options.method) {
        (None, Method::Faces { size }) => size,
        (Some(why), _) => return Err(why),
        (None, Method::Rays { .. }) => return Err(WhyRays::MonteCarlo),
    };
    let prepared =
        PreparedMesh::new(mesh, spec, options.sample_offset).map_err(WhyRays::Prepare)?;
    match WhyRays::of_counts(prepared.lone_edges().len()) {
        Some(why) if only_if_faster => Err(why),
        _ => Ok((prepared, size)),
    }
}

impl Prepared<'_> {
    /// What will test the directions.
    pub fn kernel(&self) -> Kernel {
        match self.ready {
            Ready::Sweep { .. } => Kernel::Sweep,
            Ready::Rays { .. } => Kernel::Rays,
        }
    }

    /// Why it is rays, where nothing was chosen.
    pub fn why_rays(&self) -> Option<&WhyRays> {
        self.why_rays.as_ref()
    }

    /// Bakes. The same input gives the same bits, for any number of threads.
    ///
    /// # Errors
    ///
    /// Cancellation.
    pub fn bake(&mut self, observer: Observer<'_>) -> Result<RawGrid, BakeError> {
        let options = self.options;
        let (raw, layers) = match &mut self.ready {
            // Both at once, so that no thread waits for the few tasks that layers are.
            Ready::Sweep {
                sweeper,
                mesh,
                size,
            } => rayon::join(
                || sweeper.bake(mesh, *size, observer),
                || options.layers_of(mesh),
            ),
            Ready::Rays { occluder, layers } => {
                (occluder.bake(self.spec, options, observer), layers.clone())
            }
        };
        Ok(RawGrid { layers, ..raw? })
    }
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::samples::Sample;
    use aogrid_bake_core::{Extent, Placement, UNOBSERVED};

    use super::*;

    fn spec(mesh: &TriangleMesh, extent: Extent) -> GridSpec {
        let resolution = [8; 3];
        let placement = Placement { resolution, extent };
        placement.place(&mesh.bounds()).unwrap()
    }

    #[test]
    fn the_sweep_is_chosen_where_it_can_be_used() {
        let mesh = Sample::Table.mesh(None).unwrap();
        let placed = spec(&mesh, Extent::Epsilon(0.1));
        let faces = BakeOptions::recommended();
        let near = BakeOptions {
            max_distance: Some(1.0),
            ..faces
        };
        let random = BakeOptions {
            method: Method::Rays { count: 10, seed: 1 },
            ..faces
        };
        let tiny = spec(&mesh, Extent::HalfExtents([1e-4; 3]));
        let why = |spec, options: &BakeOptions| {
            let mut baker = Baker::new(None);
            let mut prepared = baker.prepare(&mesh, spec, options).unwrap();
            let expected = match prepared.why_rays() {
                None => Kernel::Sweep,
                Some(_) => Kernel::Rays,
            };
            assert_eq!(prepared.kernel(), expected);
            prepared.bake(UNOBSERVED).unwrap();
            prepared.why_rays().cloned()
        };
        assert_eq!(why(placed, &faces), None);
        assert_eq!(why(placed, &near), Some(WhyRays::MaxDistance));
        assert_eq!(why(placed, &random), Some(WhyRays::MonteCarlo));
        assert!(matches!(why(tiny, &faces), Some(WhyRays::Prepare(_))));
        assert!(WhyRays::of_counts(14_000_000).is_none());
        assert!(WhyRays::of_counts(16_000_000).is_some());
    }

    #[test]
    fn a_choice_is_kept_or_refused() {
        let mesh = Sample::Table.mesh(None).unwrap();
        let placed = spec(&mesh, Extent::Epsilon(0.1));
        let faces = BakeOptions::recommended();
        let kernel = |choice| {
            let mut baker = Baker::new(Some(choice));
            baker.prepare(&mesh, placed, &faces).unwrap().kernel()
        };
        assert_eq!(kernel(Kernel::Sweep), Kernel::Sweep);
        assert_eq!(kernel(Kernel::Rays), Kernel::Rays);
        let near = BakeOptions {
            max_distance: Some(1.0),
            ..faces
        };
        let mut baker = Baker::new(Some(Kernel::Sweep));
        let refused = baker.prepare(&mesh, placed, &near).map(|p| p.kernel());
        assert_eq!(refused, Err(BakeError::NoSweep(WhyRays::MaxDistance)));
    }
}
