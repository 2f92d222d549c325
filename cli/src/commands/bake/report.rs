//! Reports of bakes: lines for people and JSON for machines.

use std::path::PathBuf;

use anyhow::bail;
use aogrid_bake_core::mesh::MeshReport;
use aogrid_grid_format::{BoundaryMode, Grid, GridSpec, Sampling};
use serde::Serialize;

use super::estimate;
use super::jobs::Job;
use crate::backend::Provenance;
use crate::commands::info;
use crate::console::Console;
use crate::memory;

/// Times of the stages in seconds.
#[derive(Serialize)]
pub(super) struct Times {
    pub load_s: f64,
    /// Time from the loaded mesh to the first direction.
    pub prepare_s: f64,
    pub visibility_s: f64,
    pub post_s: f64,
    pub threads: usize,
}

/// The algorithm and device that made the bake; the key `kernel` of the JSON report.
#[derive(Serialize)]
pub(super) struct BackendReport {
    name: &'static str,
    /// Reason for casting rays, if no algorithm was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    backend: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    adapter: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    driver: Option<String>,
    /// Reason for using the CPU, if the request allowed both.
    #[serde(skip_serializing_if = "Option::is_none")]
    why_cpu: Option<String>,
}

impl BackendReport {
    pub(super) fn new(provenance: Provenance) -> Self {
        Self {
            name: provenance.algorithm.name(),
            backend: provenance.backend(),
            reason: provenance.rays_reason,
            adapter: provenance.adapter,
            driver: provenance.driver,
            why_cpu: provenance.cpu_reason,
        }
    }

    fn line(&self) -> String {
        let device = match (&self.adapter, &self.driver) {
            (Some(adapter), Some(driver)) => format!("{adapter}, {driver}"),
            (Some(adapter), None) => adapter.clone(),
            _ => "CPU".into(),
        };
        let reason = self.reason.iter().map(|reason| format!(": {reason}"));
        let why_cpu = self.why_cpu.iter().map(|why| format!("; {why}"));
        let notes: String = reason.chain(why_cpu).collect();
        format!("{device}, {}{notes}", self.name)
    }
}

/// The box of a grid, and what its bake needs.
pub(super) struct Plan {
    pub spec: GridSpec,
    /// Bytes at the peak.
    pub memory: u64,
    /// About the seconds on the CPU, where the resolution is known.
    pub seconds: Option<f64>,
}

/// A fresh grid with all that its report says.
pub(super) struct Baked {
    pub grid: Grid,
    pub report: MeshReport,
    /// All that was warned of, without the title.
    pub warnings: Vec<String>,
    pub backend: BackendReport,
    pub times: Times,
}

/// The report of one job.
pub(super) struct Outcome {
    json: OutcomeJson,
    lines: Vec<String>,
}

#[derive(Serialize)]
struct OutcomeJson {
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<PathBuf>,
    /// `baked`, `up-to-date`, `cached` (written from the cache), `dry-run` or `failed`.
    state: &'static str,
    /// The model or part that failed, and the reason.
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<Failure>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<info::MeshJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    grid: Option<info::GridJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    placement: Option<info::BoxJson>,
    /// An estimate of the memory that the bake would need at its peak.
    #[serde(skip_serializing_if = "Option::is_none")]
    memory_bytes: Option<u64>,
    /// About the seconds that the bake would take on this machine's CPU.
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    kernel: Option<BackendReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    times: Option<Times>,
}

#[derive(Serialize)]
struct Failure {
    input: String,
    error: String,
}

impl Outcome {
    pub(super) fn up_to_date(job: &Job, grid: &Grid) -> Self {
        let line = format!("{} is up to date", job.out.display());
        Self::not_baked(job, grid, "up-to-date", line)
    }

    pub(super) fn cached(job: &Job, grid: &Grid) -> Self {
        let line = format!("{}: wrote {} from the cache", job.title, job.out.display());
        Self::not_baked(job, grid, "cached", line)
    }

    fn not_baked(job: &Job, grid: &Grid, state: &'static str, line: String) -> Self {
        Self {
            json: OutcomeJson {
                out: Some(job.out.clone()),
                state,
                failure: None,
                mesh: None,
                grid: Some(info::GridJson::new(grid)),
                placement: None,
                memory_bytes: None,
                seconds: None,
                kernel: None,
                times: None,
            },
            lines: vec![line],
        }
    }

