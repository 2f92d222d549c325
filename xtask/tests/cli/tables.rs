use std::fs;

use super::ok;

#[test]
fn committed_tables_equal_the_integration() {
    ok("tables --check", &[]);
}

#[test]
fn arrays_and_images_hold_the_nodes() {
    let folder = tempfile::tempdir().unwrap();
    ok("tables -o {}", &[folder.path()]);
    let npy = |name: &str| {
        let bytes = fs::read(folder.path().join(name)).unwrap();
        let file = npyz::NpyFile::new(&bytes[..]).unwrap();
        let shape = file.shape().to_vec();
        (shape, file.into_vec::<f32>().unwrap())
    };
    let (shape, clip) = npy("t_clip.npy");
    assert_eq!(shape, [64, 64, 3]);
    // (a, cos β, [AO, a', f]) in C order: a cone of half the sphere along the normal occludes
    // fully.
    let at = |a: usize, cos_beta: usize| &clip[(a * 64 + cos_beta) * 3..][..3];
    assert_eq!(at(63, 0), [1.0, 0.5, 0.0]);
    assert_eq!(at(0, 63), [0.0, 0.0, 1.0]);
    let (shape, merge) = npy("t_merge.npy");
    assert_eq!(shape, [48, 48, 32]);
    // (a1, a2, γ): with γ = π, a sixth and a third do not overlap; with γ = 0 they do.
    let fraction = |i: usize| i as f32 / 47.0;
    let union = |a1: usize, a2: usize, gamma: usize| merge[(a1 * 48 + a2) * 32 + gamma];
    assert!((union(8, 16, 31) - fraction(24)).abs() < 1e-6);
    assert!((union(8, 16, 0) - fraction(16)).abs() < 1e-6);

    for name in ["t_clip.png", "t_merge.png"] {
        let picture = image::open(folder.path().join(name)).unwrap().into_rgb8();
        // Both ends of the color scale occur: dark blue and yellow.
        for [r, g, b] in [[68, 1, 84], [253, 231, 37]] {
            assert!(picture.pixels().any(|p| p.0 == [r, g, b]), "{name}");
        }
    }
    use exr::prelude::*;
    let image = read_first_flat_layer_from_file(folder.path().join("t_clip.exr")).unwrap();
    let names: Vec<String> = image
        .layer_data
        .channel_data
        .list
        .iter()
        .map(|c| c.name.to_string())
        .collect();
    assert_eq!(names, ["AO", "a'", "f"]);
    let occlusion = image.layer_data.channel_data.list[0]
        .sample_data
        .values_as_f32();
    // Rows go down from cos β = 1; the array's second index goes up from −1.
    let expected = (0..64).rev().flat_map(|y| (0..64).map(move |x| (x, y)));
    assert!(
        occlusion
            .zip(expected)
            .all(|(ao, (x, y))| ao == at(x, y)[0])
    );
}

#[test]
fn errors_are_listed_for_every_format() {
    let report = ok("tables --errors", &[]);
    for what in [
        "integration",
        "look-ups, f32",
        "look-ups, f16",
        "nodes, unorm8",
    ] {
        for table in ["T_clip", "T_merge"] {
            let row = report
                .lines()
                .find(|l| l.starts_with(table) && l.contains(what));
            assert!(row.is_some(), "{table} {what} is not in {report}");
        }
    }
}
