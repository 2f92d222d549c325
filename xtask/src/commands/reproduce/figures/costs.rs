//! The costs of shading: figures 14 and 16, and the constant of the later paper.

use serde_json::Value;

use super::Figure;
use crate::commands::reproduce::finding::{Finding, Results, Table, Verdict};
use crate::commands::reproduce::plot::{Plot, Series};
use crate::commands::reproduce::scenes::COMPLEXITIES;
use crate::commands::reproduce::steps::Step;

/// The ratio of times up to which costs count as equal: shading runs on a machine that does other things.
const SAME_COST: f64 = 1.25;

/// The numbers of occluders that are measured.
const OCCLUDERS: &str = "1,5,10,20,40";

/// The modes of figure 16: the simple and the two-buffer blending, without and with an environment.
const FEATURES: &str = "occlusion,cone,merge,environment,environment-merge";

pub(super) fn figures() -> Vec<Figure> {
    let scenes = |prefix: &str| {
        let names = COMPLEXITIES.map(|n| format!("scenes/{prefix}-{n}.toml"));
        names.join(" ")
    };
    let bench = |line: String| {
        Step::new(
            "cost",
            format!("bench-shading {line} --threads 1 --repeat 9 --json"),
        )
    };
    vec![
        Figure {
            id: "figure-14a",
            source: "RR-5779, figure 14 (a); JGT, section 4.1",
            title: "Cost against the occluder's complexity",
            claim: "The added cost does not depend on the complexity of the occluder.",
            steps: vec![bench(scenes("occluder"))],
            judge: |results| constant(results, "triangles of the occluder"),
        },
        Figure {
            id: "figure-14b",
            source: "RR-5779, figure 14 (b)",
            title: "Cost against the scene's complexity",
            claim: "The added cost does not depend on the complexity of the scene.",
            steps: vec![bench(scenes("surroundings"))],
            judge: |results| constant(results, "triangles of the surroundings"),
        },
        Figure {
            id: "figure-14c",
            source: "RR-5779, figures 14 (c) and 15; JGT, section 4.1",
            title: "Cost against the number of occluders",
            claim: "The cost is linear in the number of occluders, a constant for each.",
            steps: vec![
                bench(format!("scenes/occluders.toml --occluders {OCCLUDERS}")),
                Step::new(
                    "picture",
                    "render scenes/occluders.toml --mode merge -o {png} --force",
                ),
            ],
            judge: linear,
        },
        Figure {
            id: "figure-16",
            source: "RR-5779, figure 16",
            title: "Cost of the features",
            claim: "Each feature costs something: two-buffer blending more than simple blending, the \
                    environment more than occlusion.",
            steps: vec![bench(format!("scenes/room.toml --mode {FEATURES}"))],
            judge: features,
        },
    ]
}

/// A row of `bench-shading`.
struct Row {
    occluders: f64,
    mode: String,
    seconds: f64,
    receivers: f64,
}

fn rows(results: &Results) -> anyhow::Result<Vec<Row>> {
    let rows = results.value("cost")?["rows"].as_array().cloned();
    let number = |row: &Value, key: &str| row[key].as_f64().unwrap_or(f64::NAN);
    let row = |row: Value| Row {
        occluders: number(&row, "occluders"),
        mode: row["mode"].as_str().unwrap_or_default().to_owned(),
        seconds: number(&row, "seconds"),
        receivers: number(&row, "receivers"),
    };
    Ok(rows.unwrap_or_default().into_iter().map(row).collect())
}

/// Returns the nanoseconds a receiver.
fn cost(row: &Row) -> f64 {
    1e9 * row.seconds / row.receivers
}

