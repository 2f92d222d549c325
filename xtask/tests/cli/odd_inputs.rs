//! Odd and broken files: each gives a result or a one-line error within ten seconds and one GiB.
#![cfg(unix)]

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use aogrid_tests::{files_with_ending, shared};
use serde_json::Value;

use super::one_line_error;

const TIME_LIMIT: Duration = Duration::from_secs(10);

/// Runs a command within the limits; the address space is limited, which is an upper bound of the
/// memory in use.
pub(super) fn limited(args: &[&Path]) -> Output {
    let script = "ulimit -v 1048576; exec \"$0\" \"$@\"";
    let mut command = Command::new("sh");
    command
        .args(["-c", script, env!("CARGO_BIN_EXE_xtask")])
        .args(args);
    let start = Instant::now();
    let child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let output = child.unwrap().wait_with_output().unwrap();
    assert!(
        start.elapsed() < TIME_LIMIT,
        "{args:?} took {:?}",
        start.elapsed()
    );
    output
}

/// The number of triangles that each of three other programs reads; `None` for an error.
type Peers = [Option<usize>; 3];

/// Parses the peers' columns of the data folder's index, by file name.
fn peers(index: &str) -> HashMap<String, Peers> {
    let rows = index.lines().skip(1).map(|row| {
        let columns: Vec<&str> = row.split('\t').collect();
        let name = columns[0].rsplit('/').next().unwrap().to_owned();
        (
            name,
            [6, 7, 8].map(|c| columns.get(c).and_then(|v| v.parse().ok())),
        )
    });
    rows.collect()
}

/// Files that we refuse although other programs read them, each with the reason.
const REFUSED: [(&str, &str); 1] = [(
    // Only one of three programs decodes UTF-16, and the user can easily save the file as UTF-8.
    "assimp__box_UTF16BE.obj",
    "UTF-16",
)];

#[test]
fn odd_obj_files_are_read_as_others_do_or_refused_with_a_reason() {
    let Some(folder) = shared("data/odd") else {
        return;
    };
    let peers = peers(&fs::read_to_string(folder.join("INDEX.tsv")).unwrap());
    let out = tempfile::tempdir().unwrap();
    let grid = out.path().join("odd.ao.ktx2");
    let (mut read, mut refused) = (0, 0);
    for path in files_with_ending(&folder.join("obj"), ".obj") {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let args = ["bake", "-o", "--resolution", "8", "--force", "--json"].map(Path::new);
        let [bake, o, resolution, eight, force, json] = args;
        let output = limited(&[bake, &path, o, &grid, resolution, eight, force, json]);
        let others = peers[&name];
        if output.status.success() {
            read += 1;
            let report: Value = serde_json::from_slice(&output.stdout).unwrap();
            let ours = report["outputs"][0]["mesh"]["triangles"].as_u64().unwrap() as usize;
            assert!(
                others.contains(&Some(ours)),
                "{name}: {ours} triangles, others {others:?}"
            );
            continue;
        }
        refused += 1;
        // The JSON report has the error, too.
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report["outputs"][0]["state"], "failed", "{name}");
        let stdout = vec![];
        let error = one_line_error(&Output { stdout, ..output }, &name);
        assert!(error.contains(&name), "{error}");
        let known = REFUSED.iter().find(|(refused, _)| *refused == name);
        let nobody_fails = others.iter().all(|n| n.is_some_and(|n| n > 0));
        let everybody_reads = others.iter().all(Option::is_some) && others != [Some(0); 3];
        match known {
            Some((_, why)) => assert!(error.contains(why), "{error}"),
            None => assert!(
                !nobody_fails && !everybody_reads,
                "{name}: {error}, others {others:?}"
            ),
        }
    }
    println!("{read} read, {refused} refused");
    assert!(read > 30 && refused > 30);
}

#[test]
fn odd_gltf_files_are_read_or_refused_in_a_line() {
    let Some(folder) = shared("data/odd/gltf") else {
        return;
    };
    let mut files = Vec::new();
    let mut folders = vec![folder];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(".gltf") || name.ends_with(".glb") {
                files.push(path);
            }
        }
    }
    let (mut read, mut refused) = (0, 0);
    for path in files {
        let output = limited(&[Path::new("info"), &path]);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if output.status.success() {
            read += 1;
            continue;
        }
        refused += 1;
        let error = one_line_error(&output, &name);
        assert!(error.contains(&name), "{error}");
    }
    println!("{read} read, {refused} refused");
    assert!(read > 15 && refused > 100);
}

#[test]
fn odd_ktx2_files_are_refused_in_a_line() {
    let Some(folder) = shared("data") else {
        return;
    };
    for inside in ["odd/ktx2", "ktx2"] {
        for path in files_with_ending(&folder.join(inside), ".ktx2") {
            for command in ["info", "verify"] {
                let output = limited(&[Path::new(command), &path]);
                let stderr = String::from_utf8(output.stderr).unwrap();
                assert_eq!(output.status.code(), Some(1), "{stderr}");
                assert!(!stderr.contains("panicked"), "{stderr}");
                let name = path.file_name().unwrap().to_string_lossy().into_owned();
                assert!(stderr.lines().next().unwrap().contains(&name), "{stderr}");
            }
        }
    }
}

#[test]
fn a_material_file_is_not_a_model() {
    let Some(folder) = shared("data/odd/obj") else {
        return;
    };
    let out = tempfile::tempdir().unwrap();
    let grid = out.path().join("a.ao.ktx2");
    for path in files_with_ending(&folder, ".mtl") {
        let output = limited(&[Path::new("bake"), &path, Path::new("-o"), &grid]);
        assert!(one_line_error(&output, "mtl").contains("format is not known"));
    }
}

/// Renders one receiver under each file as the sky.
fn odd_skies(inside: &str) {
    let Some(folder) = shared("data/odd") else {
        return;
    };
    let out = tempfile::tempdir().unwrap();
    let [scene, csv] = ["scene.toml", "a.csv"].map(|name| out.path().join(name));
    let (mut read, mut refused) = (0, 0);
    for path in files_with_ending(&folder.join(inside), "") {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = format!(
            "[environment]\nfile = '{}'\n[receivers]\ncorner = [0, 0, 0]\nu = [0, 0, 1]\n\
             v = [1, 0, 0]\ncount = [1, 1]\n[truth]\nsamples = 2\n",
            path.display()
        );
        fs::write(&scene, text).unwrap();
        let args = [
            "render",
            "--mode",
            "truth",
            "--threads",
            "2",
            "--force",
            "-o",
        ]
        .map(Path::new);
        let [render, mode, truth, threads, two, force, o] = args;
        let output = limited(&[render, &scene, mode, truth, threads, two, force, o, &csv]);
        if output.status.success() {
            read += 1;
            let table = fs::read_to_string(&csv).unwrap();
            let row = table.lines().nth(1).unwrap();
            assert!(
                !row.contains("NaN") && !row.contains("inf"),
                "{name}: {row}"
            );
            continue;
        }
        refused += 1;
        let error = one_line_error(&output, &name);
        assert!(error.contains(&name), "{error}");
    }
    println!("{inside}: {read} read, {refused} refused");
    assert!(read + refused > 5 && refused > 0);
}

#[test]
fn odd_exr_files_are_read_or_refused_in_a_line() {
    odd_skies("exr");
}

#[test]
fn odd_hdr_files_are_read_or_refused_in_a_line() {
    odd_skies("hdr");
}
