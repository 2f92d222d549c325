use aogrid_tables::{ClipTable, MergeTable, clip, merge, texture_coordinate};
use std::f32::consts::PI;

/// Rounding of coordinates: at 2⁻²⁴, then scaled to at most 64 texels, between which a table
/// changes by at most one.
const COORDINATE_ROUNDING: f32 = 64.0 / (1 << 23) as f32;

/// Returns small tables with a different size for every axis, so that swapped axes are noticed.
fn small_tables() -> (ClipTable, MergeTable) {
    (ClipTable::generate([5, 4]), MergeTable::generate([5, 3, 4]))
}

#[track_caller]
fn assert_near(value: f32, expected: f32) {
    assert!(
        (value - expected).abs() <= COORDINATE_ROUNDING,
        "{value} instead of {expected}"
    );
}

/// Rows, which callers compute on several threads, make up the same table.
#[test]
fn rows_make_the_table() {
    let (clip_table, merge_table) = small_tables();
    assert_eq!(ClipTable::row_count([5, 4]), 4);
    let rows = (0..4).map(|row| ClipTable::row([5, 4], row)).collect();
    assert_eq!(ClipTable::from_rows([5, 4], rows), clip_table);

    assert_eq!(MergeTable::row_count([5, 3, 4]), 12);
    let rows = (0..12).map(|row| MergeTable::row([5, 3, 4], row)).collect();
    assert_eq!(MergeTable::from_rows([5, 3, 4], rows), merge_table);
}

#[test]
fn clip_axes_are_the_fraction_then_the_cosine() {
    let (table, _) = small_tables();
    assert_eq!(table.size(), [5, 4]);
    for (x, a) in [0.0, 0.25, 0.5, 0.75, 1.0].into_iter().enumerate() {
        for (y, cos_beta) in [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0].into_iter().enumerate() {
            let exact = clip::closed_form(a, cos_beta);
            let (node, look_up) = (table.node(x, y), table.sample(a, cos_beta));
            for entry in [node, look_up] {
                assert_near(entry.occlusion, exact.occlusion);
                assert_near(entry.fraction, exact.fraction);
                assert_near(entry.axis_weight, exact.axis_weight);
            }
        }
    }
}

#[test]
fn merge_axes_are_both_fractions_then_the_angle() {
    let (_, table) = small_tables();
    assert_eq!(table.size(), [5, 3, 4]);
    for (x, a1) in [0.0, 0.25, 0.5, 0.75, 1.0].into_iter().enumerate() {
        for (y, a2) in [0.0, 0.5, 1.0].into_iter().enumerate() {
            for (z, gamma) in [0.0, PI / 3.0, 2.0 * PI / 3.0, PI].into_iter().enumerate() {
                let exact = merge::closed_form(a1, a2, gamma);
                assert_near(table.node(x, y, z), exact);
                assert_near(table.sample(a1, a2, gamma), exact);
            }
        }
    }
}

#[test]
fn entries_are_interpolated_linearly_between_nodes() {
    let (clip_table, merge_table) = small_tables();
    let [low, high] = [clip_table.node(1, 2), clip_table.node(2, 2)];
    let quarter = clip_table.sample(0.25 + 0.25 * 0.25, 1.0 / 3.0);
    assert_near(
        quarter.occlusion,
        0.75 * low.occlusion + 0.25 * high.occlusion,
    );
    assert_near(quarter.fraction, 0.75 * low.fraction + 0.25 * high.fraction);
    assert_near(
        quarter.axis_weight,
        0.75 * low.axis_weight + 0.25 * high.axis_weight,
    );

    let corners = (0..8).map(|k| merge_table.node(3 + (k & 1), k >> 1 & 1, 1 + (k >> 2)));
    let middle = merge_table.sample(0.875, 0.25, 0.5 * PI);
    assert_near(middle, corners.sum::<f32>() / 8.0);
}

#[test]
fn look_ups_are_clamped_to_the_ends() {
    let (clip_table, merge_table) = small_tables();
    assert_eq!(clip_table.sample(1.5, -1.5), clip_table.sample(1.0, -1.0));
    assert_eq!(clip_table.sample(-0.5, 1.5), clip_table.sample(0.0, 1.0));
    assert_eq!(
        merge_table.sample(1.5, -0.5, 4.0),
        merge_table.sample(1.0, 0.0, PI)
    );
}

#[test]
fn nodes_are_the_centers_of_texels() {
    for size in [2, 5, 32, 48, 64] {
        for node in 0..size {
            let x = node as f32 / (size - 1) as f32;
            let center = (node as f32 + 0.5) / size as f32;
            assert!((texture_coordinate(x, size) - center).abs() <= f32::EPSILON);
        }
    }
}

#[test]
fn node_arrays_are_indexed_by_the_arguments() {
    let (clip_table, merge_table) = small_tables();
    let (shape, values) = clip_table.node_array();
    assert_eq!((shape, values.len()), ([5, 4, 3], 60));
    let entry = clip_table.node(3, 2);
    let start = 3 * (2 + 4 * 3);
    assert_eq!(
        values[start..start + 3],
        [entry.occlusion, entry.fraction, entry.axis_weight]
    );

    let (shape, values) = merge_table.node_array();
    assert_eq!((shape, values.len()), ([5, 3, 4], 60));
    assert_eq!(values[2 + 4 * (1 + 3 * 3)], merge_table.node(3, 1, 2));
}

#[test]
#[should_panic(expected = "needs a node at either end")]
fn a_table_of_one_node_is_refused() {
    ClipTable::row([1, 4], 0);
}
