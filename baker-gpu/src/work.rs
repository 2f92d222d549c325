//! Dispatches kernels in short submissions, with progress reports, cancellation and error
//! handling.

use aogrid_bake_core::{Observer, Progress};
use wgpu::{BindGroup, Buffer, BufferUsages, CommandEncoder, ErrorFilter, ErrorScopeGuard};

use crate::kernel::{CHUNK_STRIDE, Kernel};
use crate::pace::SubmissionPacer;
use crate::signal::{Signal, signal};
use crate::{BakeError, Context};

/// The largest number of dispatches in a submission.
const MAX_DISPATCHES: usize = 256;

/// WebGPU's limit on workgroups along an axis of a dispatch.
const MAX_WORKGROUPS: u32 = 65_535;

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
    pub(crate) async fn dispatch(
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
                self.flush().await?;
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
    pub(crate) async fn flush(&mut self) -> Result<(), BakeError> {
        if let Some(encoder) = self.encoder.take() {
            let mut slots = vec![0_u8; self.firsts.len() * CHUNK_STRIDE as usize];
            for (slot, first) in slots.chunks_mut(CHUNK_STRIDE as usize).zip(&self.firsts) {
                slot[..4].copy_from_slice(&first.to_le_bytes());
            }
            if !slots.is_empty() {
                self.context.queue.write_buffer(&self.chunks, 0, &slots);
            }
            let clock = self.context.clock();
            let start = clock.map(|now| now());
            self.context.queue.submit([encoder.finish()]);
            let (trigger, finished) = signal();
            let fire = move || trigger.fire(true);
            self.context.queue.on_submitted_work_done(fire);
            self.settle(vec![finished]).await?;
            if let (Some(now), Some(start), true) = (clock, start, self.units > 0.0) {
                self.pacer.record(self.units, now().saturating_sub(start));
            }
            self.units = 0.0;
            self.firsts.clear();
        } else {
            self.check().await?;
        }
        match (self.observer)(self.progress).is_break() {
            true => Err(BakeError::Cancelled),
            false => Ok(()),
        }
    }

    /// Reads buffers back after all pending commands: returns the given number of bytes of each
    /// of `buffers`.
    pub(crate) async fn read(
        &mut self,
        buffers: &[(&Buffer, u64)],
    ) -> Result<Vec<Vec<u8>>, BakeError> {
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
        self.flush().await?;
        let mapped = staging.iter().map(map).collect();
        self.settle(mapped).await?;
        let unreadable = |_| self.context.lost("it stopped responding");
        let bytes = |b: &Buffer| Ok(b.get_mapped_range(..).map_err(unreadable)?.to_vec());
        staging.iter().map(bytes).collect()
    }

    /// Returns the first error of the calls so far.
    pub(crate) async fn check(&mut self) -> Result<(), BakeError> {
        self.settle(Vec::new()).await
    }

    /// Waits for signals of the calls so far, and returns their first error. No error scope is open
    /// during the wait, in which others may use the device.
    async fn settle(&mut self, pending: Vec<Signal>) -> Result<(), BakeError> {
        if let Some(reason) = self.context.lost_reason() {
            return Err(BakeError::Lost(reason.clone()));
        }
        match pop_scopes(self.scopes.take()).await {
            // On a lost device every call fails validation.
            Err(BakeError::Refused(_)) if is_lost(self.context).await => {
                return Err(self.context.lost("it stopped responding"));
            }
            result => result?,
        }
        for signal in pending {
            if !signal.await {
                return Err(self.context.lost("it stopped responding"));
            }
        }
        self.scopes = Some(push_scopes(self.context));
        Ok(())
    }
}

impl Drop for Submitter<'_> {
    fn drop(&mut self) {
        // Errors still in the scopes have been reported or no longer matter.
        drop(pop_scopes(self.scopes.take()));
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

/// Ends the scopes at once; the future has their first error.
fn pop_scopes(scopes: Option<[ErrorScopeGuard; 3]>) -> impl Future<Output = Result<(), BakeError>> {
    // Scopes are a stack: the last one is popped first. Out of memory is thus reported before
    // validation errors, which follow from using a buffer that could not be allocated.
    let scopes = scopes.into_iter().flatten().rev();
    let errors: Vec<_> = scopes.map(ErrorScopeGuard::pop).collect();
    async {
        let mut result = Ok(());
        for error in errors {
            if let (Some(error), Ok(())) = (error.await, &result) {
                result = Err(match error {
                    wgpu::Error::OutOfMemory { .. } => BakeError::OutOfMemory,
                    other => BakeError::Refused(one_line(&other.to_string())),
                });
            }
        }
        result
    }
}

/// Maps a buffer for reading.
fn map(buffer: &Buffer) -> Signal {
    let (trigger, mapped) = signal();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        trigger.fire(result.is_ok());
    });
    mapped
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Whether the device is lost: probed by creating and mapping a small buffer, which a working
/// device always can.
async fn is_lost(context: &Context) -> bool {
    let scopes = push_scopes(context);
    let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("sign of life"),
        size: 16,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mapped = map(&buffer);
    let _ = pop_scopes(Some(scopes)).await;
    !mapped.await
}
