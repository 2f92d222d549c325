use std::fs;

use crate::{ok, run, with_sample};

/// The best adapter of this machine, software included; none, with a note, where there is none.
fn adapter() -> Option<String> {
    let report: serde_json::Value = serde_json::from_str(&ok("adapters --json", &[])).unwrap();
    let first = report["adapters"].as_array().unwrap().first();
    let Some(first) = first else {
        let required = std::env::var("AOGRID_GPU").as_deref() == Ok("require");
        assert!(!required, "there is no adapter");
        aogrid_tests::skip("no adapter (AOGRID_GPU)");
        return None;
    };
    // A word of the name is enough.
    let name = first["name"].as_str().unwrap();
    Some(name.split_whitespace().next().unwrap().to_owned())
}

#[test]
fn the_gpu_writes_the_same_file_and_the_report_names_it() {
    let Some(adapter) = adapter() else { return };
    let (folder, model) = with_sample("table");
    let [cpu, gpu] = ["cpu.ao.ktx2", "gpu.ao.ktx2"].map(|name| folder.path().join(name));
    ok(
        "bake {} -o {} --resolution 9 --backend cpu",
        &[&model, &cpu],
    );
    let line = format!("bake {{}} -o {{}} --resolution 9 --backend gpu --adapter {adapter} --json");
    let report: serde_json::Value = serde_json::from_str(&ok(&line, &[&model, &gpu])).unwrap();
    let kernel = &report["outputs"][0]["kernel"];
    assert_eq!(
        (&kernel["backend"], &kernel["name"]),
        (&"gpu".into(), &"sweep".into())
    );
    assert!(kernel["adapter"].as_str().unwrap().contains(&adapter));
    // Nor do the bytes say where they come from.
    assert_eq!(fs::read(cpu).unwrap(), fs::read(gpu).unwrap());
}

#[test]
fn bench_has_rows_for_both() {
    let Some(adapter) = adapter() else { return };
    let line = format!(
        "bench {{}} --resolution 8 --face-size 8 --repeat 1 --kernel sweep --adapter {adapter} --json"
    );
    let (_folder, model) = with_sample("table");
    let report: serde_json::Value = serde_json::from_str(&ok(&line, &[&model])).unwrap();
    let rows = report["models"][0]["rows"].as_array().unwrap();
    let backends: Vec<_> = rows
        .iter()
        .map(|r| r["backend"].as_str().unwrap())
        .collect();
    assert_eq!(backends, ["cpu", "gpu"]);
    assert!(rows[1]["adapter"].as_str().unwrap().contains(&adapter));
}

#[test]
fn an_adapter_that_is_not_there_fails_and_one_for_the_cpu_is_wrong_usage() {
    let (folder, model) = with_sample("table");
    let out = folder.path().join("x.ao.ktx2");
    let missing = run(
        "bake {} -o {} --resolution 8 --adapter Voodoo",
        &[&model, &out],
    );
    let stderr = String::from_utf8_lossy(&missing.stderr);
    assert_eq!(missing.status.code(), Some(1));
    assert!(
        stderr.contains("no adapter is named like `Voodoo`"),
        "{stderr}"
    );
    assert!(!out.exists());
    let line = "bake {} -o {} --backend cpu --adapter x";
    assert_eq!(run(line, &[&model, &out]).status.code(), Some(2));
}
