//! The copies of tables and shaders in the npm package (`integrations/web`): modules of TypeScript.

use aogrid_runtime::wgsl;
use aogrid_tables::{
    ClipTable, Format, GeneratedFile, MergeTable, clip_texels, intersection_texels,
    transmittance_texels,
};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// The first line of each file.
const HEADER: &str = "// Made by `cargo xtask tables`: do not edit.\n";

/// Returns the modules. Their tables are those that the crate of the tables was compiled with.
pub(super) fn files() -> Vec<GeneratedFile> {
    let file = |name, text: String| GeneratedFile {
        name,
        bytes: text.into_bytes(),
    };
    vec![file("tables.ts", tables()), file("wgsl.ts", shaders())]
}

fn tables() -> String {
    let ([width, height], merge) = (ClipTable::SIZE, MergeTable::SIZE);
    let transmittance = transmittance_texels(Format::F16);
    let overlaps = intersection_texels(Format::F16);
    [
        HEADER,
        &constant(
            "CLIP_SIZE",
            "Texels of T_clip, along a and cos beta.",
            &format!("[{width}, {height}]"),
        ),
        &constant(
            "MERGE_SIZE",
            "Texels of T_merge, along a1, a2 and gamma.",
            &format!("{merge:?}"),
        ),
        &texels(
            "CLIP",
            "T_clip: AO, a', f and 1",
            4 * width,
            clip_texels(Format::F16),
        ),
        &texels("TRANSMITTANCE", "T_clip as 1 - AO", width, &transmittance),
        &texels(
            "OVERLAPS",
            "T_merge as the fraction that two cones share",
            merge[0],
            &overlaps,
        ),
    ]
    .concat()
}

fn shaders() -> String {
    // Strings of JSON are strings of TypeScript.
    let text = |name, comment: &str, wgsl: &str| {
        let quoted = serde_json::to_string(wgsl).expect("text has a JSON form");
        constant(name, comment, &quoted)
    };
    [
        HEADER,
        &text(
            "SHADING",
            "The shading library: constants, structs and pure functions, to paste before a shader.",
            wgsl::SHADING,
        ),
        &text(
            "ENVIRONMENT",
            "The environment-light library: paste it behind SHADING.",
            wgsl::ENVIRONMENT,
        ),
        &text(
            "SURFACE",
            "The library of baked surfaces: paste it behind SHADING and ENVIRONMENT.",
            wgsl::SURFACE,
        ),
        &text(
            "VOLUMES",
            "The library of volumes around triangles: paste it behind SHADING.",
            wgsl::VOLUMES,
        ),
    ]
    .concat()
}

/// Returns half floats in the form that compresses best: each less the one a row before it, all lower
/// bytes, then all upper ones.
fn texels(name: &str, comment: &str, row: usize, texels: &[u8]) -> String {
    let (halves, _) = texels.as_chunks::<2>();
    let bits: Vec<u16> = halves
        .iter()
        .map(|half| u16::from_le_bytes(*half))
        .collect();
    let before = |idx: usize| idx.checked_sub(row).map_or(0, |idx| bits[idx]);
    let deltas: Vec<[u8; 2]> = (0..bits.len())
        .map(|idx| bits[idx].wrapping_sub(before(idx)).to_le_bytes())
        .collect();
    let plane = |byte: usize| deltas.iter().map(move |delta| delta[byte]);
    let planes: Vec<u8> = plane(0).chain(plane(1)).collect();
    let quoted = format!("'{}'", STANDARD.encode(planes));
    constant(
        name,
        &format!("{comment}: half floats, see `decode`."),
        &quoted,
    )
}

fn constant(name: &str, comment: &str, value: &str) -> String {
    format!("\n/** {comment} */\nexport const {name} = {value};\n")
}
