//! The device to bake with, and the selection of an adapter.

use std::sync::{Arc, OnceLock};

use wgpu::{Adapter, AdapterInfo, Device, DeviceType, Instance, Queue};

/// A device and its queue: the caller's own, or one on an adapter that is selected here.
#[derive(Clone, Debug)]
pub struct Context {
    pub(crate) device: Device,
    pub(crate) queue: Queue,
    info: AdapterInfo,
    lost: Arc<OnceLock<String>>,
}

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
        limit: String,
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
        let name = adapter.get_info().name;
        let limits = adapter.limits();
        let mut lacking = None;
        wgpu::Limits::defaults().check_limits_with_fail_fn(&limits, false, |what, want, has| {
            // Limits on drawing and presenting do not matter to a bake.
            if is_relevant(what) {
                lacking.get_or_insert_with(|| format!("{what} is {has}, {want} is required"));
            }
        });
        if let Some(limit) = lacking {
            return Err(ContextError::Limits {
                adapter: name,
                limit,
            });
        }
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
        let lost = Arc::new(OnceLock::new());
        let reason_cell = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, message| {
            // Later reasons are only consequences of the first.
            let _ = reason_cell.set(format!("{reason:?}: {message}"));
        });
        Ok(Self {
            info: adapter.get_info(),
            device,
            queue,
            lost,
        })
    }

    /// Wraps a device that the caller has created and owns. Its device-lost callback is left
    /// alone, so a loss is only noticed when the next call on the device fails.
    pub fn from_device(device: &Device, queue: &Queue) -> Self {
        Self {
            info: device.adapter_info(),
            device: device.clone(),
            queue: queue.clone(),
            lost: Arc::default(),
        }
    }

    /// Returns the device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Returns the device's queue.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// Returns the name, driver and type of the adapter.
    pub fn adapter(&self) -> &AdapterInfo {
        &self.info
    }

    /// Returns the reason of the device's loss, if it is lost and has reported so.
    pub(crate) fn lost_reason(&self) -> Option<&String> {
        self.lost.get()
    }
}

/// Whether the baker depends on a limit.
fn is_relevant(limit: &str) -> bool {
    ["compute", "storage_buffer", "uniform_buffer", "buffer_size"]
        .iter()
        .any(|part| limit.contains(part))
}
