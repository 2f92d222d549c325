//! The choice between the CPU and a GPU for a bake, with the fallback from one to the other.

use std::time::Instant;

use aogrid_bake_core::{Algorithm, BakeOptions, Observer, RawGrid, TriangleMesh};
use aogrid_baker_cpu as cpu;
use aogrid_baker_gpu::{self as gpu, AdapterSelector, Context};
use aogrid_grid_format::GridSpec;

/// The device that the command line asks for.
#[derive(Clone)]
pub enum BackendRequest {
    /// A hardware GPU if there is one, else the CPU.
    Auto,
    /// The adapter of this name; the CPU if its bake fails.
    Named(String),
    Cpu,
    /// This adapter and nothing else: its failure is an error.
    Gpu(AdapterSelector),
}

/// Bakes on the requested device and keeps it for further bakes. The GPU is opened at the first
/// bake, not before, since that takes a moment.
pub struct Backend {
    request: BackendRequest,
    algorithm: Option<Algorithm>,
    cpu: cpu::Baker,
    gpu: Gpu,
}

/// The state of the search for a GPU.
enum Gpu {
    NotSearched,
    Unavailable { reason: Option<String> },
    Found(Box<(Context, gpu::Baker)>),
}

/// The device and algorithm that made a bake.
#[derive(Clone)]
pub struct Provenance {
    pub algorithm: Algorithm,
    /// Reason for casting rays, if no algorithm was asked for.
    pub rays_reason: Option<String>,
    /// Name of the GPU; none if the CPU baked.
    pub adapter: Option<String>,
    pub driver: Option<String>,
    /// Reason for using the CPU, if the request allowed both.
    pub cpu_reason: Option<String>,
}

impl Provenance {
    pub fn backend(&self) -> &'static str {
        match self.adapter {
            Some(_) => "gpu",
            None => "cpu",
        }
    }
}

/// The result of a bake, with timings.
pub struct TimedBake {
    pub raw: RawGrid,
    pub provenance: Provenance,
    /// Seconds between the loaded mesh and the first direction.
    pub prepare_s: f64,
    pub visibility_s: f64,
    /// The GPU's error, if the CPU took over after it.
    pub gpu_failure: Option<String>,
}

impl Backend {
    pub fn new(request: BackendRequest, algorithm: Option<Algorithm>) -> Self {
        Self {
            request,
            algorithm,
            cpu: cpu::Baker::new(algorithm),
            gpu: Gpu::NotSearched,
        }
    }

    /// Creates a backend that runs the CPU's sweep at one SIMD level.
    pub fn sweep_at_level(level: &str) -> Self {
        let sweeper = cpu::Sweeper::with_simd_level(level).unwrap_or_default();
        let algorithm = Some(Algorithm::DirectionSweep);
        Self {
            cpu: cpu::Baker::with_sweeper(algorithm, sweeper),
            ..Self::new(BackendRequest::Cpu, algorithm)
        }
    }

