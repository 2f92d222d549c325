//! The device to bake with, and what the baker asks of it.

use std::sync::{Arc, OnceLock};

use wgpu::{AdapterInfo, Device, Limits, Queue};

use crate::BakeError;
use crate::clock::{self, Clock};

/// A device and its queue, which somebody else has made.
#[derive(Clone, Debug)]
pub struct Context {
    pub(crate) device: Device,
    pub(crate) queue: Queue,
    info: AdapterInfo,
    clock: Option<Clock>,
    lost: Arc<OnceLock<String>>,
}

/// A limit of an adapter that is below WebGPU's guaranteed minimum, with its value and the required
/// one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct LimitError(String);

/// Returns the limits to create a device with for baking, given those that the adapter offers: all
/// of these, since larger buffers take larger meshes. The baker needs no features.
///
/// # Errors
///
/// The adapter offers less than [`Limits::defaults`] where it matters to a bake.
pub fn required_limits(offered: &Limits) -> Result<Limits, LimitError> {
    let mut lacking = None;
    Limits::defaults().check_limits_with_fail_fn(offered, false, |what, want, has| {
        // Limits on drawing and presenting do not matter to a bake.
        if is_relevant(what) {
            lacking.get_or_insert_with(|| format!("{what} is {has}, {want} is required"));
        }
    });
    match lacking {
        Some(limit) => Err(LimitError(limit)),
        None => Ok(offered.clone()),
    }
}

impl Context {
    /// Wraps a device that the caller has created and owns, with the [`required_limits`] of its
    /// adapter or as little as [`Limits::defaults`]. Its device-lost callback is left alone, so a
    /// loss is only noticed when the next call on the device fails.
    pub fn from_device(device: &Device, queue: &Queue) -> Self {
        Self {
            info: device.adapter_info(),
            device: device.clone(),
            queue: queue.clone(),
            clock: clock::DEFAULT,
            lost: Arc::default(),
        }
    }

    /// Wraps a device of ours, whose loss is reported with its reason.
    #[cfg(feature = "native")]
    pub(crate) fn from_own_device(device: &Device, queue: &Queue) -> Self {
        let context = Self::from_device(device, queue);
        let reason_cell = Arc::clone(&context.lost);
        device.set_device_lost_callback(move |reason, message| {
            // Later reasons are only consequences of the first.
            let _ = reason_cell.set(format!("{reason:?}: {message}"));
        });
        context
    }

    /// Times submissions by this clock. Without one, as in a build without the feature `native`,
    /// all submissions stay as short as a slow device needs, which a fast one pays for.
    pub fn with_clock(self, clock: Clock) -> Self {
        Self {
            clock: Some(clock),
            ..self
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

    pub(crate) fn clock(&self) -> Option<Clock> {
        self.clock
    }

    /// Returns the reason of the device's loss, if it is lost and has reported so.
    pub(crate) fn lost_reason(&self) -> Option<&String> {
        self.lost.get()
    }

    /// Returns the error of a lost device, with the reason that it gave or `otherwise`.
    pub(crate) fn lost(&self, otherwise: &str) -> BakeError {
        let reason = self.lost_reason().cloned();
        BakeError::Lost(reason.unwrap_or_else(|| otherwise.to_owned()))
    }
}

/// Whether the baker depends on a limit.
fn is_relevant(limit: &str) -> bool {
    ["compute", "storage_buffer", "uniform_buffer", "buffer_size"]
        .iter()
        .any(|part| limit.contains(part))
}
