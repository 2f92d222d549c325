//! A device to bake with, and how one is chosen.

use std::sync::{Arc, OnceLock};

use wgpu::{Adapter, AdapterInfo, Device, DeviceType, Instance, Queue};

/// A device and its queue: the caller's own, or one on an adapter that is chosen here.
#[derive(Clone, Debug)]
pub struct Context {
    pub(crate) device: Device,
    pub(crate) queue: Queue,
    info: AdapterInfo,
    lost: Arc<OnceLock<String>>,
}

/// Which adapter to bake with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The fastest real GPU; software is none.
    Real,
    /// The first whose name holds this, whatever its case: also software.
    Named(String),
}

/// Why there is no device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ContextError {
    /// The machine has none that counts.
    #[error("no GPU was found{}", software(.0))]
    NoGpu(Vec<String>),
    /// No adapter has such a name.
    #[error("no adapter is named like `{name}`; there {}", listed(.available))]
    NotFound {
        /// What was asked for.
        name: String,
        /// What there is.
        available: Vec<String>,
    },
    /// It offers less than every WebGPU implementation must.
    #[error("{adapter} offers less than WebGPU guarantees: {limit}")]
    Limits {
        /// Its name.
        adapter: String,
        /// What it lacks.
        limit: String,
    },
    /// The driver gave no device.
    #[error("{adapter} gives no device: {reason}")]
    Refused {
        /// Its name.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
}

fn software(names: &[String]) -> String {
    match names {
        [] => String::new(),
        _ => format!(" ({} is software: name it to use it)", names.join(", ")),
    }
}

fn listed(names: &[String]) -> String {
    match names {
        [] => "are none".into(),
        _ => format!("are: {}", names.join(", ")),
    }
}

/// Whether a device is hardware that is not the processor itself.
fn is_real(info: &AdapterInfo) -> bool {
    matches!(
        info.device_type,
        DeviceType::DiscreteGpu | DeviceType::IntegratedGpu | DeviceType::VirtualGpu
    )
}

/// The better, the lower.
fn preference(info: &AdapterInfo) -> u32 {
    match info.device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

/// All adapters of this machine, the best first; none where there is no driver.
pub fn adapters() -> Vec<AdapterInfo> {
    all().iter().map(Adapter::get_info).collect()
}

fn all() -> Vec<Adapter> {
    let instance = Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let backends = wgpu::Backends::PRIMARY;
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    adapters.sort_by_key(|adapter| preference(&adapter.get_info()));
    adapters
}

/// To filter float grids, and to multiply into float targets.
const FLOATS: wgpu::Features =
    wgpu::Features::FLOAT32_FILTERABLE.union(wgpu::Features::FLOAT32_BLENDABLE);

impl Context {
    /// A device on an adapter of this machine, with the best limits that it offers.
    ///
    /// # Errors
    ///
    /// No such adapter, or one that gives no device.
    pub fn new(choice: &Choice) -> Result<Self, ContextError> {
        let adapters = all();
        let names = || adapters.iter().map(|a| a.get_info().name).collect();
        let chosen = match choice {
            Choice::Real => adapters.iter().find(|a| is_real(&a.get_info())),
            Choice::Named(name) => {
                let name = name.to_lowercase();
                let matches = |a: &&Adapter| a.get_info().name.to_lowercase().contains(&name);
                adapters.iter().find(matches)
            }
        };
        match (chosen, choice) {
            (Some(adapter), _) => Self::on(adapter),
            (None, Choice::Real) => Err(ContextError::NoGpu(names())),
            (None, Choice::Named(name)) => Err(ContextError::NotFound {
                name: name.clone(),
                available: names(),
            }),
        }
    }

    /// A device on this adapter, with the best limits that it offers.
    ///
    /// # Errors
    ///
    /// The adapter offers less than WebGPU's defaults, or gives no device.
    pub fn on(adapter: &Adapter) -> Result<Self, ContextError> {
        let name = adapter.get_info().name;
        let limits = adapter.limits();
        let mut lacking = None;
        wgpu::Limits::defaults().check_limits_with_fail_fn(&limits, false, |what, want, has| {
            // Nothing is drawn, and nothing presented.
            if is_used(what) {
                lacking.get_or_insert_with(|| format!("{what} is {has} and not {want}"));
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

    /// A device on this adapter with these limits, which may be as low as
    /// [`wgpu::Limits::defaults`].
    ///
    /// # Errors
    ///
    /// The adapter does not offer them, or gives no device.
    pub fn with_limits(adapter: &Adapter, limits: wgpu::Limits) -> Result<Self, ContextError> {
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("aogrid baker"),
            required_limits: limits,
            // Nothing here needs them: shading with what was baked does, on the same device.
            required_features: adapter.features() & FLOATS,
            ..Default::default()
        };
        let device = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = device.map_err(|error| ContextError::Refused {
            adapter: adapter.get_info().name,
            reason: error.to_string(),
        })?;
        let lost = Arc::new(OnceLock::new());
        let told = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, message| {
            // The first reason is the one that counts.
            let _ = told.set(format!("{reason:?}: {message}"));
        });
        Ok(Self {
            info: adapter.get_info(),
            device,
            queue,
            lost,
        })
    }

    /// Bakes with a device that the caller has made, and keeps: its callbacks are left alone,
    /// so that its loss is noticed at the next answer that does not come.
    pub fn from_device(device: &Device, queue: &Queue) -> Self {
        Self {
            info: device.adapter_info(),
            device: device.clone(),
            queue: queue.clone(),
            lost: Arc::default(),
        }
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Its queue.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// Name, driver and kind of the adapter.
    pub fn adapter(&self) -> &AdapterInfo {
        &self.info
    }

    /// Why the device is gone, if it is and has said so.
    pub(crate) fn why_lost(&self) -> Option<&String> {
        self.lost.get()
    }
}

/// Whether a limit is one that the baker comes near.
fn is_used(limit: &str) -> bool {
    ["compute", "storage_buffer", "uniform_buffer", "buffer_size"]
        .iter()
        .any(|part| limit.contains(part))
}
