//! Generates the shading library in GLSL and HLSL from the WGSL, by naga, into
//! `runtime/shading-languages`.
//!
//! `cargo run --manifest-path integrations/shading-languages/Cargo.toml` writes the files; with `--check`
//! it compares them with those that are there.

mod language;
mod names;
mod text;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};

use language::Language;
use text::{Block, Docs};

/// The folder of the WGSL library.
const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../runtime/src");

/// The folder of the generated files.
const FOLDER: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../runtime/shading-languages"
);

/// The library that all others need, by its WGSL files.
const SHADING: [&str; 3] = ["constants.wgsl", "lookup.wgsl", "shading.wgsl"];

/// A library: the name of its files, its WGSL files, and what it is.
struct Library {
    name: &'static str,
    /// The WGSL files that it needs besides those of shading.
    behind: &'static [&'static str],
    sources: &'static [&'static str],
    summary: &'static str,
}

const LIBRARIES: [Library; 4] = [
    Library {
        name: "aogrid",
        behind: &[],
        sources: &[],
        summary: "shading with baked ambient-occlusion grids",
    },
    Library {
        name: "aogrid_environment",
        behind: &[],
        sources: &["environment.wgsl"],
        summary: "light from an environment; include it behind `aogrid`",
    },
    Library {
        name: "aogrid_surface",
        behind: &["environment.wgsl"],
        sources: &["surface.wgsl"],
        summary: "environment light on baked surfaces; include it behind `aogrid_environment`",
    },
    Library {
        name: "aogrid_volumes",
        behind: &[],
        sources: &["volumes.wgsl"],
        summary: "ambient-occlusion volumes; include it behind `aogrid`",
    },
];

fn main() -> ExitCode {
    let result = match env::args().skip(1).collect::<Vec<_>>()[..] {
        [] => run(false),
        [ref only] if only == "--check" => run(true),
        _ => Err("wrong usage: there is one option, --check".to_owned()),
    };
    match result {
        Ok(done) => {
            println!("{done}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(is_check: bool) -> Result<String, String> {
    let mut files = Vec::new();
    for library in &LIBRARIES {
        for language in Language::ALL {
            let name = format!("{}.{}", library.name, language.ending());
            files.push((name, generate(library, language)?));
        }
    }
    for (name, content) in &files {
        let path = Path::new(FOLDER).join(name);
        let shown = format!("runtime/shading-languages/{name}");
        let failed = |error: std::io::Error| format!("{shown}: {error}");
        if !is_check {
            fs::create_dir_all(FOLDER).map_err(failed)?;
            fs::write(path, content).map_err(failed)?;
        } else if fs::read_to_string(path).map_err(failed)? != *content {
            return Err(format!(
                "{shown} differs from what the WGSL gives: run `cargo run --manifest-path \
                 integrations/shading-languages/Cargo.toml`"
            ));
        }
    }
    let what = if is_check { "up to date" } else { "written" };
    Ok(format!(
        "{} files of the shading library are {what}",
        files.len()
    ))
}

/// Returns a library in a language.
fn generate(library: &Library, language: Language) -> Result<String, String> {
    let shading = sources(&SHADING)? + &sources(library.behind)?;
    let all = shading.clone() + &sources(library.sources)?;
    let docs = Docs::of(&all);
    let mut blocks = text::blocks(&language.translate(&all)?);
    if !library.sources.is_empty() {
        let of_shading = text::blocks(&language.translate(&shading)?);
        let is_new = |block: &Block| of_shading.iter().all(|other| other.name != block.name);
        blocks.retain(is_new);
    }
    let reserved = names::reserved(&blocks);
    for block in blocks.iter_mut().filter(|block| block.is_function) {
        block.text = names::without_numbers(&block.text, &reserved);
    }
    let guard = format!("{}_{}", library.name, language.ending()).to_uppercase();
    let mut out = format!(
        "// aogrid: {}.\n//\n// Generated from WGSL by naga: do not edit. {}\n\n#ifndef {guard}\n\
         #define {guard}\n",
        library.summary,
        language.note()
    );
    for block in &blocks {
        if !block.is_constant {
            out += "\n";
        }
        let needs = language.condition(&block.text);
        out += &needs.map_or(String::new(), |needs| format!("#if {needs}\n"));
        out += &docs.comment(&block.name);
        out += &block.text;
        out += needs.map_or("", |_| "#endif\n");
    }
    Ok(out + "\n#endif\n")
}

fn sources(names: &[&str]) -> Result<String, String> {
    let read = |name: &&str| {
        let path = PathBuf::from(SOURCES).join(name);
        fs::read_to_string(path).map_err(|error| format!("runtime/src/{name}: {error}"))
    };
    names.iter().map(read).collect()
}
