use super::*;

/// The fields of the example in `docs/format.md`: the number of bytes that are shown, that of all, and what
/// they are.
const FIELDS: [(usize, usize, &str); 36] = [
    (12, 12, "identifier: `«KTX 20»\\r\\n\\x1A\\n`"),
    (4, 4, "vkFormat 37: `R8G8B8A8_UNORM`"),
    (4, 4, "typeSize 1: bytes of a channel"),
    (4, 4, "pixelWidth 9: cells along x"),
    (4, 4, "pixelHeight 8: cells along y"),
    (4, 4, "pixelDepth 11: cells along z"),
    (4, 4, "layerCount 0"),
    (4, 4, "faceCount 1"),
    (4, 4, "levelCount 1"),
    (4, 4, "supercompressionScheme 0: none"),
    (4, 4, "dfdByteOffset 104"),
    (4, 4, "dfdByteLength 92"),
    (4, 4, "kvdByteOffset 196"),
    (4, 4, "kvdByteLength 560"),
    (16, 16, "sgdByteOffset and sgdByteLength 0: no global data"),
    (8, 8, "offset of the level: 756"),
    (8, 8, "its length: 3168 = 9 · 8 · 11 · 4"),
    (8, 8, "its length when unpacked"),
    (4, 4, "data format descriptor: its length, 92"),
    (
        8,
        24,
        "basic descriptor block: RGBA, linear, 4 bytes a texel",
    ),
    (8, 64, "a sample of 16 bytes for each channel"),
    (4, 4, "first pair of key and value: 19 bytes follow"),
    (
        19,
        19,
        "`KTXorientation`, NUL, `ruo`, NUL: x right, y up, z out of the page",
    ),
    (1, 1, "padding to a multiple of 4"),
    (4, 4, "second pair: 23 bytes follow"),
    (10, 10, "`KTXwriter`, NUL"),
    (13, 13, "`aogrid 0.1.0`, NUL"),
    (1, 1, "padding"),
    (4, 4, "third pair: 504 bytes follow"),
    (7, 7, "`aogrid`, NUL"),
    (8, 496, "JSON, as below"),
    (1, 1, "NUL"),
    (4, 4, "texel of cell (0, 0, 0)"),
    (4, 32, "the next: cell (1, 0, 0) to (8, 0, 0)"),
    (4, 252, "cell (0, 1, 0), to the end of the slice k = 0"),
    (4, 2880, "cell (0, 0, 1), to the end"),
];

/// The table of `docs/format.md` is what this makes of the frozen file.
#[test]
fn the_example_in_the_specification_is_the_frozen_file() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let document = std::fs::read_to_string(root.join("../docs/format.md")).unwrap();
    let bytes = std::fs::read(root.join("tests/golden/v1-moment-unorm8.ao.ktx2")).unwrap();
    let mut table = String::new();
    let mut at = 0;
    for (shown, length, meaning) in FIELDS {
        let hex: Vec<_> = bytes[at..at + shown]
            .iter()
            .map(|b| format!("{b:02X}"))
            .collect();
        let more = if shown < length { " …" } else { "" };
        table += &format!(
            "| {at} | {length} | `{}`{more} | {meaning} |\n",
            hex.join(" ")
        );
        at += length;
    }
    assert_eq!(at, bytes.len());
    assert!(
        document.contains(&table),
        "docs/format.md must hold\n{table}"
    );
    let end = 756 - 1;
    let json = std::str::from_utf8(&bytes[end - 496..end]).unwrap();
    let shown: serde_json::Value = serde_json::from_str(json).unwrap();
    let (_, block) = document.split_once("```json\n").unwrap();
    let (block, _) = block.split_once("```").unwrap();
    assert_eq!(
        serde_json::from_str::<serde_json::Value>(block).unwrap(),
        shown
    );
}
