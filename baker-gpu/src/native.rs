//! What a browser lacks: all adapters of the machine to select from, and waits that block.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::task::{self, Poll, Wake, Waker};
use std::time::Duration;

use wgpu::{Adapter, AdapterInfo, DeviceType, Instance};

use crate::context::{Context, LimitError, required_limits};
use crate::error::BakeError;

/// The number of waits after which a submission of a few hundredths of a second counts as hung.
/// There are several short waits instead of a long one because time also passes while this process
/// is suspended; a wait that is running then ends at once.
const MAX_WAITS: u32 = 12;

/// The length of one wait.
const WAIT: Duration = Duration::from_secs(5);

/// The adapter to bake with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AdapterSelector {
    /// The fastest hardware GPU; software rasterizers are excluded.
    Real,
    /// The first adapter whose name contains this text, ignoring case; software rasterizers are
    /// included.
    Named(String),
}

/// An error of selecting an adapter or creating a device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ContextError {
    /// The machine has no hardware GPU; holds the names of its software rasterizers.
    #[error("no GPU was found{}", software_note(.0))]
    NoGpu(Vec<String>),
    /// No adapter's name contains the requested text.
    #[error("no adapter is named like `{name}`; there {}", list_names(.available))]
    NotFound {
        /// The requested name.
        name: String,
        /// The names of the available adapters.
        available: Vec<String>,
    },
    /// The adapter's limits are below WebGPU's guaranteed minimum.
    #[error("{adapter} offers less than WebGPU guarantees: {limit}")]
    Limits {
        /// The adapter's name.
        adapter: String,
        /// The limit that is too low, with its value and the required one.
        limit: LimitError,
    },
    /// The driver failed to create a device.
    #[error("{adapter} could not create a device: {reason}")]
    Refused {
        /// The adapter's name.
        adapter: String,
        /// The driver's message.
        reason: String,
    },
}

fn software_note(names: &[String]) -> String {
    match names {
        [] => String::new(),
        _ => format!(
            " ({}: software rasterizer, used only if selected by name)",
            names.join(", ")
        ),
    }
}

fn list_names(names: &[String]) -> String {
    match names {
        [] => "are none".into(),
        _ => format!("are: {}", names.join(", ")),
    }
}

/// Whether an adapter is hardware other than the CPU.
fn is_hardware(info: &AdapterInfo) -> bool {
    matches!(
        info.device_type,
        DeviceType::DiscreteGpu | DeviceType::IntegratedGpu | DeviceType::VirtualGpu
    )
}

