//! Devices, and the meaning of `AOGRID_GPU`.

use std::error::Error;
use std::io::{Write, stderr};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The environment variable that makes a missing adapter or display a failure.
const VARIABLE: &str = "AOGRID_GPU";

/// A lock that makes tests take turns: a software rasterizer uses all cores for one draw.
static TURN: Mutex<()> = Mutex::new(());

/// A device, its queue and its adapter.
#[derive(Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The adapter's name and type.
    pub adapter: wgpu::AdapterInfo,
    /// The turn of a test.
    _turn: Option<MutexGuard<'static, ()>>,
}

impl Gpu {
    /// Returns a device on wgpu's first choice of adapters, with those of `features` that it
    /// supports.
    ///
    /// # Errors
    ///
    /// If there is no adapter, or it makes no device.
    pub fn new(features: wgpu::Features) -> Result<Self, Box<dyn Error>> {
        Ok(Self::on(&first_adapter()?, features)?)
    }

    /// Returns a device on an adapter, with those of `features` that it supports.
    ///
    /// # Errors
    ///
    /// If the adapter makes no device.
    pub fn on(
        adapter: &wgpu::Adapter,
        features: wgpu::Features,
    ) -> Result<Self, wgpu::RequestDeviceError> {
        Self::limited(adapter, features, wgpu::Limits::default())
    }

    fn limited(
        adapter: &wgpu::Adapter,
        features: wgpu::Features,
        limits: wgpu::Limits,
    ) -> Result<Self, wgpu::RequestDeviceError> {
        let device = adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: features & adapter.features(),
            required_limits: limits,
            ..Default::default()
        });
        let (device, queue) = pollster::block_on(device)?;
        Ok(Self {
            device,
            queue,
            adapter: adapter.get_info(),
            _turn: None,
        })
    }

    /// Returns the largest error of a filter's weight along one axis. Texture units weight texels
    /// with 8 bits or more (`subTexelPrecisionBits` is 8 on all devices that matter), rounded or
    /// truncated; Mesa's software rasterizer does so for 8-bit texels, and filters float texels in
    /// single precision.
    pub fn weight_error(&self, eight_bit_texels: bool) -> f32 {
        match self.adapter.device_type == wgpu::DeviceType::Cpu && !eight_bit_texels {
            true => 0.0,
            false => 1.0 / 256.0,
        }
    }
}

fn first_adapter() -> Result<wgpu::Adapter, wgpu::RequestAdapterError> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    pollster::block_on(instance.request_adapter(&Default::default()))
}

/// Returns a device that blends and filters single floats where the adapter does, or `None` with a
/// note if there is no adapter. Nothing captures validation errors, so they panic.
pub fn gpu() -> Option<Gpu> {
    gpu_with(wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::FLOAT32_BLENDABLE)
}

/// Returns a device with those of `features` that the adapter supports, for one test at a time.
///
/// # Panics
///
/// If the adapter makes no device, or there is no adapter and `AOGRID_GPU=require` is set.
pub fn gpu_with(features: wgpu::Features) -> Option<Gpu> {
    gpu_with_limits(features, wgpu::Limits::default())
}

/// Returns a device with those of `features` that the adapter supports and with these limits, for one
/// test at a time.
///
/// # Panics
///
/// If the adapter makes no device, or there is no adapter and `AOGRID_GPU=require` is set.
pub fn gpu_with_limits(features: wgpu::Features, limits: wgpu::Limits) -> Option<Gpu> {
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    match first_adapter() {
        Ok(adapter) => Some(Gpu {
            _turn: Some(turn),
            ..Gpu::limited(&adapter, features, limits).expect("the adapter makes a device")
        }),
        Err(error) => {
            skip(&error.to_string());
            None
        }
    }
}

/// Notes that a test is skipped, for want of an adapter or a display.
///
/// # Panics
///
/// If `AOGRID_GPU=require` is set.
pub fn skip(why: &str) {
    let is_required = std::env::var(VARIABLE).is_ok_and(|value| value == "require");
    assert!(!is_required, "{VARIABLE}=require, but: {why}");
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    // Past the capture of the test harness.
    let _ = writeln!(stderr(), "SKIPPED {test}: {why} ({VARIABLE})");
}
