//! The memory that a bake needs and the machine has.

use std::fs;

use anyhow::bail;
use aogrid_bake_core::{Algorithm, TriangleMesh};
use aogrid_grid_format::GridSpec;

/// Bytes of a process that bakes nothing, with its threads.
const PROCESS: u64 = 16 << 20;

/// Bytes a cell besides its texel: moments, counts and sums, and their copies in post-processing.
/// Measured at 96³, 128³ and 160³: 66 to 78 with the process and four bytes of texel.
const CELL: u64 = 68;

/// Bytes a cell of the grid for the near-surface fit: values, unknowns and bins.
const FIT_CELL: u64 = 320;

/// Bytes a triangle: the model with its file, the prepared mesh and its edges, or the BVH. Measured
/// with 871,414 triangles: 173 and 345 with the process.
const SWEEP_TRIANGLE: u64 = 220;
const RAYS_TRIANGLE: u64 = 400;

/// Returns an estimate of the bytes that a bake needs at its peak, with the model, rounded up rather
/// than down. An algorithm that is chosen later is taken to be the sweep. `lattice` has the points of
/// the near-surface fit.
pub(crate) fn needed(
    mesh: &TriangleMesh,
    spec: &GridSpec,
    lattice: Option<&GridSpec>,
    texel_bytes: usize,
    algorithm: Option<Algorithm>,
) -> u64 {
    let triangle = match algorithm {
        Some(Algorithm::RayCasting) => RAYS_TRIANGLE,
        _ => SWEEP_TRIANGLE,
    };
    let cells = spec.cell_count() as u64;
    let fit = lattice.map_or(0, |points| {
        points.cell_count() as u64 * CELL + cells * FIT_CELL
    });
    PROCESS + fit + cells * (CELL + texel_bytes as u64) + mesh.triangles().len() as u64 * triangle
}

/// Checks that a bake's memory is there before it begins: an allocation that fails ends the process.
///
/// # Errors
///
/// It needs more than `max`, or than is free if there is no `max`.
pub(crate) fn check(needed: u64, max: Option<u64>) -> anyhow::Result<()> {
    let Some(limit) = max.or_else(available) else {
        return Ok(());
    };
    if needed <= limit {
        return Ok(());
    }
    let [needed, limit] = [needed, limit].map(shown);
    match max {
        Some(_) => bail!(
            "it needs about {needed} of memory, and --max-memory allows {limit}: lower --resolution"
        ),
        None => bail!(
            "it needs about {needed} of memory, and {limit} are free: lower --resolution, or name \
             another limit with --max-memory"
        ),
    }
}

/// Parses a number of bytes with an optional K, M or G behind it, powers of 1024.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let shift = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" => 0,
        "K" => 10,
        "M" => 20,
        "G" => 30,
        _ => return Err("its unit must be K, M or G".into()),
    };
    let number = digits.parse::<u64>().ok();
    let bytes = number.and_then(|n| n.checked_mul(1 << shift));
    bytes.ok_or_else(|| "it must be a whole number, as in 900M".into())
}

/// Returns the bytes in a unit that leaves few digits.
pub(crate) fn shown(bytes: u64) -> String {
    match bytes as f64 / f64::from(1 << 20) {
        mib if mib < 1024.0 => format!("{mib:.0} MiB"),
        mib => format!("{:.1} GiB", mib / 1024.0),
    }
}

/// Returns the bytes that this process can still allocate, where the system tells: the machine's free
/// memory, or less if the process's address space is limited.
fn available() -> Option<u64> {
    let number = |text: &str, key: &str, column: usize| -> Option<u64> {
        let line = text.lines().find(|line| line.starts_with(key))?;
        line[key.len()..]
            .split_whitespace()
            .nth(column)?
            .parse()
            .ok()
    };
    let free = number(
        &fs::read_to_string("/proc/meminfo").ok()?,
        "MemAvailable:",
        0,
    )? << 10;
    let limits = fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let limit = number(&limits, "Max address space", 0);
    let used = number(&status, "VmSize:", 0).map_or(0, |kib| kib << 10);
    Some(limit.map_or(free, |limit| free.min(limit.saturating_sub(used))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_the_limit_is_refused() {
        assert!(check(5 << 20, Some(5 << 20)).is_ok());
        let error = check(3 << 30, Some(5 << 20)).unwrap_err().to_string();
        assert!(
            error.contains("3.0 GiB") && error.contains("allows 5 MiB"),
            "{error}"
        );
        if available().is_some() {
            let error = check(u64::MAX, None).unwrap_err().to_string();
            assert!(error.contains("--max-memory"), "{error}");
        }
        assert!(check(1, None).is_ok());
    }

    #[test]
    fn bytes_have_units() {
        assert_eq!(bytes("7"), Ok(7));
        assert_eq!(bytes("900m"), Ok(900 << 20));
        assert_eq!(bytes("2G"), Ok(2 << 30));
        for wrong in ["", "G", "1.5G", "1T", "-1", "99999999999G"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }
}
