//! Signals, interrupts and limits, on Unix only.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::{ok, one_line_error, with_sample, words, xtask};

/// Starts a bake that takes many seconds, and waits until it is under way.
fn long_bake(model: &Path, out: &Path) -> Child {
    long_run(
        "bake {} -o {} --resolution 96 --face-size 64",
        &[model, out],
    )
}

/// Starts a command that takes many seconds, and waits until it is under way.
fn long_run(line: &str, paths: &[&Path]) -> Child {
    let mut command = xtask(words(line, paths));
    let child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    sleep(Duration::from_millis(500));
    let mut child = child.unwrap();
    assert!(
        child.try_wait().unwrap().is_none(),
        "the command was too short"
    );
    child
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill")
        .args([name, &child.id().to_string()])
        .status();
    assert!(status.unwrap().success());
}

#[test]
fn a_killed_bake_leaves_the_old_file_whole() {
    let (folder, model) = with_sample("table");
    let out = folder.path().join("table.ao.ktx2");
    ok("bake {} -o {} --resolution 8", &[&model, &out]);
    let before = fs::read(&out).unwrap();
    let mut child = long_bake(&model, &out);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(fs::read(&out).unwrap(), before);
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        2,
        "a file is left over"
    );
}

#[test]
fn an_interrupt_ends_a_bake_within_a_second() {
    let (folder, model) = with_sample("table");
    let out = folder.path().join("table.ao.ktx2");
    for name in ["-INT", "-TERM"] {
        let child = long_bake(&model, &out);
        signal(&child, name);
        let start = Instant::now();
        let output = child.wait_with_output().unwrap();
        // One second is promised; allow twice as much on a loaded machine.
        assert!(
            start.elapsed() < Duration::from_secs(2),
            "{:?}",
            start.elapsed()
        );
        let error = one_line_error(&output, name);
        assert!(
            error.contains("cancelled") || error.contains("interrupted"),
            "{error}"
        );
        assert!(!out.exists());
    }
}

#[test]
fn an_interrupt_ends_a_rendering_within_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let text = "[camera]\nposition = [0, 3, 0.1]\ntarget = [0, 0, 0]\n\
                [[mesh]]\nname = 'a'\nsample = 'robot'\n[[instance]]\nmesh = 'a'\n";
    fs::write(&scene, text).unwrap();
    let out = folder.path().join("a.png");
    let line = "render {} --mode truth --samples 20000 -o {}";
    let child = long_run(line, &[&scene, &out]);
    signal(&child, "-INT");
    let start = Instant::now();
    let output = child.wait_with_output().unwrap();
    // The same limit as for a bake.
    assert!(start.elapsed() < Duration::from_secs(2));
    let error = one_line_error(&output, "-INT");
    assert!(error.contains("cancelled"), "{error}");
    assert!(!out.exists());
}

#[test]
fn a_full_disk_is_one_line_and_leaves_the_old_file_whole() {
    let (folder, model) = with_sample("box");
    let out = folder.path().join("box.ao.ktx2");
    ok("bake {} -o {} --resolution 8", &[&model, &out]);
    let before = fs::read(&out).unwrap();
    // No file may grow beyond 8 blocks of 512 bytes; the signal for it is ignored, so that
    // writing fails as it does on a full disk.
    let script = "trap '' XFSZ; ulimit -f 8; exec \"$0\" bake \"$1\" -o \"$2\" --resolution 32 --face-size 8";
    let output = Command::new("sh")
        .env("XDG_RUNTIME_DIR", std::env::temp_dir())
        .args(["-c", script, env!("CARGO_BIN_EXE_xtask")])
        .args([&model, &out])
        .output()
        .unwrap();
    let error = one_line_error(&output, "full disk");
    assert!(
        error.contains("box.ao.ktx2") && error.contains("cannot write"),
        "{error}"
    );
    assert_eq!(fs::read(&out).unwrap(), before);
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        2,
        "a file is left over"
    );
}

#[test]
fn a_closed_pipe_is_no_panic() {
    let (folder, model) = with_sample("box");
    let out = folder.path().join("box.ao.ktx2");
    ok("bake {} -o {} --resolution 8", &[&model, &out]);
    let script = "\"$0\" info \"$1\" | true";
    let output = Command::new("sh")
        .env("XDG_RUNTIME_DIR", std::env::temp_dir())
        .args(["-c", script, env!("CARGO_BIN_EXE_xtask")])
        .arg(&out)
        .output()
        .unwrap();
    assert!(
        output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
