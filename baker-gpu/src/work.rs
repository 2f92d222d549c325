//! Dispatches kernels in short submissions, with progress reports, cancellation and error
//! handling.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use aogrid_bake_core::{Observer, Progress};
use wgpu::{BindGroup, Buffer, BufferUsages, CommandEncoder, ErrorFilter, ErrorScopeGuard};

use crate::kernel::{CHUNK_STRIDE, Kernel};
use crate::pace::SubmissionPacer;
use crate::{BakeError, Context};

/// The largest number of dispatches in a submission.
const MAX_DISPATCHES: usize = 256;

/// WebGPU's limit on workgroups along an axis of a dispatch.
const MAX_WORKGROUPS: u32 = 65_535;

/// The number of waits after which a submission of [`SubmissionPacer`]'s length counts as hung.
/// There are several short waits instead of a long one because time also passes while this process
/// is suspended; a wait that is running then ends at once.
const MAX_WAITS: u32 = 12;

/// The length of one wait.
const WAIT: Duration = Duration::from_secs(5);

/// Records and submits the dispatches of one bake.
pub(crate) struct Submitter<'a> {
    context: &'a Context,
    pacer: &'a mut SubmissionPacer,
    observer: Observer<'a>,
    progress: Progress,
    scopes: Option<[ErrorScopeGuard; 3]>,
    encoder: Option<CommandEncoder>,
    /// The uniform buffer with a `Chunk` for each pending dispatch, `CHUNK_STRIDE` bytes apart.
    chunks: Buffer,
    /// The first workgroup of each pending dispatch.
    firsts: Vec<u32>,
    /// The work units of the pending dispatches.
    units: f64,
}

/// The workgroups to dispatch: `n` along x, which may be split into several dispatches, and `y`
/// and `z` as they are.
#[derive(Clone, Copy)]
pub(crate) struct Extent {
    pub n: u32,
    pub y: u32,
    pub z: u32,
    /// The work units of one workgroup along x with all of its y and z, see [`SubmissionPacer`].
    pub units: f64,
}

impl<'a> Submitter<'a> {
    /// Starts a bake. `cells` is the total that progress counts up to.
    pub(crate) fn new(
        context: &'a Context,
        pacer: &'a mut SubmissionPacer,
        observer: Observer<'a>,
        cells: usize,
    ) -> Self {
        let scopes = Some(push_scopes(context));
        Self {
            chunks: context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("chunks"),
                size: CHUNK_STRIDE * MAX_DISPATCHES as u64,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            context,
            pacer,
            observer,
            progress: Progress {
                done: 0,
                total: cells,
            },
            scopes,
            encoder: None,
            firsts: Vec::new(),
            units: 0.0,
        }
    }

