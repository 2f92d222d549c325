//! Precomputation: table 1, the extents of grids, and their memory.

use serde_json::Value;

use super::Figure;
use crate::commands::reproduce::finding::{Finding, Results, Table, Verdict, list};
use crate::commands::reproduce::plot::{Plot, Series};
use crate::commands::reproduce::steps::Step;

/// The triangles of the models of table 1, and the printed seconds: with occlusion queries, with full
/// cones on the GPU, and by 256 rays a cell.
const TABLE_1: [(u32, [Option<f64>; 3]); 5] = [
    (392, [Some(0.45), Some(2.75), Some(5.58)]),
    (4_698, [Some(8.33), Some(9.0), Some(7.46)]),
    (16_271, [Some(50.0), Some(50.0), Some(6.25)]),
    (378_000, [Some(230.0), Some(230.0), Some(92.0)]),
    (1_100_000, [None, None, Some(226.0)]),
];

/// The largest model that a software rasterizer is given.
const MAX_GPU_TRIANGLES: u32 = 20_000;

pub(super) fn figures(adapter: Option<&str>) -> Vec<Figure> {
    vec![table_1(adapter), extents(), memory()]
}

fn table_1(adapter: Option<&str>) -> Figure {
    let mut steps = Vec::new();
    for (n, _) in TABLE_1 {
        let model = format!("models/torus-{n}.obj");
        steps.push(Step::new(
            format!("model-{n}"),
            format!("model torus --triangles {n} -o {model} --force"),
        ));
        steps.push(Step::new(
            format!("cpu-{n}"),
            format!("bench {model} --backend cpu --repeat 3 --json"),
        ));
        steps.push(Step::new(
            format!("rays-{n}"),
            format!(
                "bake {model} -o models/rays-{n}.ao.ktx2 --preset paper --sampling monte-carlo \
                 --backend cpu --force --json"
            ),
        ));
        if let Some(adapter) = adapter.filter(|_| n < MAX_GPU_TRIANGLES) {
            // The names of adapters have spaces, and any part of one selects it.
            let part = adapter.split_whitespace().next().unwrap_or(adapter);
            steps.push(Step::new(
                format!("gpu-{n}"),
                format!(
                    "bench {model} --only gpu:sweep,gpu:rays --adapter {part} --repeat 1 --json"
                ),
            ));
        }
    }
    Figure {
        id: "table-1",
        source: "RR-5779, table 1",
        title: "Precomputation of a grid of 32³ cells",
        claim: "Rasterizing six faces a cell takes a time that grows with the number of triangles; 256 \
                random rays a cell cost nearly the same for small and large models, and less from some \
                ten thousand triangles on.",
        steps,
        judge: judge_table_1,
    }
}

/// The columns of our methods, by the step's name and the row's backend and algorithm.
const METHODS: [(&str, &str, &str, &str); 4] = [
    ("direction sweep, CPU", "cpu", "cpu", "sweep"),
    ("all rays, CPU", "cpu", "cpu", "rays"),
    ("direction sweep, GPU", "gpu", "gpu", "sweep"),
    ("all rays, GPU", "gpu", "gpu", "rays"),
];

/// Returns the seconds from the loaded mesh to the visibility of all cells in the row of a bench.
fn seconds(results: &Results, step: &str, backend: &str, algorithm: &str) -> Option<f64> {
    let rows = results.value(step).ok()?.pointer("/models/0/rows")?;
    let is_row = |row: &&Value| row["backend"] == backend && row["algorithm"] == algorithm;
    let row = rows.as_array()?.iter().find(is_row)?;
    Some(row["prepare_s"].as_f64()? + row["visibility_s"].as_f64()?)
}

/// The name of the series of random rays.
const RANDOM: &str = "256 random rays";

const TABLE_1_HEADER: [&str; 7] = [
    "triangles",
    "printed: queries / cones / 256 rays, s",
    "direction sweep, CPU, s",
    "all rays, CPU, s",
    "direction sweep, GPU, s",
    "all rays, GPU, s",
    "256 random rays, CPU, s",
];

/// Draws what was measured, and judges how times grow with the triangles.
fn judge_table_1(results: &Results) -> anyhow::Result<Finding> {
    let mut table = Table::new(&TABLE_1_HEADER);
    let mut series: Vec<Series> = METHODS
        .iter()
        .map(|(name, ..)| (*name).to_owned())
        .chain([RANDOM.to_owned(), "printed: cones".to_owned()])
        .map(|name| Series {
            name,
            points: vec![],
        })
        .collect();
    let cell = |time: Option<f64>| time.map_or("–".to_owned(), |t| format!("{t:.3}"));
    for (n, printed) in TABLE_1 {
        let times = METHODS.map(|(_, step, backend, algorithm)| {
            seconds(results, &format!("{step}-{n}"), backend, algorithm)
        });
        let random =
            |key: &str| results.number(&format!("rays-{n}"), &format!("/outputs/0/times/{key}"));
        let random = random("prepare_s")? + random("visibility_s")?;
        let all = times.into_iter().chain([Some(random), printed[1]]);
        for (series, time) in series.iter_mut().zip(all) {
            series.points.extend(time.map(|time| [f64::from(n), time]));
        }
        let mut row = vec![
            n.to_string(),
            printed
                .map(|p| p.map_or("–".to_owned(), |p| p.to_string()))
                .join(" / "),
        ];
        row.extend(times.map(cell));
        row.push(cell(Some(random)));
        table.rows.push(row);
    }
    series.retain(|series| !series.points.is_empty());
    Ok(growth_of(table, series))
}