    pub(super) fn dry_run(job: &Job, report: &MeshReport, plan: &Plan) -> Self {
        let Plan {
            spec,
            memory,
            seconds,
        } = plan;
        let time = seconds.map(|seconds| format!(" and {} on the CPU", estimate::shown(seconds)));
        Self {
            lines: vec![
                format!("{}: {}", job.title, info::mesh_line(report)),
                format!(
                    "  would write {}: {}",
                    job.out.display(),
                    info::box_line(spec)
                ),
                format!(
                    "  would need about {} of memory{}",
                    memory::shown(*memory),
                    time.unwrap_or_default()
                ),
            ],
            json: OutcomeJson {
                out: Some(job.out.clone()),
                state: "dry-run",
                failure: None,
                mesh: Some(info::MeshJson::new(report)),
                grid: None,
                placement: Some(info::BoxJson::new(spec)),
                memory_bytes: Some(*memory),
                seconds: *seconds,
                kernel: None,
                times: None,
            },
        }
    }

    pub(super) fn baked(job: &Job, baked: Baked) -> Self {
        let Baked {
            grid,
            report,
            backend,
            times,
            warnings: _,
        } = baked;
        let bytes = grid.texels().len() as f64 / 1024.0;
        Self {
            lines: [
                Some(format!("{}: {}", job.title, info::mesh_line(&report))),
                Some(format!("  {}", info::box_line(grid.spec()))),
                Some(format!("  {}", sampling_line(&grid, &backend))),
                grid.record()
                    .check
                    .as_ref()
                    .map(|check| format!("  {}", info::check_line(check))),
                Some(format!("  {}", times_line(&times))),
                Some(format!(
                    "  wrote {} ({bytes:.0} KiB of texels)",
                    job.out.display()
                )),
            ]
            .into_iter()
            .flatten()
            .collect(),
            json: OutcomeJson {
                out: Some(job.out.clone()),
                state: "baked",
                failure: None,
                mesh: Some(info::MeshJson::new(&report)),
                grid: Some(info::GridJson::new(&grid)),
                placement: None,
                memory_bytes: None,
                seconds: None,
                kernel: Some(backend),
                times: Some(times),
            },
        }
    }
}

/// Describes how a grid was made in one line.
fn sampling_line(grid: &Grid, backend: &BackendReport) -> String {
    let record = grid.record();
    let sampling = match record.sampling {
        Sampling::CubeFaces { size } => format!("six {size}×{size} faces a cell"),
        Sampling::MonteCarlo { count, seed } => format!("{count} rays a cell, seed {seed}"),
    };
    let boundary = match record.boundary.applied {
        BoundaryMode::Jgt => "jgt",
        BoundaryMode::Rr => "rr",
        BoundaryMode::None => "none",
    };
    format!(
        "{sampling} ({}); {}; boundary {boundary}, V_M = {:.4}",
        backend.line(),
        info::interior_line(record),
        record.boundary.v_m
    )
}

fn times_line(times: &Times) -> String {
    format!(
        "loaded in {}, prepared in {}, visibility in {}, post-processed in {}, with {} threads",
        seconds(times.load_s),
        seconds(times.prepare_s),
        seconds(times.visibility_s),
        seconds(times.post_s),
        times.threads
    )
}

/// Formats a duration with about three digits.
fn seconds(s: f64) -> String {
    match s {
        s if s < 0.9995 => format!("{:.1} ms", 1e3 * s),
        s => format!("{s:.2} s"),
    }
}

/// The reports of all jobs.
#[derive(Default, Serialize)]
pub(super) struct Outputs {
    outputs: Vec<OutcomeJson>,
    /// The titles of what failed, or the only failure.
    #[serde(skip)]
    failed: Vec<String>,
    #[serde(skip)]
    only_failure: Option<anyhow::Error>,
}

impl Outputs {
    /// Prints a report at once, or keeps it for the JSON object.
    pub(super) fn push(&mut self, outcome: Outcome, console: &Console, json: bool) {
        if !json {
            outcome.lines.iter().for_each(|line| console.note(line));
        }
        self.outputs.push(outcome.json);
    }

    /// Keeps a failure, and prints it at once unless it is all that there is to print.
    pub(super) fn fail(
        &mut self,
        title: &str,
        error: anyhow::Error,
        is_only: bool,
        console: &Console,
    ) {
        self.outputs.push(OutcomeJson {
            out: None,
            state: "failed",
            failure: Some(Failure {
                input: title.to_owned(),
                error: format!("{error:#}"),
            }),
            mesh: None,
            grid: None,
            placement: None,
            memory_bytes: None,
            seconds: None,
            kernel: None,
            times: None,
        });
        if is_only {
            self.only_failure = Some(error);
            return;
        }
        console.error(&error);
        self.failed.push(title.to_owned());
    }

    /// Prints the JSON object.
    ///
    /// # Errors
    ///
    /// Something failed: the error names all of it.
    pub(super) fn finish(self, console: &Console, json: bool) -> anyhow::Result<()> {
        if json {
            console.json(&self)?;
        }
        if let Some(error) = self.only_failure {
            return Err(error);
        }
        match self.failed.len() {
            0 => Ok(()),
            n => {
                let total = self.outputs.len();
                bail!("{n} of {total} failed: {}", self.failed.join(", "))
            }
        }
    }
}