    pub(crate) fn context(&self) -> &'a Context {
        self.context
    }

    pub(crate) fn bind(&self, kernel: &Kernel, buffers: &[&Buffer]) -> BindGroup {
        kernel.bind(&self.context.device, &self.chunks, buffers)
    }

    /// Creates a buffer with these bytes that lives as long as this bake.
    pub(crate) fn upload(&self, label: &str, usage: BufferUsages, bytes: &[u8]) -> Buffer {
        let buffer = self.context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: (bytes.len() as u64).max(16).next_multiple_of(16),
            usage: usage | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if !bytes.is_empty() {
            self.context.queue.write_buffer(&buffer, 0, bytes);
        }
        buffer
    }

    /// Sets the number of finished cells that the observer sees after the next submission.
    pub(crate) fn set_done(&mut self, cells: usize) {
        self.progress.done = cells.min(self.progress.total);
    }

    /// Runs a kernel over workgroups, in as many submissions as the pacer asks for.
    pub(crate) fn dispatch(
        &mut self,
        kernel: &Kernel,
        bindings: &BindGroup,
        extent: Extent,
    ) -> Result<(), BakeError> {
        let mut first = 0;
        while first < extent.n {
            // Workgroups that still fit the budget of the pending submission.
            let affordable = (self.pacer.budget() - self.units) / extent.units.max(1.0);
            if self.firsts.len() == MAX_DISPATCHES || (affordable < 1.0 && !self.firsts.is_empty())
            {
                self.flush()?;
                continue;
            }
            let rest = (extent.n - first).min(MAX_WORKGROUPS);
            // A single workgroup is dispatched even if it exceeds the budget.
            let n = (affordable.max(1.0) as u32).min(rest);
            self.encode(kernel, bindings, first, [n, extent.y, extent.z]);
            self.units += f64::from(n) * extent.units;
            first += n;
        }
        Ok(())
    }

    fn encode(&mut self, kernel: &Kernel, bindings: &BindGroup, first: u32, n: [u32; 3]) {
        let slot = self.firsts.len() as u32;
        self.firsts.push(first);
        let mut pass = self.encoder().begin_compute_pass(&Default::default());
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, bindings, &[slot * CHUNK_STRIDE as u32]);
        pass.dispatch_workgroups(n[0], n[1], n[2]);
    }

    pub(crate) fn encoder(&mut self) -> &mut CommandEncoder {
        let device = &self.context.device;
        let create = || device.create_command_encoder(&Default::default());
        self.encoder.get_or_insert_with(create)
    }

    /// Submits the pending commands, waits for them, and calls the observer.
    pub(crate) fn flush(&mut self) -> Result<(), BakeError> {
        if let Some(encoder) = self.encoder.take() {
            let mut slots = vec![0_u8; self.firsts.len() * CHUNK_STRIDE as usize];
            for (slot, first) in slots.chunks_mut(CHUNK_STRIDE as usize).zip(&self.firsts) {
                slot[..4].copy_from_slice(&first.to_le_bytes());
            }
            if !slots.is_empty() {
                self.context.queue.write_buffer(&self.chunks, 0, &slots);
            }
            let start = Instant::now();
            let submission = self.context.queue.submit([encoder.finish()]);
            wait(self.context, submission)?;
            if self.units > 0.0 {
                self.pacer.record(self.units, start.elapsed());
            }
            self.units = 0.0;
            self.firsts.clear();
        }
        self.check()?;
        match (self.observer)(self.progress).is_break() {
            true => Err(BakeError::Cancelled),
            false => Ok(()),
        }
    }

    /// Reads buffers back after all pending commands: returns the given number of bytes of each
    /// of `buffers`.
    pub(crate) fn read(&mut self, buffers: &[(&Buffer, u64)]) -> Result<Vec<Vec<u8>>, BakeError> {
        let device = &self.context.device;
        let staging: Vec<_> = buffers
            .iter()
            .map(|(_, size)| {
                device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("read back"),
                    size: *size,
                    usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                })
            })
            .collect();
        for ((from, size), to) in buffers.iter().zip(&staging) {
            self.encoder().copy_buffer_to_buffer(from, 0, to, 0, *size);
        }
        self.flush()?;
        let (done, mapped) = mpsc::channel();
        for buffer in &staging {
            let done = done.clone();
            buffer.map_async(wgpu::MapMode::Read, .., move |result| {
                // The receiver is gone if the bake has failed.
                let _ = done.send(result.is_ok());
            });
        }
        drop(done);
        poll(self.context, wgpu::PollType::wait_indefinitely())?;
        if staging.iter().any(|_| !is_mapped(&mapped)) {
            self.check()?;
            return Err(lost(self.context, "it stopped responding"));
        }
        let unreadable = |_| lost(self.context, "it stopped responding");
        let bytes = |b: &Buffer| Ok(b.get_mapped_range(..).map_err(unreadable)?.to_vec());
        staging.iter().map(bytes).collect()
    }

    /// Returns the first error of the calls so far.
    pub(crate) fn check(&mut self) -> Result<(), BakeError> {
        if let Some(reason) = self.context.lost_reason() {
            return Err(BakeError::Lost(reason.clone()));
        }
        let result = pop_scopes(self.scopes.take());
        self.scopes = Some(push_scopes(self.context));
        match result {
            // On a lost device every call fails validation.
            Err(BakeError::Refused(_)) if is_lost(self.context) => {
                Err(lost(self.context, "it stopped responding"))
            }
            result => result,
        }
    }
}

