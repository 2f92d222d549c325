//! The other sources: Ambient Occlusion Volumes, and GPU Gems, chapter 17.

use super::Figure;
use crate::commands::reproduce::finding::{Finding, SIMILAR, Verdict};
use crate::commands::reproduce::steps::Step;

/// The RMSE up to which volumes count as exact: a few standard errors of the truth.
const EXACT_SIGMAS: f64 = 1.5;

pub(super) fn figures(error: f64) -> Vec<Figure> {
    vec![
        polygon(error),
        scene(error),
        accessibility(),
        environment(error),
    ]
}

/// Returns the comparison of volumes with truth.
fn compare(name: &str, scene: &str, error: f64) -> Step {
    Step::new(
        name,
        format!(
            "compare scenes/{scene}.toml --mode volumes --error {error} -o {{png}} --force --json"
        ),
    )
}

fn polygon(error: f64) -> Figure {
    Figure {
        id: "aov-polygon",
        source: "AOV, figure 2 and equation 1",
        title: "Polygons, exactly",
        claim: "The occlusion by a polygon is its form factor; where objects are thick, the sum over \
                polygons is exact.",
        steps: vec![compare("box", "polygon", error)],
        judge: |results| {
            let rmse = results.rmse("box", 0)?;
            let noise = results.number("box", "/modes/0/all/truth_error")?;
            let text = format!(
                "A box on a floor, volumes without an end: RMSE {rmse:.4}, where the ray-traced truth has a \
                 standard error of {noise:.4} itself."
            );
            Ok(Finding::new(Verdict::of(rmse < EXACT_SIGMAS * noise), text))
        },
    }
}

fn scene(error: f64) -> Figure {
    Figure {
        id: "aov-scene",
        source: "AOV, figure 1",
        title: "A scene by volumes",
        claim: "Volumes come close to ray tracing without noise; thin objects behind one another get \
                darker.",
        steps: vec![compare("scene", "volumes", error)],
        judge: |results| {
            let (rmse, bias) = (results.rmse("scene", 0)?, results.bias("scene", 0)?);
            let verdict = match rmse < SIMILAR {
                true => Verdict::Holds,
                false => Verdict::Partly,
            };
            let text = format!(
                "RMSE {rmse:.3}, bias {bias:+.3} against unlimited truth: volumes of 0.8 units end sooner, so \
                 shadows are lighter away from contact. docs/volumes.md has the cases where they are too dark."
            );
            Ok(Finding::new(verdict, text))
        },
    }
}

fn accessibility() -> Figure {
    Figure {
        id: "gems-17-1",
        source: "GPU Gems, figures 17-1 and 17-2",
        title: "Accessibility baked onto a surface",
        claim: "The share of open directions, baked for each point of a model by rays, shades it as under \
                an overcast sky.",
        steps: vec![
            Step::new(
                "model",
                "model robot --triangles 6000 -o models/robot-fine.obj --force",
            ),
            Step::new(
                "bake",
                "bake-surface models/robot-fine.obj -o models/robot-fine.ply --ground --force --json",
            ),
        ],
        judge: |results| {
            let points = results.number("bake", "/points")?;
            let seconds = results.number("bake", "/seconds")?;
            let text = format!(
                "{points:.0} points see 512 directions of their hemispheres each, in {seconds:.2} seconds; the \
                 chapter reports minutes. But uniform weights, as printed, are wrong under a constant sky (see \
                 the list of misprints): cosine weights are the default here."
            );
            Ok(Finding::new(Verdict::Partly, text))
        },
    }
}

fn environment(error: f64) -> Figure {
    let modes = "accessibility,surface-cone,cone";
    Figure {
        id: "gems-17-3",
        source: "GPU Gems, figures 17-3 and 17-6",
        title: "Light of an environment by accessibility and bent normals",
        claim: "Looking the environment up around the bent normal and darkening it by the accessibility comes \
                close to ray tracing.",
        steps: vec![
            Step::new(
                "errors",
                format!("compare scenes/surface.toml --mode {modes} --error {error} --json"),
            ),
            Step::new(
                "light",
                format!(
                    "render scenes/surface.toml --mode truth,accessibility,surface-environment,environment \
                     --error {error} -o {{png}} --force"
                ),
            ),
        ],
        judge: |results| {
            let rmse = |mode| results.rmse("errors", mode);
            let text = format!(
                "The chapter bakes what an object does to itself; its neighbors have no part in that, and the \
                 floor stays unshaded: RMSE of AO {:.3}. With the neighbors' grids it is {:.3}, with grids for \
                 everything {:.3}.",
                rmse(0)?,
                rmse(1)?,
                rmse(2)?
            );
            Ok(Finding::new(Verdict::Partly, text))
        },
    }
}
