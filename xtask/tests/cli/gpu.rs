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
    let line = format!(
        "bench {{}} --resolution 8 --face-size 8 --repeat 1 --only cpu:rays,gpu:sweep --adapter {adapter}"
    );
    let table = ok(&line, &[&model]);
    let rows: Vec<_> = table.lines().skip(1).collect();
    assert_eq!(rows.len(), 2, "{table}");
    assert!(
        rows[0].contains("rays    cpu") && rows[1].contains("sweep   "),
        "{table}"
    );
    let wrong = run("bench {} --only cpu:magic", &[&model]);
    assert_eq!(wrong.status.code(), Some(2));
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

/// Three occluders of all kinds on a floor: a turned and stretched one, one that leaves the floor
/// out, one on layers that nothing has; grids of floats, so that filters differ the least.
const OCCLUDERS: &str = "
[camera]
position = [2, 2.5, 4]
target = [0, 0.3, 0]
resolution = [61, 47]
[[mesh]]
name = 'floor'
rectangle = [6, 6]
[[mesh]]
name = 'box'
sample = 'box'
grid = { resolution = 12, format = 'f32' }
[[mesh]]
name = 'table'
sample = 'table'
grid = { resolution = 12, format = 'f32', encoding = 'ENCODING' }
[[instance]]
mesh = 'floor'
id = 7
[[instance]]
mesh = 'box'
translate = [-0.9, 0.02, 0.2]
scale = [1, 0.8, -0.7]
rotate = { axis = [0, 1, 0.2], degrees = 30 }
strength = 0.8
[[instance]]
mesh = 'table'
translate = [0.9, 0.01, 0]
[[instance]]
mesh = 'box'
translate = [0.2, 0, -1.2]
excludes = [7]
[[instance]]
mesh = 'box'
translate = [-1, 0.1, 1.7]
casts_on = [5]
";

/// On float grids and a 32-bit target: a handful of roundings an occluder, steepened by T_clip.
const SOFTWARE: f32 = 1e-4;

/// What 8 bits of a filter's weight may do to a look-up and a clip of each of three occluders:
/// 3 axes of 1/256 in a, by T_clip's slope of 4 there, and as much again for the axis.
const HARDWARE: f32 = 3.0 * 2.0 * 4.0 * 3.0 / 256.0;

/// AO of every pixel of a picture.
fn occlusions(exr: &std::path::Path) -> Vec<f32> {
    let image = exr::prelude::read_first_flat_layer_from_file(exr).unwrap();
    let channel = &image.layer_data.channel_data.list[0];
    assert_eq!(channel.name.to_string(), "AO");
    channel.sample_data.values_as_f32().collect()
}

#[test]
fn pictures_by_the_raster_pass_are_those_of_its_twin() {
    let Some(adapter) = adapter() else { return };
    let tolerance = match adapter.starts_with("llvmpipe") {
        true => SOFTWARE,
        false => HARDWARE,
    };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let [scene, cpu, gpu] = ["scene.toml", "cpu.exr", "gpu.exr"].map(path);
    for (mode, encoding) in [
        ("cone", "cone"),
        ("occlusion", "cone"),
        ("occlusion", "occlusion"),
        ("merge", "cone"),
    ] {
        fs::write(&scene, OCCLUDERS.replace("ENCODING", encoding)).unwrap();
        let line = format!("render {{}} --mode {mode} -o {{}}");
        ok(&line, &[&scene, &cpu]);
        let line = format!("{line} --backend gpu --adapter {adapter}");
        ok(&line, &[&scene, &gpu]);
        let [cpu, gpu] = [&cpu, &gpu].map(|exr| occlusions(exr));
        let dark = cpu.iter().filter(|ao| **ao > 0.05).count();
        assert!(dark > 100, "{dark}");
        let differences = cpu.iter().zip(&gpu).map(|(a, b)| (a - b).abs());
        let largest = differences.fold(0.0, f32::max);
        println!("{mode} {encoding}: {largest:.2e}");
        assert!(largest <= tolerance, "{mode} {encoding}: {largest}");
    }
}

#[test]
fn a_gpu_renders_pictures_by_grids_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let scene = path("scene.toml");
    fs::write(&scene, OCCLUDERS.replace("ENCODING", "cone")).unwrap();
    for (options, out, why) in [
        (
            "--mode cone --backend gpu",
            "a.csv",
            "leave out --backend gpu",
        ),
        ("--mode truth --backend gpu", "a.png", "on the CPU"),
        (
            "--mode cone --backend gpu --adapter Voodoo",
            "a.png",
            "`Voodoo`",
        ),
    ] {
        let output = run(
            &format!("render {{}} -o {{}} {options}"),
            &[&scene, &path(out)],
        );
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains(why), "{stderr}");
        assert!(!path(out).exists());
    }
    let line = "render {} -o {} --mode cone --adapter x";
    assert_eq!(run(line, &[&scene, &path("a.png")]).status.code(), Some(2));
    let Some(adapter) = adapter() else { return };
    let many = OCCLUDERS.replace("excludes = [7]", "excludes = [1, 2, 3, 4, 5]");
    fs::write(&scene, many.replace("ENCODING", "cone")).unwrap();
    let line = format!("render {{}} -o {{}} --mode cone --backend gpu --adapter {adapter}");
    let error = crate::fails(&line, &[&scene, &path("a.png")]);
    assert!(
        error.contains("at most 4") && error.contains("`box`"),
        "{error}"
    );
}

#[test]
fn no_kernel_of_a_bake_spills_to_memory() {
    let output = run("shader-cost", &[]);
    if !output.status.success() {
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        let demanded = std::env::var("AOGRID_GPU").is_ok_and(|v| v == "require");
        assert!(!demanded, "AOGRID_GPU=require, but: {error}");
        return aogrid_tests::skip(&error);
    }
    let table = String::from_utf8(output.stdout).unwrap();
    let mut seen = 0;
    for shader in aogrid_baker_gpu::shaders() {
        let row = table.lines().find(|line| {
            let rest = line.strip_prefix(shader.name);
            rest.is_some_and(|rest| rest.trim_start().starts_with(|c: char| c.is_ascii_digit()))
        });
        let row = row.unwrap_or_else(|| panic!("no {} in {table}", shader.name));
        let numbers: Vec<u64> = row[shader.name.len()..]
            .split_whitespace()
            .map(|word| word.parse().unwrap())
            .collect();
        let [_, vgprs, scratch, ..] = numbers[..] else {
            panic!("{row}");
        };
        assert_eq!(scratch, 0, "{row}");
        // Half of the waves that a SIMD can hold, of 1024 registers.
        assert!(vgprs <= 128, "{row}");
        seen += 1;
    }
    assert!(seen >= 16, "{seen}");
}

#[test]
fn the_sweep_of_a_gpu_is_compared_with_rays() {
    let Some(adapter) = adapter() else { return };
    let (_folder, model) = with_sample("table");
    let line = format!("verify-bake {{}} --resolution 9 --face-size 8 --adapter {adapter}");
    for line in [&line[..], "verify-bake {} --resolution 9 --face-size 8"] {
        let found = ok(line, &[&model]);
        assert!(found.contains("of 279936 texels differ; 1 may"), "{found}");
    }
    let missing = run("verify-bake {} --adapter Voodoo", &[&model]);
    assert_eq!(missing.status.code(), Some(1));
}

/// Where there is no display, nobody needs to hear of it.
#[test]
fn looking_for_adapters_says_nothing_else() {
    let output = crate::xtask(["adapters"])
        .env_remove("XDG_RUNTIME_DIR")
        .output()
        .unwrap();
    assert!(output.status.success());
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}