impl Drop for Submitter<'_> {
    fn drop(&mut self) {
        // Scopes are a stack and must be popped in reverse order. Errors still in them have been
        // reported or no longer matter.
        let _ = pop_scopes(self.scopes.take());
    }
}

/// Captures errors of the following calls, which would otherwise panic.
fn push_scopes(context: &Context) -> [ErrorScopeGuard; 3] {
    [
        ErrorFilter::Internal,
        ErrorFilter::Validation,
        ErrorFilter::OutOfMemory,
    ]
    .map(|filter| context.device.push_error_scope(filter))
}

fn pop_scopes(scopes: Option<[ErrorScopeGuard; 3]>) -> Result<(), BakeError> {
    let mut result = Ok(());
    // The scope pushed last is popped first. Out of memory is thus reported before validation
    // errors, which follow from using a buffer that could not be allocated.
    for scope in scopes.into_iter().flatten().rev() {
        let error = pollster::block_on(scope.pop());
        if let (Some(error), Ok(())) = (error, &result) {
            result = Err(match error {
                wgpu::Error::OutOfMemory { .. } => BakeError::OutOfMemory,
                other => BakeError::Refused(one_line(&other.to_string())),
            });
        }
    }
    result
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn wait(context: &Context, submission: wgpu::SubmissionIndex) -> Result<(), BakeError> {
    let mut result = Ok(());
    for _ in 0..MAX_WAITS {
        let poll_type = wgpu::PollType::Wait {
            submission_index: Some(submission.clone()),
            timeout: Some(WAIT),
        };
        result = poll(context, poll_type);
        if !matches!(result, Err(BakeError::Hung(_))) {
            break;
        }
    }
    result
}

fn poll(context: &Context, poll_type: wgpu::PollType) -> Result<(), BakeError> {
    // wgpu panics if the driver reports a lost device during a wait.
    let polled = catch_unwind(AssertUnwindSafe(|| context.device.poll(poll_type)));
    match polled {
        Ok(Ok(_)) => Ok(()),
        Ok(Err(wgpu::PollError::Timeout)) => {
            Err(BakeError::Hung(u64::from(MAX_WAITS) * WAIT.as_secs()))
        }
        Ok(Err(error)) => Err(lost(context, &error.to_string())),
        Err(_) => Err(lost(context, "it stopped responding")),
    }
}

/// Returns the reason that the device gave for its loss, or `otherwise`.
fn lost(context: &Context, otherwise: &str) -> BakeError {
    let reason = context.lost_reason().cloned();
    BakeError::Lost(reason.unwrap_or_else(|| otherwise.to_owned()))
}

/// Whether the next buffer of a poll that has returned is mapped. If several threads use a device,
/// another one's poll may have taken the callback and not called it yet: so this waits a little.
fn is_mapped(mapped: &mpsc::Receiver<bool>) -> bool {
    mapped.recv_timeout(WAIT) == Ok(true)
}

/// Whether the device is lost: probed by creating and mapping a small buffer, which a working
/// device always can.
fn is_lost(context: &Context) -> bool {
    let scopes = push_scopes(context);
    let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("sign of life"),
        size: 16,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let (done, mapped) = mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        let _ = done.send(result.is_ok());
    });
    let polled = poll(context, wgpu::PollType::wait_indefinitely());
    let _ = pop_scopes(Some(scopes));
    polled.is_err() || !is_mapped(&mapped)
}
