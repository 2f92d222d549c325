use aogrid_tables::{ClipTable, MergeTable};
use std::fmt::Write;

/// Steps per unit to which values are rounded before hashing, so that invisible differences do not
/// change the hash.
const STEPS: f64 = 1e6;

#[test]
fn t_clip() {
    let mut text = String::new();
    let small = ClipTable::generate([9, 9]);
    let (_, nodes) = small.node_array();
    for (channel, name) in ["AO", "a'", "f"].into_iter().enumerate() {
        let rows = (0..9).rev().map(|y| {
            let entries = (0..9).map(|x| nodes[channel + 3 * (y + 9 * x)]).collect();
            (format!("cos β {:+.2}", y as f32 / 4.0 - 1.0), entries)
        });
        write_block(
            &mut text,
            &format!("{name}: a 0 to 1 across, cos β 1 to -1 down"),
            rows,
        );
    }
    let (_, master) = ClipTable::committed().node_array();
    for (channel, name) in ["AO", "a'", "f"].into_iter().enumerate() {
        let values: Vec<f32> = master.iter().skip(channel).step_by(3).copied().collect();
        write_summary(&mut text, name, &values);
    }
    writeln!(text, "{:?} blake3 {}", ClipTable::SIZE, hash(&master)).unwrap();
    insta::assert_snapshot!(text);
}

#[test]
fn t_merge() {
    let mut text = String::new();
    let small = MergeTable::generate([9, 5, 5]);
    for z in 0..5 {
        let rows = (0..5).map(|y| {
            let entries = (0..9).map(|x| small.node(x, y, z)).collect();
            (format!("a2 {:.2}", y as f32 / 4.0), entries)
        });
        write_block(
            &mut text,
            &format!("γ = {z}/4 π: a1 0 to 1 across, a2 0 to 1 down"),
            rows,
        );
    }
    let (_, master) = MergeTable::committed().node_array();
    write_summary(&mut text, "union", &master);
    writeln!(text, "{:?} blake3 {}", MergeTable::SIZE, hash(&master)).unwrap();
    insta::assert_snapshot!(text);
}

fn write_block(text: &mut String, title: &str, rows: impl Iterator<Item = (String, Vec<f32>)>) {
    writeln!(text, "{title}").unwrap();
    for (name, entries) in rows {
        let entries: Vec<String> = entries.iter().map(|entry| format!("{entry:.4}")).collect();
        writeln!(text, "{name:<12}{}", entries.join("  ")).unwrap();
    }
    text.push('\n');
}

fn write_summary(text: &mut String, name: &str, values: &[f32]) {
    let sum: f64 = values.iter().copied().map(f64::from).sum();
    let min = values.iter().copied().fold(f32::INFINITY, f32::min);
    let max = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    writeln!(
        text,
        "master {name:<6} Σ {sum:.4}  min {min:.6}  max {max:.6}"
    )
    .unwrap();
}

/// Returns the hash of every entry of the master, in C order.
fn hash(master: &[f32]) -> String {
    let steps = master
        .iter()
        .map(|&value| (f64::from(value) * STEPS).round() as u32);
    let bytes: Vec<u8> = steps.flat_map(u32::to_le_bytes).collect();
    blake3::hash(&bytes).to_hex().to_string()
}
