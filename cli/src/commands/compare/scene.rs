//! A scene: its modes against truth, by area.

use std::path::Path;

use anyhow::{bail, ensure};
use aogrid_scene::compare::{ModeErrors, areas, errors};
use aogrid_scene::shade::{self, Mode, ShadeInput, Target};
use aogrid_scene::suite::{Area, ErrorStats};
use aogrid_scene::{GBuffer, LoadOptions, Scene, load};
use serde::Serialize;

use super::{Args, Compared, panels};
use crate::commands::render::{load_environment, override_truth};
use crate::console::Console;
use crate::output;
use crate::usage::usage;

/// The report for a machine.
#[derive(Serialize)]
struct Report {
    scene: String,
    receivers: usize,
    /// The areas in the order of all lists.
    areas: [&'static str; Area::ALL.len()],
    modes: Vec<ModeErrors>,
}

/// The kind of an output file.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Panels,
    Receivers,
}

pub(super) fn run(args: &Args, path: &Path, console: &Console) -> anyhow::Result<()> {
    let outputs: Vec<_> = args
        .out
        .iter()
        .map(|out| Ok((out, kind(out)?)))
        .collect::<anyhow::Result<_>>()?;
    for (out, _) in &outputs {
        output::check_not_input(out, path)?;
        output::check_new(out, args.force)?;
    }
    let mut scene = load(path, LoadOptions::default())?;
    override_truth(&mut scene.truth, args.samples, args.error, args.seed);
    let wants_panels = outputs.iter().any(|(_, kind)| *kind == Kind::Panels);
    let target = target(&scene, wants_panels, console)?;
    let environment = match &scene.environment {
        Some(source) => Some(load_environment(source, console)?),
        None => None,
    };
    let stages = |name: &str| console.stage(name);
    let mut input = ShadeInput::new(&scene, &target);
    input.environment = environment.as_ref();
    input.stages = &stages;
    let shade = |mode: &'static Mode| {
        let shaded = mode.shade(&input);
        let warnings = input.take_warnings();
        warnings.iter().for_each(|line| console.warning(line));
        shaded
    };
    let truth = shade(truth_mode())?;
    let modes = modes(args).into_iter().map(|mode| Ok((mode, shade(mode)?)));
    let modes: Vec<_> = modes.collect::<anyhow::Result<_>>()?;
    let areas = areas(&scene, &target)?;
    let errors: Vec<_> = modes
        .iter()
        .map(|(mode, shaded)| errors(mode.name, shaded, &truth, &areas))
        .collect();
    let compared = Compared {
        target: &target,
        truth: &truth,
        modes: &modes,
        areas: &areas,
        errors: &errors,
    };
    for (out, kind) in outputs {
        let bytes = match (kind, &target.picture) {
            (Kind::Panels, Some(picture)) => panels::png(&compared, picture)?,
            (Kind::Panels, None) => bail!("{}: panels need a [camera]", path.display()),
            (Kind::Receivers, _) => csv(&compared)?,
        };
        output::write(out, &bytes)?;
        console.note(&format!("wrote {}", out.display()));
    }
    report(args, path, &target, errors, console)
}

fn truth_mode() -> &'static Mode {
    Mode::named("truth").expect("truth is a mode")
}

/// Returns the modes to compare: those named, or all that shade by AO alone.
fn modes(args: &Args) -> Vec<&'static Mode> {
    let is_judged = |mode: &&'static Mode| mode.name != truth_mode().name;
    match args.mode.is_empty() {
        true => shade::ALL
            .into_iter()
            .filter(|m| is_judged(m) && !m.needs_light)
            .collect(),
        false => args.mode.iter().copied().filter(is_judged).collect(),
    }
}

fn kind(out: &Path) -> anyhow::Result<Kind> {
    let ending = out.extension().unwrap_or_default().to_ascii_lowercase();
    match ending.to_str() {
        Some("png") => Ok(Kind::Panels),
        Some("csv") => Ok(Kind::Receivers),
        _ => Err(usage(format!(
            "{}: panels end in .png, receivers in .csv",
            out.display()
        ))),
    }
}

/// Returns the points of the picture, or of the list if the scene has no camera.
fn target(scene: &Scene, wants_panels: bool, console: &Console) -> anyhow::Result<Target> {
    if scene.camera.is_none()
        && let Some(list) = &scene.receivers
    {
        ensure!(
            !wants_panels,
            "{}: panels need a [camera]",
            scene.path.display()
        );
        return Ok(Target::of_list(list));
    }
    let stage = console.stage("rays from the camera");
    Ok(Target::of_picture(GBuffer::trace(scene, &*stage)?))
}

/// Returns a table with a row for each receiver.
fn csv(compared: &Compared<'_>) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let fixed = [
        "px",
        "py",
        "pz",
        "nx",
        "ny",
        "nz",
        "area",
        "truth",
        "truth.stderr",
    ];
    let names = compared.modes.iter().map(|(mode, _)| mode.name);
    writer.write_record(fixed.into_iter().chain(names))?;
    let standard_errors = compared.truth.occlusion_error.as_deref();
    for (idx, receiver) in compared.target.receivers.iter().enumerate() {
        let numbers = receiver.position.iter().chain(&receiver.normal);
        let mut row: Vec<String> = numbers.map(ToString::to_string).collect();
        row.push(compared.areas[idx].map_or("", Area::name).to_owned());
        row.push(compared.truth.occlusion[idx].to_string());
        row.push(
            standard_errors
                .map_or(0.0, |errors| errors[idx])
                .to_string(),
        );
        let modes = compared.modes.iter();
        row.extend(modes.map(|(_, shaded)| shaded.occlusion[idx].to_string()));
        writer.write_record(row)?;
    }
    writer.into_inner().map_err(|e| e.into_error().into())
}

/// Prints the table: the errors of each mode in each area that has receivers.
fn report(
    args: &Args,
    path: &Path,
    target: &Target,
    modes: Vec<ModeErrors>,
    console: &Console,
) -> anyhow::Result<()> {
    if args.json {
        return console.json(&Report {
            scene: path.display().to_string(),
            receivers: target.receivers.len(),
            areas: Area::ALL.map(Area::name),
            modes,
        });
    }
    console.result(
        "mode              area     receivers   truth    bias    RMSE     p95     max  off > 0.1",
    );
    let line = |mode: &str, area: &str, stats: &ErrorStats| {
        console.result(&format!(
            "{mode:18}{area:8}{:10}{:8.4}{:8.4}{:8.4}{:8.4}{:8.4}{:9.1} %",
            stats.receivers,
            stats.truth,
            stats.bias,
            stats.rmse,
            stats.p95,
            stats.max,
            100.0 * stats.far_off
        ));
    };
    for errors in &modes {
        for (area, stats) in Area::ALL.iter().zip(&errors.areas) {
            if let Some(stats) = stats {
                line(errors.mode, area.name(), stats);
            }
        }
        if let Some(all) = &errors.all {
            line(errors.mode, "all", all);
        }
    }
    Ok(())
}