/// Judges the growth of the times, whose series are those of the table's columns.
fn growth_of(table: Table, series: Vec<Series>) -> Finding {
    let growth = |name: &str| {
        let points = &series.iter().find(|series| series.name == name)?.points;
        Some(points.last()?[1] / points.first()?[1])
    };
    let (sweep, random) = (
        growth(METHODS[0].0).unwrap_or(f64::NAN),
        growth(RANDOM).unwrap_or(f64::NAN),
    );
    let text = format!(
        "From 392 to 1.1 million triangles, rays become {random:.1} times as slow and the direction sweep \
         {sweep:.0} times: rays depend less on the model, as printed. But the printed crossing is gone: the \
         sweep, which makes the same six faces a cell without rasterizing them, is faster than 256 random \
         rays for every one of these models, and it sees six times as many directions. The printed times \
         are of a Pentium 4 at 2.8 GHz with a GeForce 6800 GT; compare their trends, not their seconds. A \
         software GPU is measured up to 20,000 triangles."
    );
    let slower = random > 0.0 && sweep > random;
    let mut finding = Finding::new(
        if slower {
            Verdict::Partly
        } else {
            Verdict::Fails
        },
        text,
    );
    finding.tables.push(table);
    finding.plots.push(Plot {
        title: "Seconds for a grid by number of triangles".to_owned(),
        x_label: "triangles",
        y_label: "seconds",
        log: [true, true],
        series,
    });
    finding
}

/// The models whose extents are shown.
const EXTENT_MODELS: [&str; 3] = ["box", "table", "rod"];

fn extents() -> Figure {
    let mut steps = Vec::new();
    for name in EXTENT_MODELS {
        steps.push(Step::new(
            format!("model-{name}"),
            format!("model {name} -o models/{name}.obj --force"),
        ));
        steps.push(Step::new(
            name,
            format!(
                "bake models/{name}.obj -o models/{name}.ao.ktx2 --preset paper --force --json"
            ),
        ));
        steps.push(Step::new(
            format!("slices-{name}"),
            format!(
                "preview models/{name}.obj -o {{png}} --preset paper --error 0.01 --force --json"
            ),
        ));
    }
    // Previews write a second picture, of the grid.
    Figure {
        id: "figure-3",
        source: "RR-5779, figure 3 and equation 4; JGT, figure 10",
        title: "Extents of grids for ε = 0.1",
        claim: "A cube's grid is about three times as large as the cube; the grid of a long object is long, \
                too, but thinner along its longer axes.",
        steps,
        judge: judge_extents,
    }
}

fn judge_extents(results: &Results) -> anyhow::Result<Finding> {
    let mut table = Table::new(&["model", "half-extents r", "grid's half-extents e", "e/r"]);
    let mut ratios = Vec::new();
    for name in EXTENT_MODELS {
        let side = |axis: usize| -> anyhow::Result<[f64; 2]> {
            let bound = |end: &str| results.number(name, &format!("/outputs/0/mesh/{end}/{axis}"));
            let e = results.number(name, &format!("/outputs/0/grid/half_extents/{axis}"))?;
            Ok([0.5 * (bound("max")? - bound("min")?), e])
        };
        let sides = [side(0)?, side(1)?, side(2)?];
        let ratio = sides.map(|[r, e]| e / r);
        table.rows.push(vec![
            name.to_owned(),
            list(&sides.map(|[r, _]| r)),
            list(&sides.map(|[_, e]| e)),
            list(&ratio),
        ]);
        ratios.push((sides, ratio));
    }
    let cube = ratios[0].1[0];
    let (rod, of_rod) = &ratios[2];
    let longest = (0..3)
        .max_by(|&a, &b| rod[a][0].total_cmp(&rod[b][0]))
        .unwrap_or(0);
    let is_thinner = (0..3).all(|axis| axis == longest || of_rod[axis] > of_rod[longest]);
    let text = format!(
        "By equation 4 the ratio of a cube is 1 + √(1/(π ε)) = {:.3}; ours is {cube:.3}. The rod's grid \
         exceeds the rod by {:.2} along it and by more across.",
        1.0 + (1.0 / (std::f64::consts::PI * 0.1)).sqrt(),
        of_rod[longest]
    );
    let mut finding = Finding::new(Verdict::of((cube - 3.0).abs() < 0.3 && is_thinner), text);
    finding.tables.push(table);
    Ok(finding)
}

fn memory() -> Figure {
    let step = |name: &str, options: &str| {
        Step::new(
            name,
            format!(
                "bake models/box.obj -o models/box-{name}.ao.ktx2 --preset paper {options} --force --json"
            ),
        )
    };
    Figure {
        id: "jgt-memory",
        source: "JGT, section 4.2",
        title: "Memory",
        claim: "Occlusion alone takes 32 KB at 32³, with the direction 128 KB.",
        steps: vec![
            Step::new("model", "model box -o models/box.obj --force"),
            step("occlusion", "--encoding occlusion"),
            step("cone", "--encoding cone"),
        ],
        judge: |results| {
            let bytes = |step: &str| -> anyhow::Result<f64> {
                let n = results.number(step, "/outputs/0/grid/resolution/0")?;
                Ok(n.powi(3) * results.number(step, "/outputs/0/grid/texel_bytes")?)
            };
            let (occlusion, cone) = (bytes("occlusion")?, bytes("cone")?);
            let text = format!(
                "{:.0} KiB and {:.0} KiB of texels; the file's metadata adds about one.",
                occlusion / 1024.0,
                cone / 1024.0
            );
            let holds = occlusion == 32.0 * 1024.0 && cone == 128.0 * 1024.0;
            Ok(Finding::new(Verdict::of(holds), text))
        },
    }
}
