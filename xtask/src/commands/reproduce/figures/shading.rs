//! Shading: boundary treatment, occlusion alone and with normals, blending, merging, light.

use super::Figure;
use crate::commands::reproduce::finding::{Finding, Results, SIMILAR, Table, Verdict};
use crate::commands::reproduce::steps::Step;

pub(super) fn figures(error: f64) -> Vec<Figure> {
    let all = [
        figure_4,
        figures_7_8,
        figure_9,
        figure_11,
        figures_12_13,
        figure_17,
    ];
    all.map(|figure| figure(error)).into()
}

/// Returns the comparison of modes with truth traced to a standard error.
fn compare(name: &str, scene: &str, modes: &str, error: f64) -> Step {
    Step::new(
        name,
        format!(
            "compare scenes/{scene}.toml --mode {modes} --error {error} -o {{png}} --force --json"
        ),
    )
}

fn figure_4(error: f64) -> Figure {
    Figure {
        id: "figure-4",
        source: "RR-5779, figure 4; JGT, figure 11 and section 4.3",
        title: "Treatment of the grid's boundary",
        claim: "Rescaling the values so that they vanish at the border removes the visible edge of the \
                box and keeps the aspect of the shadow.",
        steps: vec![
            compare("none", "box-untreated", "cone", error),
            compare("rr", "box-rescaled", "cone", error),
            compare("jgt", "box-paper", "cone", error),
            compare("default", "box-default", "cone", error),
        ],
        judge: boundary,
    }
}

fn figures_7_8(error: f64) -> Figure {
    Figure {
        id: "figures-7-8",
        source: "RR-5779, sections 4 and 5, figures 7 and 8",
        title: "Occlusion alone, and with directions",
        claim: "Storing the average direction and clipping the cone by the tangent plane is more accurate \
                than occlusion alone, and handles self-occlusion.",
        steps: vec![
            compare("table", "table-paper", "occlusion,cone", error),
            compare("spheres", "spheres-paper", "occlusion,cone", error),
            compare("table-default", "table-default", "cone", error),
            compare("spheres-default", "spheres-default", "cone", error),
        ],
        judge: directions,
    }
}

fn figure_9(error: f64) -> Figure {
    Figure {
        id: "figure-9",
        source: "RR-5779, figure 9",
        title: "Blending the parts of a robot",
        claim: "Even simple blending of the parts' occlusion is close to ray tracing.",
        steps: vec![
            compare("paper", "robot-untreated", "cone,merge", error),
            compare("default", "robot-default", "cone,merge", error),
        ],
        judge: robot,
    }
}

fn figure_11(error: f64) -> Figure {
    Figure {
        id: "figure-11",
        source: "RR-5779, figure 11; JGT supplement",
        title: "Two overlapping boxes",
        claim: "Adding the occluders' shadows is too dark where they overlap; uniting their cones avoids \
                that, and is slightly too light.",
        steps: vec![compare("boxes", "overlapping-boxes", "cone,merge", error)],
        judge: overlapping,
    }
}

fn figures_12_13(error: f64) -> Figure {
    Figure {
        id: "figures-12-13",
        source: "RR-5779, figures 12 and 13",
        title: "Light of an environment",
        claim: "The cones also remove the light of the directions that they hide: colors bleed from the \
                side that is open, and none where an object is in the way.",
        steps: vec![Step::new(
            "room",
            format!(
                "render scenes/room.toml --mode truth,environment,cone --error {error} -o {{png}} --force"
            ),
        )],
        judge: |_| {
            Ok(Finding::new(
                Verdict::Partly,
                "Judged by eye. Left: ray tracing; middle: light removed by direction; right: darkened by 1 − AO. The \
                 colors are right in kind: red and blue stay on their sides. The printed difference B − A \
                 is wrong by the factor that A lacks: it is zero under a constant sky. The mean radiance A \
                 of the cone must be weighted by its share, AO."
                    .to_owned(),
            ))
        },
    }
}

fn figure_17(error: f64) -> Figure {
    Figure {
        id: "figure-17",
        source: "RR-5779, figure 17",
        title: "A box under an area light",
        claim: "Ambient occlusion brings soft-shadowed light closer to the truth at little cost.",
        steps: vec![Step::new(
            "light",
            format!(
                "render scenes/area-light.toml --mode truth,cone --error {error} -o {{png}} --force"
            ),
        )],
        judge: |_| {
            Ok(Finding::new(
                Verdict::Holds,
                "Judged by eye. Left: ray-traced direct and ambient light; right: the same direct light, with the \
                 ambient light darkened by the grid. The contact shadow at the foot of the box, which no \
                 soft shadow of the light has, is there in both."
                    .to_owned(),
            ))
        },
    }
}

