//! Dispatches in submissions that are short enough, watched, with every error caught.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use aogrid_bake_core::{Observer, Progress};
use wgpu::{BindGroup, Buffer, BufferUsages, CommandEncoder, ErrorFilter, ErrorScopeGuard};

use crate::kernel::{CHUNK_STRIDE, Kernel as Pipeline};
use crate::pace::Pace;
use crate::{BakeError, Context};

/// Dispatches a submission, at most.
const MOST_DISPATCHES: usize = 256;

/// WebGPU's limit on workgroups along an axis of a dispatch.
const MOST_WORKGROUPS: u32 = 65_535;

/// A submission of [`Pace`]'s length that so many waits see no end of never ends. Not one long
/// wait: time also passes while this process is stopped, and then the first is over at once.
const WAITS: u32 = 12;
const WAIT: Duration = Duration::from_secs(5);

/// What a device is asked to do in one bake.
pub(crate) struct Work<'a> {
    context: &'a Context,
    pace: &'a mut Pace,
    observer: Observer<'a>,
    progress: Progress,
    scopes: Option<[ErrorScopeGuard; 3]>,
    encoder: Option<CommandEncoder>,
    /// First workgroups of the pending dispatches, in their buffer's slots.
    chunks: Buffer,
    firsts: Vec<u32>,
    /// Of the pending dispatches.
    units: f64,
}

/// Workgroups to dispatch: as many along x as `n`, cut to measure; y and z as they are.
#[derive(Clone, Copy)]
pub(crate) struct Extent {
    pub n: u32,
    pub y: u32,
    pub z: u32,
    /// Of one workgroup along x with all of its y and z, see [`Pace`].
    pub units: f64,
}

impl<'a> Work<'a> {
    /// `cells` is what progress counts up to.
    pub(crate) fn new(
        context: &'a Context,
        pace: &'a mut Pace,
        observer: Observer<'a>,
        cells: usize,
    ) -> Self {
        let scopes = Some(push_scopes(context));
        Self {
            chunks: context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("chunks"),
                size: CHUNK_STRIDE * MOST_DISPATCHES as u64,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            context,
            pace,
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

    pub(crate) fn bind(&self, kernel: &Pipeline, buffers: &[&Buffer]) -> BindGroup {
        kernel.bind(&self.context.device, &self.chunks, buffers)
    }

    /// A buffer of these bytes that only this bake needs.
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

    /// What the observer will hear of at the next submission's end.
    pub(crate) fn set_done(&mut self, cells: usize) {
        self.progress.done = cells.min(self.progress.total);
    }

    /// Runs a kernel over workgroups, in as many submissions as that takes.
    pub(crate) fn dispatch(
        &mut self,
        kernel: &Pipeline,
        bindings: &BindGroup,
        extent: Extent,
    ) -> Result<(), BakeError> {
        let mut first = 0;
        while first < extent.n {
            let room = (self.pace.budget() - self.units) / extent.units.max(1.0);
            if self.firsts.len() == MOST_DISPATCHES || (room < 1.0 && !self.firsts.is_empty()) {
                self.flush()?;
                continue;
            }
            let rest = (extent.n - first).min(MOST_WORKGROUPS);
            let n = (room.max(1.0) as u32).min(rest);
            self.encode(kernel, bindings, first, [n, extent.y, extent.z]);
            self.units += f64::from(n) * extent.units;
            first += n;
        }
        Ok(())
    }

    fn encode(&mut self, kernel: &Pipeline, bindings: &BindGroup, first: u32, n: [u32; 3]) {
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

    /// Submits what is pending, waits for it, and tells the observer.
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
                self.pace.learn(self.units, start.elapsed());
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

    /// Copies buffers back, after everything pending; one for each of `buffers`.
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
                // Nobody waits any more if the bake has failed.
                let _ = done.send(result.is_ok());
            });
        }
        drop(done);
        poll(self.context, wgpu::PollType::wait_indefinitely())?;
        if staging.iter().any(|_| mapped.try_recv() != Ok(true)) {
            self.check()?;
            return Err(lost(self.context));
        }
        let unreadable = |_| lost(self.context);
        let bytes = |b: &Buffer| Ok(b.get_mapped_range(..).map_err(unreadable)?.to_vec());
        staging.iter().map(bytes).collect()
    }

    /// What went wrong so far.
    pub(crate) fn check(&mut self) -> Result<(), BakeError> {
        if let Some(reason) = self.context.why_lost() {
            return Err(BakeError::Lost(reason.clone()));
        }
        let found = pop_scopes(self.scopes.take());
        self.scopes = Some(push_scopes(self.context));
        match found {
            // On a device that is gone everything is invalid.
            Err(BakeError::Refused(_)) if is_lost(self.context) => Err(lost(self.context)),
            found => found,
        }
    }
}

impl Drop for Work<'_> {
    fn drop(&mut self) {
        // Scopes are a stack: they go in the reverse order of their coming, and what they hold
        // has been told or does not matter any more.
        let _ = pop_scopes(self.scopes.take());
    }
}

/// Errors of the calls from here on, instead of a panic of the process.
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
    // The last pushed is the first popped; memory comes first also as a reason, because calls
    // that follow on what there was no memory for are not valid.
    for scope in scopes.into_iter().flatten().rev() {
        let found = pollster::block_on(scope.pop());
        if let (Some(error), Ok(())) = (found, &result) {
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
    for _ in 0..WAITS {
        let how = wgpu::PollType::Wait {
            submission_index: Some(submission.clone()),
            timeout: Some(WAIT),
        };
        result = poll(context, how);
        if !matches!(result, Err(BakeError::Hung(_))) {
            break;
        }
    }
    result
}

fn poll(context: &Context, how: wgpu::PollType) -> Result<(), BakeError> {
    // wgpu panics where a driver says that the device is lost while it is waited for.
    let polled = catch_unwind(AssertUnwindSafe(|| context.device.poll(how)));
    match polled {
        Ok(Ok(_)) => Ok(()),
        Ok(Err(wgpu::PollError::Timeout)) => {
            Err(BakeError::Hung(u64::from(WAITS) * WAIT.as_secs()))
        }
        Ok(Err(_)) | Err(_) => Err(lost(context)),
    }
}

fn lost(context: &Context) -> BakeError {
    BakeError::Lost(match context.why_lost() {
        Some(reason) => reason.clone(),
        None => "it stopped answering".into(),
    })
}

/// Asks for a buffer and to see it, which every device that is there grants.
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
    polled.is_err() || mapped.try_recv() != Ok(true)
}
