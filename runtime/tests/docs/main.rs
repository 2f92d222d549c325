//! Tests that the code of the guides compiles: every block of Rust and WGSL in `docs/*.md` and
//! `README.md` is a part of a source that is compiled or validated.

use std::fs;
use std::path::{Path, PathBuf};

use aogrid_runtime::wgsl::{ENVIRONMENT, SHADING, SURFACE};

/// The blocks of Rust, which are compiled and not run.
#[allow(dead_code, reason = "it only has to compile")]
mod guide;

/// The blocks of WGSL, in functions that pass them their inputs.
const GUIDE_WGSL: &str = include_str!("guide.wgsl");

/// The sources that hold the blocks of Rust: the module above, and the smallest program that bakes.
const RUST: [&str; 2] = [
    include_str!("guide.rs"),
    include_str!("../../../baker-cpu/examples/bake.rs"),
];

/// A block of code in a document.
struct Block {
    /// The document, and the line on which the block begins.
    place: String,
    language: String,
    code: String,
}

/// Returns the lines without their indentation.
fn flush_left(text: &str) -> String {
    let lines = text.lines().map(|line| line.trim().to_owned() + "\n");
    lines.collect()
}

/// Returns the blocks between lines of three backticks.
fn blocks(document: &str, text: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut is_inside = false;
    for (idx, line) in text.lines().enumerate() {
        match (line.strip_prefix("```"), is_inside) {
            (Some(language), false) => blocks.push(Block {
                place: format!("{document}:{}", idx + 1),
                language: language.to_owned(),
                code: String::new(),
            }),
            (None, true) => {
                let block = blocks.last_mut().expect("a block has begun");
                block.code += line;
                block.code += "\n";
            }
            _ => {}
        }
        is_inside ^= line.starts_with("```");
    }
    blocks
}

/// Returns the paths of README.md and of all documents in `docs`.
fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let entries = fs::read_dir(root.join("docs")).expect("the folder is there");
    let paths = entries.map(|entry| entry.expect("it is readable").path());
    let is_document = |path: &PathBuf| path.extension().is_some_and(|e| e == "md");
    let mut documents: Vec<_> = paths.filter(is_document).collect();
    documents.push(root.join("README.md"));
    documents.sort();
    documents
}

#[test]
fn every_block_of_code_is_compiled() {
    let mut n_blocks = 0;
    for path in documents() {
        let text = fs::read_to_string(&path).expect("it is text");
        let name = path.file_name().expect("it is a file").display();
        for block in blocks(&name.to_string(), &text) {
            let sources: &[&str] = match block.language.as_str() {
                "rust" => &RUST,
                "wgsl" => &[GUIDE_WGSL],
                _ => continue,
            };
            n_blocks += 1;
            // From the beginning of a line on.
            let code = "\n".to_owned() + &flush_left(&block.code);
            let is_compiled = sources
                .iter()
                .any(|source| flush_left(source).contains(&code));
            assert!(is_compiled, "{} is not compiled:{code}", block.place);
        }
    }
    assert!(n_blocks >= 7, "only {n_blocks} blocks were found");
}

#[test]
fn the_shaders_of_the_guide_are_valid() {
    let lists = aogrid_runtime::wgsl::tile_lists(1);
    let source = [SHADING, ENVIRONMENT, SURFACE, &lists, GUIDE_WGSL].concat();
    let module = naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    );
    validator
        .validate(&module)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
}

#[test]
fn blocks_are_found_with_their_places() {
    let found = blocks("x.md", "text\n```rust\na();\n```\n```sh\nb\n```\n");
    let found: Vec<_> = found.iter().map(|b| (&*b.place, &*b.code)).collect();
    assert_eq!(found, [("x.md:2", "a();\n"), ("x.md:5", "b\n")]);
}