fn constant(results: &Results, varied: &'static str) -> anyhow::Result<Finding> {
    let rows = rows(results)?;
    let mut table = Table::new(&[varied, "ns a pixel on one CPU thread"]);
    let mut points = Vec::new();
    for (n, row) in COMPLEXITIES.into_iter().zip(&rows) {
        table
            .rows
            .push(vec![n.to_string(), format!("{:.1}", cost(row))]);
        points.push([f64::from(n), cost(row)]);
    }
    let costs = || points.iter().map(|p| p[1]);
    let (low, high) = (
        costs().fold(f64::INFINITY, f64::min),
        costs().fold(0.0, f64::max),
    );
    let text = format!(
        "Between the cheapest and the dearest lies a factor of {:.2}, while the triangles grow {} times. The \
         times are of the CPU twin's look-ups, which are the same as those of a GPU.",
        high / low,
        COMPLEXITIES[3] / COMPLEXITIES[0]
    );
    let mut finding = Finding::new(Verdict::of(high / low < SAME_COST), text);
    finding.tables.push(table);
    finding.plots.push(Plot {
        title: format!("Cost by {varied}"),
        x_label: varied,
        y_label: "ns a pixel",
        log: [true, false],
        series: vec![Series {
            name: "look-ups".to_owned(),
            points,
        }],
    });
    Ok(finding)
}

fn linear(results: &Results) -> anyhow::Result<Finding> {
    let rows = rows(results)?;
    let points: Vec<_> = rows.iter().map(|row| [row.occluders, cost(row)]).collect();
    let mut table = Table::new(&["occluders", "ns a pixel", "ns a pixel and occluder"]);
    for [n, cost] in &points {
        table.rows.push(vec![
            format!("{n:.0}"),
            format!("{cost:.1}"),
            format!("{:.1}", cost / n),
        ]);
    }
    // The cost of one more occluder, in the first half of the range and in the second.
    let slope = |a: usize, b: usize| {
        Some((points.get(b)?[1] - points.get(a)?[1]) / (points.get(b)?[0] - points.get(a)?[0]))
    };
    let (early, late) = (
        slope(0, 2).unwrap_or(f64::NAN),
        slope(3, 4).unwrap_or(f64::NAN),
    );
    let ratio = (late / early).max(early / late);
    let text = format!(
        "One more occluder costs {early:.1} ns a pixel between 1 and 10, {late:.1} ns between 20 and 40. A GPU \
         pays only for the pixels of an occluder's volume, so that small and far objects cost less there."
    );
    let verdict = if ratio < 1.6 {
        Verdict::Holds
    } else {
        Verdict::Partly
    };
    let mut finding = Finding::new(verdict, text);
    finding.tables.push(table);
    finding.plots.push(Plot {
        title: "Cost by number of occluders".to_owned(),
        x_label: "occluders",
        y_label: "ns a pixel",
        log: [false, false],
        series: vec![Series {
            name: "cone".to_owned(),
            points,
        }],
    });
    Ok(finding)
}

fn features(results: &Results) -> anyhow::Result<Finding> {
    let rows = rows(results)?;
    let of = |mode: &str| {
        let row = rows.iter().find(|row| row.mode == mode);
        row.map_or(f64::NAN, cost)
    };
    let base = of("cone");
    let mut table = Table::new(&["feature", "ns a pixel", "relative to simple blending"]);
    for (label, mode) in [
        ("occlusion alone", "occlusion"),
        ("simple blending (cone)", "cone"),
        ("two-buffer blending (merge)", "merge"),
        ("simple blending and environment", "environment"),
        ("two-buffer blending and environment", "environment-merge"),
    ] {
        table.rows.push(vec![
            label.to_owned(),
            format!("{:.1}", of(mode)),
            format!("{:.2}", of(mode) / base),
        ]);
    }
    let text = format!(
        "Merging costs {:.2} times simple blending, the environment {:.2} times, both {:.2} times; eleven \
         occluders in each.",
        of("merge") / base,
        of("environment") / base,
        of("environment-merge") / base
    );
    let holds = of("merge") > base && of("environment") > base;
    let mut finding = Finding::new(Verdict::of(holds), text);
    finding.tables.push(table);
    Ok(finding)
}
