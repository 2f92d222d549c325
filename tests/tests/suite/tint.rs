//! Compiles every shader with a second front end: Tint, which compiles WGSL in Chromium and Dawn,
//! by way of npm's `webgpu` and its null backend. It rejects what browsers reject.

use std::io::Write;
use std::process::{Command, Stdio};

use aogrid_runtime::wgsl;
use serde_json::{Value, json};

use crate::node::node;

/// Returns the messages of Tint and Dawn for each shader, empty if it is valid. With an entry
/// point, a compute pipeline is made, too, within WebGPU's default limits.
fn messages(shaders: &[Value]) -> Option<Vec<(String, String)>> {
    let mut tint = Command::new("node")
        .arg("tint.mjs")
        .current_dir(node()?)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let input = serde_json::to_vec(shaders).unwrap();
    tint.stdin.take().unwrap().write_all(&input).unwrap();
    let output = tint.wait_with_output().unwrap();
    assert!(output.status.success());
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn every_shader_is_valid() {
    let mut shaders: Vec<Value> = aogrid_baker_gpu::shaders()
        .iter()
        .map(|s| json!({ "name": s.name, "code": s.source, "entryPoint": s.entry_point }))
        .collect();
    let of_runtime = [
        ("shading", wgsl::SHADING.to_owned()),
        ("occlusion pass", wgsl::OCCLUSION_PASS.to_owned()),
        ("merge pass", wgsl::MERGE_PASS.to_owned()),
        ("tiled pass", wgsl::tiled_pass("r32float")),
        ("environment pass", wgsl::ENVIRONMENT_PASS.to_owned()),
        (
            "surface",
            [wgsl::SHADING, wgsl::ENVIRONMENT, wgsl::SURFACE].concat(),
        ),
        (
            "tile lists",
            wgsl::SHADING.to_owned() + &wgsl::tile_lists(0),
        ),
    ];
    shaders.extend(of_runtime.map(|(name, code)| json!({ "name": name, "code": code })));
    let Some(messages) = messages(&shaders) else {
        return;
    };
    assert_eq!(messages.len(), shaders.len());
    let wrong: Vec<_> = messages.iter().filter(|(_, m)| !m.is_empty()).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Shaders that naga accepts and browsers reject.
#[test]
fn shaders_that_browsers_reject_are_rejected() {
    let barrier = "@compute @workgroup_size(64)
        fn f(@builtin(local_invocation_index) i: u32) { if i > 3u { workgroupBarrier(); } }";
    let memory = "var<workgroup> much: array<u32, 8192>;
        @compute @workgroup_size(1) fn f() { much[0] = 1u; }";
    let precedence = "@compute @workgroup_size(1) fn f() { let x = 1u & 2u | 4u; }";
    let nonsense = "fn f( {";
    let shaders: Vec<Value> = [barrier, memory, precedence, nonsense]
        .iter()
        .map(|code| json!({ "name": code, "code": code, "entryPoint": "f" }))
        .collect();
    let Some(messages) = messages(&shaders) else {
        return;
    };
    assert_eq!(messages.len(), shaders.len());
    for (name, message) in messages {
        assert_ne!(message, "", "{name}");
    }
}
