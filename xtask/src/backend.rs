//! Where a bake runs: on the CPU or on a GPU, and why.

use std::time::Instant;

use aogrid_bake_core::{BakeOptions, Kernel, Observer, RawGrid, TriangleMesh};
use aogrid_baker_cpu as cpu;
use aogrid_baker_gpu::{self as gpu, Choice, Context};
use aogrid_grid_format::GridSpec;

/// What the command line asks for.
#[derive(Clone)]
pub(crate) enum Asked {
    /// A real GPU if there is one, else the CPU.
    Auto,
    /// This adapter; the CPU if it fails.
    Named(String),
    Cpu,
    /// This adapter and nothing else.
    Gpu(Choice),
}

/// Bakes on what was asked for, and keeps it warm. A device is looked for when there is
/// something to bake, and not before: that takes a moment.
pub(crate) struct Backend {
    asked: Asked,
    choice: Option<Kernel>,
    cpu: cpu::Baker,
    gpu: Gpu,
}

enum Gpu {
    NotLookedFor,
    None { why: Option<String> },
    Found(Box<(Context, gpu::Baker)>),
}

/// Who baked.
#[derive(Clone)]
pub(crate) struct By {
    pub kernel: Kernel,
    pub why_rays: Option<String>,
    /// Of a GPU.
    pub adapter: Option<String>,
    pub driver: Option<String>,
    /// Why the CPU, where either would have done.
    pub why_cpu: Option<String>,
}

impl By {
    pub(crate) fn backend(&self) -> &'static str {
        match self.adapter {
            Some(_) => "gpu",
            None => "cpu",
        }
    }
}

/// What came of it.
pub(crate) struct Seen {
    pub raw: RawGrid,
    pub by: By,
    /// Everything between the loaded mesh and the first direction.
    pub prepare_s: f64,
    pub visibility_s: f64,
    /// What a GPU failed with before the CPU took over.
    pub fell_back: Option<String>,
}

impl Backend {
    pub(crate) fn new(asked: Asked, choice: Option<Kernel>) -> Self {
        Self {
            asked,
            choice,
            cpu: cpu::Baker::new(choice),
            gpu: Gpu::NotLookedFor,
        }
    }

    /// The CPU's sweep with one of the sets of instructions that there are.
    pub(crate) fn sweep_with(instructions: &str) -> Self {
        let sweeper = cpu::Sweeper::with_instructions(instructions).unwrap_or_default();
        let kernel = Some(Kernel::Sweep);
        Self {
            cpu: cpu::Baker::with_sweeper(kernel, sweeper),
            ..Self::new(Asked::Cpu, kernel)
        }
    }