/// The sort key of an adapter; lower is better.
fn preference(info: &AdapterInfo) -> u32 {
    match info.device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

/// Returns all adapters of this machine, the best first; the list is empty without a driver.
pub fn adapters() -> Vec<AdapterInfo> {
    all_adapters().iter().map(Adapter::get_info).collect()
}

fn all_adapters() -> Vec<Adapter> {
    let instance = Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let backends = wgpu::Backends::PRIMARY;
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    adapters.sort_by_key(|adapter| preference(&adapter.get_info()));
    adapters
}

/// The features for shading with grids: filtering float textures and blending into float
/// targets.
const SHADING_FEATURES: wgpu::Features =
    wgpu::Features::FLOAT32_FILTERABLE.union(wgpu::Features::FLOAT32_BLENDABLE);

impl Context {
    /// Creates a device on an adapter of this machine, with the best limits that it offers.
    ///
    /// # Errors
    ///
    /// There is no such adapter, or it fails to create a device.
    pub fn new(choice: &AdapterSelector) -> Result<Self, ContextError> {
        let adapters = all_adapters();
        let names = || adapters.iter().map(|a| a.get_info().name).collect();
        let chosen = match choice {
            AdapterSelector::Real => adapters.iter().find(|a| is_hardware(&a.get_info())),
            AdapterSelector::Named(name) => {
                let name = name.to_lowercase();
                let matches = |a: &&Adapter| a.get_info().name.to_lowercase().contains(&name);
                adapters.iter().find(matches)
            }
        };
        match (chosen, choice) {
            (Some(adapter), _) => Self::on(adapter),
            (None, AdapterSelector::Real) => Err(ContextError::NoGpu(names())),
            (None, AdapterSelector::Named(name)) => Err(ContextError::NotFound {
                name: name.clone(),
                available: names(),
            }),
        }
    }

    /// Creates a device on this adapter, with the best limits that it offers.
    ///
    /// # Errors
    ///
    /// The adapter offers less than WebGPU's defaults, or fails to create a device.
    pub fn on(adapter: &Adapter) -> Result<Self, ContextError> {
        let limits = required_limits(&adapter.limits()).map_err(|limit| ContextError::Limits {
            adapter: adapter.get_info().name,
            limit,
        })?;
        Self::with_limits(adapter, limits)
    }

    /// Creates a device on this adapter with these limits, which may be as low as
    /// [`wgpu::Limits::defaults`].
    ///
    /// # Errors
    ///
    /// The adapter does not offer these limits, or fails to create a device.
    pub fn with_limits(adapter: &Adapter, limits: wgpu::Limits) -> Result<Self, ContextError> {
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("aogrid baker"),
            required_limits: limits,
            // The bake does not need these features; shading with the result on the same device
            // does.
            required_features: adapter.features() & SHADING_FEATURES,
            ..Default::default()
        };
        let device = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = device.map_err(|error| ContextError::Refused {
            adapter: adapter.get_info().name,
            reason: error.to_string(),
        })?;
        Ok(Self::from_own_device(&device, &queue))
    }

    /// Completes work of the baker on this device, such as a bake, and blocks the thread meanwhile.
    ///
    /// # Errors
    ///
    /// The errors of the work; the device stops responding.
    pub fn block_on<T>(
        &self,
        work: impl Future<Output = Result<T, BakeError>>,
    ) -> Result<T, BakeError> {
        let woken = Arc::<Woken>::default();
        let waker = Waker::from(Arc::clone(&woken));
        let mut task = task::Context::from_waker(&waker);
        let mut work = pin!(work);
        loop {
            if let Poll::Ready(result) = work.as_mut().poll(&mut task) {
                return result;
            }
            self.wait()?;
            // If several threads use a device, another one's poll may have taken the callback and
            // not called it yet.
            if !woken.wait() {
                return Err(self.lost("it stopped responding"));
            }
        }
    }

    /// Waits until the device has finished all that is submitted.
    fn wait(&self) -> Result<(), BakeError> {
        let mut result = Ok(());
        for _ in 0..MAX_WAITS {
            result = self.wait_once();
            if !matches!(result, Err(BakeError::Hung(_))) {
                break;
            }
        }
        result
    }

    fn wait_once(&self) -> Result<(), BakeError> {
        let latest = wgpu::PollType::Wait {
            submission_index: None,
            timeout: Some(WAIT),
        };
        // wgpu panics if the driver reports a lost device during a wait.
        let polled = catch_unwind(AssertUnwindSafe(|| self.device.poll(latest)));
        match polled {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(wgpu::PollError::Timeout)) => {
                Err(BakeError::Hung(u64::from(MAX_WAITS) * WAIT.as_secs()))
            }
            Ok(Err(error)) => Err(self.lost(&error.to_string())),
            Err(_) => Err(self.lost("it stopped responding")),
        }
    }
}

/// A waker that remembers its call.
#[derive(Default)]
struct Woken {
    flag: Mutex<bool>,
    changed: Condvar,
}

impl Woken {
    /// Waits a little for the waker's call; returns whether it was called since the last wait.
    fn wait(&self) -> bool {
        let flag = self.flag.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.changed.wait_timeout_while(flag, WAIT, |woken| !*woken);
        let (mut flag, _) = waited.unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut flag)
    }
}

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        *self.flag.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.changed.notify_all();
    }
}
