//! Tests that npm's `ktx-parse` and three.js read our files. They need Node.js and the npm
//! registry, and are skipped if one is missing, unless `AOGRID_NODE=require`.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{BakeOptions, Placement};
use aogrid_grid_format::{Encoding, Sampling, TexelFormat};
use aogrid_tests::grid;

use crate::node::node;

#[test]
fn ktx_parse_and_three_js_read_every_kind_of_file() {
    let Some(node) = node() else { return };
    let mesh = Model::Table.mesh(None).unwrap();
    let kinds: Vec<_> = Encoding::ALL
        .into_iter()
        .flat_map(|encoding| TexelFormat::ALL.map(|format| (encoding, format)))
        .collect();
    // Three different sizes, so that no axes can be confused; odd ones need padding in R8.
    let placement = Placement {
        resolution: [9, 10, 11],
        ..Placement::paper()
    };
    let paths: Vec<PathBuf> = kinds
        .iter()
        .map(|&(encoding, format)| {
            let options = BakeOptions {
                sampling: Sampling::CubeFaces { size: 8 },
                encoding,
                format,
                ..BakeOptions::paper()
            };
            let path = node.join(format!("{}-{}.ao.ktx2", encoding.name(), format.name()));
            fs::write(&path, grid(&mesh, &placement, &options).to_bytes()).unwrap();
            path
        })
        .collect();

    let checked = Command::new("node")
        .arg("check.mjs")
        .args(&paths)
        .current_dir(node)
        .output()
        .unwrap();
    let stdout = String::from_utf8(checked.stdout).unwrap();
    let errors = String::from_utf8_lossy(&checked.stderr);
    assert!(checked.status.success(), "{errors}");
    let found: Vec<serde_json::Value> = stdout
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let expected: Vec<_> = kinds
        .iter()
        .map(|(encoding, format)| {
            serde_json::json!({
                "rewrittenEqual": true,
                "orientation": "ruo",
                "encoding": encoding.name(),
                "is3d": true,
                "size": [9, 10, 11],
                "type": format.name(),
                "channels": encoding.channels(),
                "texelsEqual": true,
                "colorSpace": "srgb-linear",
            })
        })
        .collect();
    assert_eq!(found, expected);
}
