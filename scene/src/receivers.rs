//! Lists of receivers, the points to shade.

use std::path::Path;

use crate::error::{Context, bail, ensure};
use crate::reference::Receiver;
use glam::DVec3;
use toml::Spanned;

use super::diagnostics::SceneText;
use super::paths::resolve;
use super::schema::ReceiversFile;
use super::values::triple;

/// Receivers and the table that they were read from.
#[derive(Clone, Debug)]
pub struct ReceiverList {
    /// The table's header.
    pub columns: Vec<String>,
    /// The table's rows as text.
    pub rows: Vec<Vec<String>>,
    /// The receivers, one a row.
    pub points: Vec<Receiver>,
    /// The id of the instance that the points lie on, if that is known.
    pub object: Option<u32>,
    /// The distance along the normals at which rays start, for points on occluders.
    pub lift: f64,
}

/// The columns of a receiver's position and normal.
const COLUMNS: [&str; 6] = ["px", "py", "pz", "nx", "ny", "nz"];

/// The maximum number of receivers that are sampled from a rectangle.
const MAX_SAMPLED_RECEIVERS: u64 = 10_000_000;

pub(super) fn read(
    source: &SceneText<'_>,
    list: &Spanned<ReceiversFile>,
) -> crate::Result<ReceiverList> {
    let file = list.get_ref();
    let error = |key: &str, message: &str| source.error_at(list, key, message);
    match (&file.csv, file.corner, file.u, file.v, file.count) {
        (Some(name), None, None, None, None) => {
            let path = resolve(source.path, name);
            ReceiverList::from_csv(&path)
        }
        (None, Some(corner), Some(u), Some(v), Some(count)) => {
            let count = count.map(|n| n.0);
            if u64::from(count[0]) * u64::from(count[1]) > MAX_SAMPLED_RECEIVERS {
                let message = format!("more than {MAX_SAMPLED_RECEIVERS} receivers");
                return Err(error("receivers.count", &message));
            }
            let [corner, u, v] = [corner, u, v].map(|t| DVec3::from_array(triple(t)));
            let Some(normal) = u.cross(v).try_normalize() else {
                let message = "`u` and `v` span no rectangle: they are parallel, or one is zero";
                return Err(error("receivers.u", message));
            };
            Ok(sample_rectangle(corner, [u, v], normal, count))
        }
        _ => Err(error(
            "receivers",
            "either `csv`, or `corner`, `u`, `v` and `count`, are needed",
        )),
    }
}

/// Returns the centers of `count` equal cells of the rectangle that `corner`, `u` and `v` span, the
/// index along u running fastest.
fn sample_rectangle(
    corner: DVec3,
    [u, v]: [DVec3; 2],
    normal: DVec3,
    count: [u32; 2],
) -> ReceiverList {
    let at = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    let points: Vec<_> = (0..count[1])
        .flat_map(|j| (0..count[0]).map(move |i| [i, j]))
        .map(|[i, j]| Receiver {
            position: (corner + at(i, count[0]) * u + at(j, count[1]) * v).to_array(),
            normal: normal.to_array(),
        })
        .collect();
    let row = |r: &Receiver| {
        let numbers = r.position.iter().chain(&r.normal);
        // Adding zero turns −0 into 0.
        numbers.map(|v| format!("{}", v + 0.0)).collect()
    };
    ReceiverList {
        columns: COLUMNS.map(str::to_owned).to_vec(),
        rows: points.iter().map(row).collect(),
        points,
        object: None,
        lift: 0.0,
    }
}

impl ReceiverList {
    /// Returns the receivers moved along their normals by [`Self::lift`].
    pub fn lifted(&self) -> Vec<Receiver> {
        let lifted = |r: &Receiver| Receiver {
            position: std::array::from_fn(|x| r.position[x] + self.lift * r.normal[x]),
            ..*r
        };
        self.points.iter().map(lifted).collect()
    }

    /// Reads a table with the columns `px,py,pz,nx,ny,nz` in any order, among others.
    ///
    /// # Errors
    ///
    /// The file cannot be read, lacks a column, or holds text that is not a number: with file, line
    /// and column.
    pub fn from_csv(path: &Path) -> crate::Result<Self> {
        let shown = || path.display().to_string();
        let metadata = std::fs::metadata(path).with_context(shown)?;
        ensure!(metadata.is_file(), "{}: it is not a regular file", shown());
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_path(path)
            .with_context(shown)?;
        let columns: Vec<String> = reader
            .headers()
            .with_context(shown)?
            .iter()
            .map(str::to_owned)
            .collect();
        let mut column_idx = [0; 6];
        for (idx, name) in column_idx.iter_mut().zip(COLUMNS) {
            match columns.iter().position(|c| c == name) {
                Some(column) => *idx = column,
                None => bail!(
                    "{}: it has no column `{name}`; {} are needed",
                    shown(),
                    COLUMNS.join(", ")
                ),
            }
        }
        let (mut rows, mut points) = (vec![], vec![]);
        for record in reader.records() {
            let record = record.with_context(shown)?;
            let line = record.position().map_or(0, csv::Position::line);
            let point = receiver(&record, column_idx)
                .with_context(|| format!("{}:{line}", path.display()))?;
            points.push(point);
            rows.push(record.iter().map(str::to_owned).collect());
        }
        ensure!(!points.is_empty(), "{}: it has no receivers", shown());
        Ok(Self {
            columns,
            rows,
            points,
            object: None,
            lift: 0.0,
        })
    }
}

fn receiver(record: &csv::StringRecord, column_idx: [usize; 6]) -> crate::Result<Receiver> {
    let mut numbers = [0.0_f64; 6];
    for ((number, idx), name) in numbers.iter_mut().zip(column_idx).zip(COLUMNS) {
        let text = &record[idx];
        *number = match text.parse() {
            Ok(v) if f64::abs(v) <= f64::from(f32::MAX) => v,
            _ => bail!("{name}: `{text}` is not a usable number"),
        };
    }
    let [x, y, z, nx, ny, nz] = numbers;
    let Some(normal) = DVec3::new(nx, ny, nz).try_normalize() else {
        bail!("nx, ny, nz: a normal needs a direction, and this is zero");
    };
    Ok(Receiver {
        position: [x, y, z],
        normal: normal.to_array(),
    })
}
