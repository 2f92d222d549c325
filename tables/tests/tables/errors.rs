use aogrid_tables::{ClipTable, ErrorRow, Format, Measured, MergeTable, error_report};

/// The documented agreement of integration and closed form. The measured error is a hundred times
/// smaller.
const INTEGRATION: f64 = 1e-12;

/// Largest and root-mean-square error of look-ups in the masters, as designed.
const CLIP_LOOK_UPS: [f64; 2] = [1.4e-3, 1.05e-4];
const MERGE_LOOK_UPS: [f64; 2] = [6.4e-3, 3.6e-4];

/// Half a quantization step of the master.
const MASTER: f64 = 0.5 / (1 << 24) as f64;

/// Half a quantization step of each format; of f16 in its coarsest interval, ½ to 1.
const F16: f64 = 0.5 / 2048.0;
const UNORM8: f64 = 0.5 / 255.0;

fn committed_report() -> Vec<ErrorRow> {
    error_report(&ClipTable::committed(), &MergeTable::committed())
}

/// Returns the bounds on the largest and the rms error, for channels that have bounds. Look-ups of
/// a′, f and the axis have none: they have a jump or a crease that no table resolves (the crate's
/// documentation has figures).
fn bounds(row: &ErrorRow) -> Option<[f64; 2]> {
    let unbounded = f64::INFINITY;
    match (row.measured, row.channel) {
        (Measured::Integration, _) => Some([INTEGRATION; 2]),
        (Measured::Nodes(_), "(AO/2)d'") => None,
        (Measured::Nodes(None), _) => Some([MASTER + INTEGRATION, unbounded]),
        (Measured::Nodes(Some(Format::F16)), _) => Some([F16 + MASTER, unbounded]),
        (Measured::Nodes(Some(Format::Unorm8)), _) => Some([UNORM8 + MASTER, unbounded]),
        (Measured::LookUps(None), "AO") => Some(CLIP_LOOK_UPS),
        (Measured::LookUps(None), "union") => Some(MERGE_LOOK_UPS),
        (Measured::LookUps(Some(format)), "AO") => Some(widened(CLIP_LOOK_UPS, format)),
        (Measured::LookUps(Some(format)), "union") => Some(widened(MERGE_LOOK_UPS, format)),
        (Measured::LookUps(_), _) => None,
    }
}

/// Widens bounds by rounding: a mean of rounded entries is off by at most the largest rounding.
fn widened(bounds: [f64; 2], format: Format) -> [f64; 2] {
    let half_step = if format == Format::F16 { F16 } else { UNORM8 };
    bounds.map(|bound| bound + half_step)
}

#[test]
fn errors_stay_within_the_documented_bounds() {
    let mut compared = 0;
    for row in committed_report() {
        if let Some([max, rms]) = bounds(&row) {
            assert!(
                row.max <= max && row.rms <= rms,
                "{}: {row:?}",
                row.measured
            );
            compared += 1;
        }
    }
    // Channels of both tables: integration 4 + 1; in three precisions nodes 3 + 1, look-ups 1 + 1.
    assert_eq!(compared, 5 + 3 * 6);
}

/// Tests the measurement itself: the report must point at an entry that is changed.
#[test]
fn the_report_finds_a_wrong_entry() {
    let mut rows: Vec<_> = (0..4).map(|row| ClipTable::row([5, 4], row)).collect();
    rows[2][3][0] -= 0.125;
    let clip = ClipTable::from_rows([5, 4], rows);
    let mut rows: Vec<_> = (0..12).map(|row| MergeTable::row([5, 4, 3], row)).collect();
    rows[1 + 4][2] += 0.125;
    let merge = MergeTable::from_rows([5, 4, 3], rows);

    let report = error_report(&clip, &merge);
    let nodes = |channel| {
        let found = report
            .iter()
            .find(|row| row.measured == Measured::Nodes(None) && row.channel == channel);
        found.unwrap()
    };
    let near = |x: f64, y: f64| (x - y).abs() < 1e-6;
    assert!(near(nodes("AO").max, 0.125) && near(nodes("union").max, 0.125));
    assert!(
        nodes("AO")
            .at
            .iter()
            .zip([0.75, 1.0 / 3.0])
            .all(|(&x, y)| near(x, y))
    );
    let expected = [0.5, 1.0 / 3.0, std::f64::consts::FRAC_PI_2];
    assert!(
        nodes("union")
            .at
            .iter()
            .zip(expected)
            .all(|(&x, y)| near(x, y))
    );
    assert!(nodes("a'").max < 1e-6);
}