    pub(crate) fn bake(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> anyhow::Result<Seen> {
        self.look()?;
        let Gpu::Found(found) = &mut self.gpu else {
            return self.bake_on_cpu(mesh, spec, options, observer);
        };
        let (context, baker) = &mut **found;
        let failure = match bake_on_gpu(context, baker, mesh, spec, options, observer) {
            Ok(seen) => return Ok(seen),
            Err(error) => error,
        };
        if !self.may_fall_back(&failure) {
            return Err(failure.into());
        }
        // It will not do better with the next model.
        self.gpu = Gpu::None { why: None };
        let mut seen = self.bake_on_cpu(mesh, spec, options, observer)?;
        seen.fell_back = Some(failure.to_string());
        Ok(seen)
    }

    fn look(&mut self) -> anyhow::Result<()> {
        if !matches!(self.gpu, Gpu::NotLookedFor) {
            return Ok(());
        }
        let found = match &self.asked {
            Asked::Cpu => None,
            Asked::Auto => Some(Context::new(&Choice::Real)),
            Asked::Named(name) => Some(Ok(Context::new(&Choice::Named(name.clone()))?)),
            Asked::Gpu(choice) => Some(Ok(Context::new(choice)?)),
        };
        self.gpu = match found {
            None => Gpu::None { why: None },
            Some(Err(error)) => Gpu::None {
                why: Some(error.to_string()),
            },
            Some(Ok(context)) => {
                let baker = gpu::Baker::new(&context, self.choice);
                Gpu::Found(Box::new((context, baker)))
            }
        };
        Ok(())
    }

    /// Whether the CPU could do better, and was not ruled out.
    fn may_fall_back(&self, failure: &gpu::BakeError) -> bool {
        use gpu::BakeError::{Cancelled, NoSweep, Options};
        let is_ours = matches!(failure, Cancelled | NoSweep(_) | Options(_));
        !is_ours && !matches!(self.asked, Asked::Gpu(_))
    }

    fn bake_on_cpu(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> anyhow::Result<Seen> {
        let start = Instant::now();
        let mut prepared = self.cpu.prepare(mesh, spec, options)?;
        let prepare_s = start.elapsed().as_secs_f64();
        let why_cpu = match &self.gpu {
            Gpu::None { why } => why.clone(),
            Gpu::NotLookedFor | Gpu::Found(_) => None,
        };
        let by = By {
            kernel: prepared.kernel(),
            why_rays: prepared.why_rays().map(ToString::to_string),
            adapter: None,
            driver: None,
            why_cpu,
        };
        let start = Instant::now();
        Ok(Seen {
            raw: prepared.bake(observer)?,
            by,
            prepare_s,
            visibility_s: start.elapsed().as_secs_f64(),
            fell_back: None,
        })
    }
}

fn bake_on_gpu(
    context: &Context,
    baker: &mut gpu::Baker,
    mesh: &TriangleMesh,
    spec: GridSpec,
    options: &BakeOptions,
    observer: Observer<'_>,
) -> Result<Seen, gpu::BakeError> {
    let start = Instant::now();
    let mut prepared = baker.prepare(mesh, spec, options)?;
    let prepare_s = start.elapsed().as_secs_f64();
    let info = context.adapter();
    let driver = format!("{} {}", info.driver, info.driver_info);
    let by = By {
        kernel: prepared.kernel(),
        why_rays: prepared.why_rays().map(ToString::to_string),
        adapter: Some(info.name.clone()),
        driver: Some(driver.trim().to_owned()).filter(|driver| !driver.is_empty()),
        why_cpu: None,
    };
    let start = Instant::now();
    Ok(Seen {
        raw: prepared.bake(observer)?,
        by,
        prepare_s,
        visibility_s: start.elapsed().as_secs_f64(),
        fell_back: None,
    })
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::atomic::{AtomicBool, Ordering};

    use aogrid_bake_core::samples::Sample;
    use aogrid_bake_core::{Placement, Progress, UNOBSERVED};

    use super::*;

    /// Bakes with a GPU whose device goes away at its first sign of progress; none without a GPU.
    fn bake_with_lost_device(asked: impl Fn(String) -> Asked) -> Option<anyhow::Result<Seen>> {
        let name = aogrid_tests::gpu()?.adapter().name.clone();
        let mesh = Sample::Table.mesh(None).unwrap();
        let (spec, options) = (spec(&mesh), BakeOptions::recommended());
        let mut backend = Backend::new(asked(name), Some(Kernel::Sweep));
        backend.look().unwrap();
        let Gpu::Found(found) = &backend.gpu else {
            panic!("the adapter was there a moment ago");
        };
        let device = found.0.device().clone();
        let was_gpu = AtomicBool::new(false);
        let destroy = |_: Progress| {
            if !was_gpu.swap(true, Ordering::Relaxed) {
                device.destroy();
            }
            ControlFlow::Continue(())
        };
        let seen = backend.bake(&mesh, spec, &options, &destroy);
        assert!(was_gpu.load(Ordering::Relaxed));
        Some(seen)
    }

    fn spec(mesh: &TriangleMesh) -> GridSpec {
        let placement = Placement {
            resolution: [9; 3],
            ..Placement::default()
        };
        placement.place(&mesh.bounds()).unwrap()
    }

    #[test]
    fn where_a_gpu_fails_midway_the_cpu_bakes_and_says_why() {
        let Some(seen) = bake_with_lost_device(Asked::Named) else {
            return;
        };
        let seen = seen.unwrap();
        assert_eq!(seen.by.backend(), "cpu");
        let why = seen.fell_back.unwrap();
        assert!(why.contains("lost") && why.lines().count() == 1, "{why}");
        let mesh = Sample::Table.mesh(None).unwrap();
        let options = BakeOptions::recommended();
        let alone = Backend::new(Asked::Cpu, None).bake(&mesh, spec(&mesh), &options, UNOBSERVED);
        assert_eq!(seen.raw, alone.unwrap().raw);
    }

    #[test]
    fn a_gpu_that_was_insisted_on_and_fails_midway_is_an_error() {
        let insisted = |name| Asked::Gpu(Choice::Named(name));
        if let Some(seen) = bake_with_lost_device(insisted) {
            let error = seen.err().expect("there is no result").to_string();
            assert!(error.contains("lost"), "{error}");
        }
    }
}