    pub fn bake(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> anyhow::Result<TimedBake> {
        self.find_gpu()?;
        let Gpu::Found(found) = &mut self.gpu else {
            return self.bake_on_cpu(mesh, spec, options, observer);
        };
        let (context, baker) = &mut **found;
        let failure = match bake_on_gpu(context, baker, mesh, spec, options, observer) {
            Ok(timed) => return Ok(timed),
            Err(error) => error,
        };
        if !self.may_fall_back(&failure) {
            return Err(failure.into());
        }
        // The GPU is not expected to do better with the next model.
        self.gpu = Gpu::Unavailable { reason: None };
        let mut timed = self.bake_on_cpu(mesh, spec, options, observer)?;
        timed.gpu_failure = Some(failure.to_string());
        Ok(timed)
    }

    /// Opens the requested GPU, once.
    fn find_gpu(&mut self) -> anyhow::Result<()> {
        if !matches!(self.gpu, Gpu::NotSearched) {
            return Ok(());
        }
        let found = match &self.request {
            BackendRequest::Cpu => None,
            BackendRequest::Auto => Some(Context::new(&AdapterSelector::Real)),
            BackendRequest::Named(name) => {
                Some(Ok(Context::new(&AdapterSelector::Named(name.clone()))?))
            }
            BackendRequest::Gpu(choice) => Some(Ok(Context::new(choice)?)),
        };
        self.gpu = match found {
            None => Gpu::Unavailable { reason: None },
            Some(Err(error)) => Gpu::Unavailable {
                reason: Some(error.to_string()),
            },
            Some(Ok(context)) => {
                let baker = gpu::Baker::new(&context, self.algorithm);
                Gpu::Found(Box::new((context, baker)))
            }
        };
        Ok(())
    }

    /// Whether the CPU may bake instead: the failure is the GPU's own and the request allows it.
    fn may_fall_back(&self, failure: &gpu::BakeError) -> bool {
        use gpu::BakeError::{Cancelled, Plan};
        let is_independent_of_gpu = matches!(failure, Cancelled | Plan(_));
        !is_independent_of_gpu && !matches!(self.request, BackendRequest::Gpu(_))
    }

    fn bake_on_cpu(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> anyhow::Result<TimedBake> {
        let cpu_reason = match &self.gpu {
            Gpu::Unavailable { reason } => reason.clone(),
            Gpu::NotSearched | Gpu::Found(_) => None,
        };
        let (prepared, prepare_s) =
            timed(|| self.cpu.prepare_observed(mesh, spec, options, observer));
        let mut prepared = prepared?;
        let (raw, visibility_s) = timed(|| prepared.bake(observer));
        Ok(TimedBake {
            raw: raw?,
            provenance: Provenance {
                algorithm: prepared.algorithm(),
                rays_reason: prepared.fallback_reason().map(ToString::to_string),
                adapter: None,
                driver: None,
                cpu_reason,
            },
            prepare_s,
            visibility_s,
            gpu_failure: None,
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
) -> Result<TimedBake, gpu::BakeError> {
    let (prepared, prepare_s) =
        timed(|| context.block_on(baker.prepare_observed(mesh, spec, options, observer)));
    let mut prepared = prepared?;
    let (raw, visibility_s) = timed(|| context.block_on(prepared.bake(observer)));
    let info = context.adapter();
    let driver = format!("{} {}", info.driver, info.driver_info);
    Ok(TimedBake {
        raw: raw?,
        provenance: Provenance {
            algorithm: prepared.algorithm(),
            rays_reason: prepared.fallback_reason().map(ToString::to_string),
            adapter: Some(info.name.clone()),
            driver: Some(driver.trim().to_owned()).filter(|driver| !driver.is_empty()),
            cpu_reason: None,
        },
        prepare_s,
        visibility_s,
        gpu_failure: None,
    })
}

/// Returns the result of some work, and its seconds.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::atomic::{AtomicBool, Ordering};

    use aogrid_bake_core::models::Model;
    use aogrid_bake_core::{Placement, Progress, UNOBSERVED};

    use super::*;

    /// Bakes with a GPU whose device is destroyed at its first progress report; `None` without a
    /// GPU.
    fn bake_with_lost_device(
        request: impl Fn(String) -> BackendRequest,
    ) -> Option<anyhow::Result<TimedBake>> {
        let name = aogrid_tests::gpu()?.adapter().name.clone();
        let mesh = Model::Table.mesh(None).unwrap();
        let (spec, options) = (spec(&mesh), BakeOptions::paper());
        let mut backend = Backend::new(request(name), Some(Algorithm::DirectionSweep));
        backend.find_gpu().unwrap();
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
        let timed = backend.bake(&mesh, spec, &options, &destroy);
        assert!(was_gpu.load(Ordering::Relaxed));
        Some(timed)
    }

    fn spec(mesh: &TriangleMesh) -> GridSpec {
        let placement = Placement {
            resolution: [9; 3],
            ..Placement::paper()
        };
        placement.place(&mesh.bounds()).unwrap()
    }

    #[test]
    fn the_cpu_takes_over_from_a_lost_gpu_and_reports_why() {
        let Some(timed) = bake_with_lost_device(BackendRequest::Named) else {
            return;
        };
        let timed = timed.unwrap();
        assert_eq!(timed.provenance.backend(), "cpu");
        let why = timed.gpu_failure.unwrap();
        assert!(why.contains("lost") && why.lines().count() == 1, "{why}");
        let mesh = Model::Table.mesh(None).unwrap();
        let options = BakeOptions::paper();
        let alone =
            Backend::new(BackendRequest::Cpu, None).bake(&mesh, spec(&mesh), &options, UNOBSERVED);
        assert_eq!(timed.raw, alone.unwrap().raw);
    }

    #[test]
    fn a_lost_gpu_is_an_error_if_only_a_gpu_was_requested() {
        let only_gpu = |name| BackendRequest::Gpu(AdapterSelector::Named(name));
        if let Some(timed) = bake_with_lost_device(only_gpu) {
            let error = timed.err().expect("there is no result").to_string();
            assert!(error.contains("lost"), "{error}");
        }
    }
}
