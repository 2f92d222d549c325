//! Answers of cargo about this workspace.

use std::process::Command;

use serde_json::Value;

/// Returns the standard output of cargo with `args`.
pub(crate) fn output(args: &[&str]) -> String {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo).args(args).output().expect("cargo runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo {args:?}: {errors}");
    String::from_utf8(output.stdout).expect("cargo writes UTF-8")
}

/// Returns the packages of the workspace as `cargo metadata` describes them.
pub(crate) fn packages() -> Vec<Value> {
    let json = output(&["metadata", "--no-deps", "--format-version", "1"]);
    let mut metadata: Value = serde_json::from_str(&json).expect("it is JSON");
    match metadata["packages"].take() {
        Value::Array(packages) => packages,
        other => panic!("packages are no list but {other}"),
    }
}

/// Returns the string under `key`.
pub(crate) fn text(value: &Value, key: &str) -> String {
    value[key].as_str().expect(key).to_owned()
}