/// Returns a table of the error and the bias of modes in steps.
fn errors(results: &Results, rows: &[(&str, &str, usize)]) -> anyhow::Result<Table> {
    let mut table = Table::new(&["", "RMSE of AO", "bias"]);
    for &(label, step, mode) in rows {
        table.rows.push(vec![
            label.to_owned(),
            format!("{:.3}", results.rmse(step, mode)?),
            format!("{:+.3}", results.bias(step, mode)?),
        ]);
    }
    Ok(table)
}

fn boundary(results: &Results) -> anyhow::Result<Finding> {
    let [none, rr, jgt, default] = ["none", "rr", "jgt", "default"];
    let rmse = |step: &str| results.rmse(step, 0);
    let text = format!(
        "The edge is gone, but so is most of the shadow: without treatment the error is {:.3}, rescaled it is \
         {:.3} (first paper) and {:.3} (second), and everything is too light. The treatment, not the cone, \
         dominates the papers' error. A far field continues the grid beyond its box instead (the default, \
         {:.3}): no edge, and the shadow stays.",
        rmse(none)?,
        rmse(rr)?,
        rmse(jgt)?,
        rmse(default)?
    );
    let loses = rmse(rr)? > 2.0 * rmse(none)? && rmse(jgt)? > 2.0 * rmse(none)?;
    let mut finding = Finding::new(
        if loses {
            Verdict::Partly
        } else {
            Verdict::Holds
        },
        text,
    );
    finding.tables.push(errors(
        results,
        &[
            ("no treatment", none, 0),
            ("rescaled as in RR-5779", rr, 0),
            ("rescaled as in JGT", jgt, 0),
            ("aogrid's default", default, 0),
        ],
    )?);
    Ok(finding)
}

fn directions(results: &Results) -> anyhow::Result<Finding> {
    let rmse = |step: &str, mode| results.rmse(step, mode);
    let better = rmse("table", 1)? < rmse("table", 0)? && rmse("spheres", 1)? < rmse("spheres", 0)?;
    let text = format!(
        "Cones err by {:.3} (table) and {:.3} (spheres and boxes), occlusion alone by {:.3} and {:.3}. The \
         boundary treatment is part of both. Moments with a far field, the default, err by {:.3} and {:.3}.",
        rmse("table", 1)?,
        rmse("spheres", 1)?,
        rmse("table", 0)?,
        rmse("spheres", 0)?,
        rmse("table-default", 0)?,
        rmse("spheres-default", 0)?
    );
    let mut finding = Finding::new(Verdict::of(better), text);
    finding.tables.push(errors(
        results,
        &[
            ("table, occlusion alone", "table", 0),
            ("table, cones", "table", 1),
            ("table, default", "table-default", 0),
            ("spheres and boxes, occlusion alone", "spheres", 0),
            ("spheres and boxes, cones", "spheres", 1),
            ("spheres and boxes, default", "spheres-default", 0),
        ],
    )?);
    Ok(finding)
}

fn robot(results: &Results) -> anyhow::Result<Finding> {
    let multiplied = results.rmse("paper", 0)?;
    let text = format!(
        "Multiplied, the papers' grids (without boundary treatment) err by {multiplied:.3}, merged by {:.3}; the \
         default's by {:.3} and {:.3}.",
        results.rmse("paper", 1)?,
        results.rmse("default", 0)?,
        results.rmse("default", 1)?
    );
    let mut finding = Finding::new(Verdict::of(multiplied < SIMILAR), text);
    finding.tables.push(errors(
        results,
        &[
            ("papers' grids, multiplied", "paper", 0),
            ("papers' grids, merged", "paper", 1),
            ("default, multiplied", "default", 0),
            ("default, merged", "default", 1),
        ],
    )?);
    Ok(finding)
}

fn overlapping(results: &Results) -> anyhow::Result<Finding> {
    let bias = |mode| results.bias("boxes", mode);
    let (multiplied, merged) = (results.rmse("boxes", 0)?, results.rmse("boxes", 1)?);
    let text = format!(
        "Multiplying is too dark (bias {:+.3}, RMSE {multiplied:.3}), merging is not (bias {:+.3}, RMSE \
         {merged:.3}).",
        bias(0)?,
        bias(1)?
    );
    let holds = bias(0)? > 0.0 && merged < multiplied;
    let mut finding = Finding::new(Verdict::of(holds), text);
    finding.tables.push(errors(
        results,
        &[("multiplied", "boxes", 0), ("merged", "boxes", 1)],
    )?);
    Ok(finding)
}
