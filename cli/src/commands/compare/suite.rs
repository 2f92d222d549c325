//! The accuracy suite, occluder by occluder.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use aogrid_scene::suite::{
    self, Area, ROWS, Row, Subject, SubjectReport, SuiteOptions, Summary, Truth,
};
use serde::Serialize;

use super::Args;
use crate::console::Console;
use crate::output;
use crate::usage::usage;

/// The report for a machine.
#[derive(Serialize)]
struct Report<'a> {
    /// The areas in the order of all lists.
    areas: [&'static str; Area::ALL.len()],
    receivers: u32,
    samples: u32,
    seed: u64,
    summary: Vec<SummaryRow<'a>>,
    subjects: &'a [SubjectReport],
}

/// A row's errors over all occluders.
#[derive(Serialize)]
struct SummaryRow<'a> {
    name: &'a str,
    areas: [Option<Summary>; Area::ALL.len()],
}

pub(super) fn run(args: &Args, out: Option<&Path>, console: &Console) -> anyhow::Result<()> {
    let recommended = SuiteOptions::recommended();
    let options = SuiteOptions {
        receivers: args.receivers.unwrap_or(recommended.receivers),
        samples: args.samples.unwrap_or(recommended.samples),
        seed: args.seed.unwrap_or(recommended.seed),
    };
    let rows = rows(&args.rows)?;
    let subjects = subjects(&args.only)?;
    if let Some(folder) = out {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        check_files(folder, &subjects, args)?;
    }
    let stages = |name: &str| console.stage(name);
    let mut reports = vec![];
    for (idx, subject) in subjects.iter().enumerate() {
        let truth = truth(args, out, subject, &options, console)?;
        reports.push(suite::judge(subject, &truth, &rows, &stages)?);
        let n = subjects.len();
        console.note(&format!("{} ({} of {n})", subject.name, idx + 1));
    }
    let summary = suite::summarize(&reports);
    let named = rows.iter().zip(summary);
    let report = Report {
        areas: Area::ALL.map(Area::name),
        receivers: options.receivers,
        samples: options.samples,
        seed: options.seed,
        summary: named
            .map(|(row, areas)| SummaryRow {
                name: row.name,
                areas,
            })
            .collect(),
        subjects: &reports,
    };
    if let Some(folder) = out {
        let json = serde_json::to_string_pretty(&report)?;
        output::write(&folder.join("suite.json"), json.as_bytes())?;
    }
    match args.json {
        true => console.json(&report),
        false => {
            print(&report, console);
            Ok(())
        }
    }
}

/// Checks that the report and the truths can be written; with `--resume` those that are there are to
/// be replaced where they are of other options.
fn check_files(folder: &Path, subjects: &[Subject], args: &Args) -> anyhow::Result<()> {
    let truths = subjects.iter().map(|subject| truth_file(folder, subject));
    truths
        .chain([folder.join("suite.json")])
        .try_for_each(|file| output::check_new(&file, args.force || args.resume))
}

fn truth_file(folder: &Path, subject: &Subject) -> PathBuf {
    folder.join(format!("{}.csv", subject.name))
}

/// Returns the rows whose name contains one of some texts; all without texts.
fn rows(texts: &[String]) -> anyhow::Result<Vec<Row>> {
    let chosen = |row: &Row| texts.is_empty() || texts.iter().any(|t| row.name.contains(t));
    let rows: Vec<_> = ROWS.into_iter().filter(chosen).collect();
    if rows.is_empty() {
        let names = ROWS.map(|row| format!("`{}`", row.name)).join(", ");
        return Err(usage(format!("no row is named so; there are: {names}")));
    }
    Ok(rows)
}

/// Returns the suite's occluders, or those of some names and files.
fn subjects(only: &[String]) -> anyhow::Result<Vec<Subject>> {
    let own = Subject::own();
    let data = Subject::data_files();
    if only.is_empty() {
        let data: aogrid_scene::Result<Vec<_>> = data.iter().map(|p| Subject::load(p)).collect();
        return Ok(own.into_iter().chain(data?).collect());
    }
    let mut own: Vec<_> = own.into_iter().map(Some).collect();
    let find = |name: &String| {
        let same =
            |subject: &&mut Option<Subject>| subject.as_ref().is_some_and(|s| s.name == *name);
        if let Some(subject) = own.iter_mut().find(same).and_then(Option::take) {
            return Ok(subject);
        }
        let path = data
            .iter()
            .find(|path| path.file_stem().is_some_and(|s| s == name.as_str()));
        let path = path.map_or(Path::new(name), |path| path);
        Ok(Subject::load(path)?)
    };
    only.iter().map(find).collect()
}

/// Returns an occluder's truth: from the folder with `--resume`, or traced, and kept there.
fn truth(
    args: &Args,
    out: Option<&Path>,
    subject: &Subject,
    options: &SuiteOptions,
    console: &Console,
) -> anyhow::Result<Truth> {
    let file = out.map(|folder| truth_file(folder, subject));
    if let Some(file) = file.as_ref().filter(|file| args.resume && file.exists()) {
        let shown = || file.display().to_string();
        let text = fs::read_to_string(file).with_context(shown)?;
        if let Some(truth) = Truth::from_csv(&text, subject, options).with_context(shown)? {
            return Ok(truth);
        }
    }
    let truth = Truth::trace(subject, options, &|name| console.stage(name))?;
    if let Some(file) = &file {
        output::write(file, truth.to_csv().as_bytes())?;
    }
    Ok(truth)
}

/// Prints the tables: RMSE and p95 of each row in each area, over all occluders and of each.
fn print(report: &Report<'_>, console: &Console) {
    let cell = |text: &str| format!("{text:>14}");
    let heading: String = report.areas.iter().map(|area| cell(area)).collect();
    let line = |name: &str, values: [Option<[f64; 2]>; Area::ALL.len()]| {
        let cells = values.map(|value| match value {
            Some([rmse, p95]) => cell(&format!("{rmse:.4} {p95:.3}")),
            None => cell("-"),
        });
        console.result(&format!("{name:22}{}", cells.concat()));
    };
    for subject in report.subjects {
        console.result("");
        console.result(&format!(
            "{} ({} triangles): RMSE and p95 of AO",
            subject.name, subject.triangles
        ));
        console.result(&format!("{:22}{heading}", ""));
        for row in &subject.rows {
            line(row.name, row.areas.map(|a| a.map(|a| [a.rmse, a.p95])));
        }
        let left_out: String = subject
            .left_out
            .iter()
            .map(|n| cell(&n.to_string()))
            .collect();
        console.result(&format!("{:22}{left_out}", "left out"));
    }
    let n = report.subjects.len();
    console.result("");
    console.result(&format!("{n} occluders: RMS of RMSE, mean of p95"));
    console.result(&format!("{:22}{heading}", ""));
    for row in &report.summary {
        line(row.name, row.areas.map(|a| a.map(|a| [a.rmse, a.p95])));
    }
}
