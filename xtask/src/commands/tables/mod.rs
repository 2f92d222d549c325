//! `tables`: T_clip and T_merge by numeric integration.

mod files;
mod heat_map;
mod web;

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context, bail};
use aogrid_bake_core::Progress;
use aogrid_tables::{
    ClipTable, ErrorRow, GeneratedFile, MergeTable, error_report, generated_files,
};
use rayon::prelude::*;

use aogrid::console::{Bar, Console};
use aogrid::{interrupt, npy, output};

/// Generate the tables T_clip and T_merge by numeric integration
///
/// The tables are written into the source folder of the tables crate unless an option is given, and
/// copies of them and of the shading library into that of the npm package; commit the result.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Compare with the committed tables instead, and fail if they differ
    #[arg(long)]
    check: bool,
    /// Print the errors of integration, look-ups and formats against the closed forms
    #[arg(long)]
    errors: bool,
    /// Write NPY arrays, EXR images with named channels and PNG heat maps into this folder
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace files of that folder
    #[arg(long, requires = "out")]
    force: bool,
}

/// The examples at the end of `tables --help`.
const EXAMPLES: &str = "\
Examples:
  cargo xtask tables --check
  cargo xtask tables --check --errors
  cargo xtask tables -o tables-for-numpy";

/// The folders of the generated files, of the tables crate and of the npm package.
const TABLES_FOLDER: &str = "tables/src/generated";
const WEB_FOLDER: &str = "integrations/web/src/generated";

/// The files that `--out` writes.
const ANALYSIS_FILES: [&str; 6] = [
    "t_clip.npy",
    "t_merge.npy",
    "t_clip.exr",
    "t_merge.exr",
    "t_clip.png",
    "t_merge.png",
];

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    interrupt::listen();
    if let Some(folder) = &args.out {
        fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot create it", folder.display()))?;
        let files = ANALYSIS_FILES.iter().map(|name| folder.join(name));
        for file in files {
            output::check_new(&file, args.force)?;
        }
    }
    let (clip, merge) = generate(console)?;
    let tables = generated_files(&clip, &merge);
    let folders = [(TABLES_FOLDER, tables), (WEB_FOLDER, web::files())];
    if args.check {
        compare(&folders, console)?;
    }
    if args.errors {
        print_errors(&error_report(&clip, &merge), console);
    }
    if let Some(folder) = &args.out {
        write_for_analysis(folder, &clip, &merge, console)?;
    }
    if !args.check && !args.errors && args.out.is_none() {
        for (folder, files) in &folders {
            for file in files {
                output::write(&path(folder, file), &file.bytes)?;
            }
            console.note(&format!("wrote {} files into {folder}", files.len()));
        }
    }
    Ok(())
}

/// Checks that the committed tables equal the result of the integration.
pub(crate) fn check(console: &Console) -> anyhow::Result<()> {
    let (clip, merge) = generate(console)?;
    let tables = generated_files(&clip, &merge);
    compare(
        &[(TABLES_FOLDER, tables), (WEB_FOLDER, web::files())],
        console,
    )
}

/// The path of a generated file.
fn path(folder: &str, file: &GeneratedFile) -> PathBuf {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    root.join(folder).join(file.name)
}

fn generate(console: &Console) -> anyhow::Result<(ClipTable, MergeTable)> {
    let bar = console.progress("T_clip");
    let rows = ClipTable::row_count(ClipTable::SIZE);
    let clip = rows_in_parallel(rows, &bar, |y| ClipTable::row(ClipTable::SIZE, y))?;
    drop(bar);
    let bar = console.progress("T_merge");
    let rows = MergeTable::row_count(MergeTable::SIZE);
    let merge = rows_in_parallel(rows, &bar, |row| MergeTable::row(MergeTable::SIZE, row))?;
    Ok((
        ClipTable::from_rows(ClipTable::SIZE, clip),
        MergeTable::from_rows(MergeTable::SIZE, merge),
    ))
}

/// Computes `total` rows on all threads, in order.
fn rows_in_parallel<R: Send>(
    total: usize,
    bar: &Bar,
    row: impl Fn(usize) -> R + Sync,
) -> anyhow::Result<Vec<R>> {
    let done = AtomicUsize::new(0);
    let one = |idx| {
        let made = row(idx);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        match bar.observe(Progress { done, total }) {
            ControlFlow::Continue(()) => Ok(made),
            ControlFlow::Break(()) => bail!("cancelled"),
        }
    };
    (0..total).into_par_iter().map(one).collect()
}

fn compare(folders: &[(&str, Vec<GeneratedFile>)], console: &Console) -> anyhow::Result<()> {
    let mut count = 0;
    for (folder, files) in folders {
        for file in files {
            let shown = format!("{folder}/{}", file.name);
            let committed = fs::read(path(folder, file)).with_context(|| shown.clone())?;
            if committed != file.bytes {
                bail!("{shown} differs from what is generated: run `cargo xtask tables`");
            }
            count += 1;
        }
    }
    console.note(&format!("{count} committed files are up to date"));
    Ok(())
}

fn print_errors(rows: &[ErrorRow], console: &Console) {
    console.result("table    channel   measured          max      rms      where");
    for row in rows {
        let at: Vec<String> = row.at.iter().map(|x| format!("{x:.4}")).collect();
        let (table, channel, measured) = (row.table, row.channel, row.measured.to_string());
        let (max, rms, at) = (row.max, row.rms, at.join(", "));
        console.result(&format!(
            "{table:8} {channel:9} {measured:16}  {max:7.1e}  {rms:7.1e}  ({at})"
        ));
    }
}

fn write_for_analysis(
    folder: &Path,
    clip: &ClipTable,
    merge: &MergeTable,
    console: &Console,
) -> anyhow::Result<()> {
    let [
        clip_npy,
        merge_npy,
        clip_exr,
        merge_exr,
        clip_png,
        merge_png,
    ] = ANALYSIS_FILES.map(|name| folder.join(name));
    let (shape, values) = clip.node_array();
    npy::write(&clip_npy, &shape, values)?;
    let (shape, values) = merge.node_array();
    npy::write(&merge_npy, &shape, values)?;
    output::write(&clip_exr, &files::clip_exr(clip)?)?;
    output::write(&merge_exr, &files::merge_exr(merge)?)?;
    output::write(&clip_png, &heat_map::clip(clip)?)?;
    output::write(&merge_png, &heat_map::merge(merge)?)?;
    console.note(&format!(
        "wrote t_clip and t_merge as .npy, .exr and .png into {}",
        folder.display()
    ));
    Ok(())
}
