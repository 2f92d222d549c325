use std::fs;

use crate::{ok, run, with_sample};

/// Returns the best adapter of this machine, software included; `None`, with a note, if there is
/// none.
pub(super) fn adapter() -> Option<String> {
    let report: serde_json::Value = serde_json::from_str(&ok("adapters --json", &[])).unwrap();
    let first = report["adapters"].as_array().unwrap().first();
    let Some(first) = first else {
        let required = std::env::var("AOGRID_GPU").as_deref() == Ok("require");
        assert!(!required, "there is no adapter");
        aogrid_tests::skip("no adapter (AOGRID_GPU)");
        return None;
    };
    // The first word of the name is enough.
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
    // The file does not record which device baked it.
    assert_eq!(fs::read(cpu).unwrap(), fs::read(gpu).unwrap());
}

#[test]
fn bench_has_rows_for_cpu_and_gpu() {
    let Some(adapter) = adapter() else { return };
    let line = format!(
        "bench {{}} --resolution 8 --face-size 8 --repeat 1 --algorithm sweep --adapter {adapter} --json"
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
        rows[0].contains("rays       ") && rows[1].contains("sweep      llvmpipe"),
        "{table}"
    );
    let wrong = run("bench {} --only cpu:magic", &[&model]);
    assert_eq!(wrong.status.code(), Some(2));
}

#[test]
fn a_missing_adapter_fails_and_an_adapter_for_the_cpu_is_wrong_usage() {
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

/// A scene with all kinds of occluders on a floor: rotated and scaled, one that excludes the floor,
/// one that casts on a layer without receivers; float grids, so that filters differ the least.
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

/// Tolerance of software adapters with float grids and a 32-bit target: a handful of roundings an
/// occluder, amplified by T_clip.
const SOFTWARE: f32 = 1e-4;

/// Tolerance of hardware, whose filters have weights of 8 bits, for a look-up and a clip of each of
/// three occluders: 3 axes of 1/256 in a, times T_clip's slope of 4 there, and as much again for
/// the axis.
const HARDWARE: f32 = 3.0 * 2.0 * 4.0 * 3.0 / 256.0;

/// Returns a channel of a picture.
fn channel(exr: &std::path::Path, name: &str) -> Vec<f32> {
    let image = exr::prelude::read_first_flat_layer_from_file(exr).unwrap();
    let channels = &image.layer_data.channel_data.list;
    let channel = channels.iter().find(|c| c.name.to_string() == name);
    let channel = channel.unwrap_or_else(|| panic!("no channel {name}"));
    channel.sample_data.values_as_f32().collect()
}

/// Returns the largest difference between two pictures in a channel.
fn worst(pictures: [&std::path::Path; 2], name: &str) -> f32 {
    let [first, second] = pictures.map(|exr| channel(exr, name));
    let differences = first.iter().zip(&second).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f32::max)
}

#[test]
fn raster_passes_render_the_same_pictures_as_their_cpu_twin() {
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
        let line = format!("render {{}} --mode {mode} -o {{}} --force");
        ok(&line, &[&scene, &cpu]);
        let line = format!("{line} --backend gpu --adapter {adapter}");
        ok(&line, &[&scene, &gpu]);
        let dark = channel(&cpu, "AO").into_iter().filter(|ao| *ao > 0.05);
        assert!(dark.count() > 100);
        let largest = worst([&cpu, &gpu], "AO");
        println!("{mode} {encoding}: {largest:.2e}");
        assert!(largest <= tolerance, "{mode} {encoding}: {largest}");
    }
}

/// Lights and materials for `OCCLUDERS`: the floor and the table have a glossy material each, boxes
/// are diffuse.
const LIGHT: &str = "ambient = [0.05, 0.1, 0.2]
[environment.room]
right = [0.1, 0.15, 0.9]
left = [0.9, 0.1, 0.08]
ceiling = [1.6, 1.6, 1.6]
floor = [0.5, 0.5, 0.5]
front = [0.7, 0.7, 0.7]
back = [0.7, 0.7, 0.7]
[[material]]
name = 'polished'
gloss = 12
albedo = [1, 1, 1]
[[material]]
name = 'brushed'
gloss = 40
albedo = [1, 1, 1]
";

/// Returns `scene` with [`LIGHT`], glossy materials and a line for the camera.
fn lit(scene: &str, camera: &str) -> String {
    let instance = |mesh: &str| format!("[[instance]]\nmesh = '{mesh}'");
    let of = |mesh: &str, material: &str| format!("{}\nmaterial = '{material}'", instance(mesh));
    let scene = scene
        .replace("ENCODING", "cone")
        .replace(&instance("floor"), &of("floor", "polished"))
        .replace(&instance("table"), &of("table", "brushed"))
        .replace("[camera]", &format!("[camera]\n{camera}"));
    let (ambient, rest) = LIGHT.split_once('\n').unwrap();
    format!("{ambient}\n{scene}\n{rest}")
}

#[test]
fn the_environment_pass_renders_the_same_light_as_its_cpu_twin() {
    let Some(adapter) = adapter() else { return };
    let tolerance = match adapter.starts_with("llvmpipe") {
        true => LIGHT_SOFTWARE,
        false => LIGHT_HARDWARE,
    };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let [scene, cpu, gpu] = ["scene.toml", "cpu.exr", "gpu.exr"].map(path);
    for camera in ["vertical_fov = 40", "height = 4"] {
        fs::write(&scene, lit(OCCLUDERS, camera)).unwrap();
        for mode in ["environment", "environment-merge"] {
            let line = format!("render {{}} --mode {mode} -o {{}} --force");
            ok(&line, &[&scene, &cpu]);
            let line = format!("{line} --backend gpu --adapter {adapter}");
            ok(&line, &[&scene, &gpu]);
            let dark = channel(&cpu, "AO").into_iter().filter(|ao| *ao > 0.05);
            assert!(dark.count() > 100);
            for name in ["AO", "R", "G", "B"] {
                let largest = worst([&cpu, &gpu], name);
                println!("{mode}, {camera}, {name}: {largest:.2e}");
                assert!(largest <= tolerance, "{mode}, {camera}, {name}: {largest}");
            }
        }
    }
}

/// Tolerance of light on software adapters: AO's tolerance, doubled since moments store the root of a,
/// times the radiance, at most 1.8, plus
/// the error of directions from Mesa's polynomial arc tangents, 1e-5, times the room's steepest
/// gradient: 1.5 within the 10° of its narrowest cones, 9 a radian.
const LIGHT_SOFTWARE: f32 = 2.0 * 1.8 * SOFTWARE + 9.0 * 1e-5;

/// Tolerance of light on hardware: the same with hardware's AO tolerance and the error that WGSL
/// allows arc tangents, 4096 units in the last place of π.
const LIGHT_HARDWARE: f32 = 2.0 * 1.8 * HARDWARE + 9.0 * 4096.0 * 2.4e-7;

#[test]
fn too_many_glossy_materials_for_a_stencil_are_an_error() {
    let Some(adapter) = adapter() else { return };
    let mut text = "ambient = [1, 1, 1]\n[camera]\nposition = [8, 9, 8]\ntarget = [8, 0, 7.9]\n\
                    height = 16\nresolution = [16, 16]\n\
                    [[mesh]]\nname = 'tile'\nrectangle = [1, 1]\n"
        .to_owned();
    for idx in 0..256 {
        let [x, z, gloss] = [idx % 16, idx / 16, 1 + idx / 3].map(|n| n as f32 + 0.5);
        let gloss = gloss + 0.1 * (idx % 3) as f32;
        text += &format!(
            "[[material]]\nname = '{idx}'\nalbedo = [1, 1, 1]\ngloss = {gloss}\n\
             [[instance]]\nmesh = 'tile'\nmaterial = '{idx}'\ntranslate = [{x}, 0, {z}]\n"
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let [scene, png] = ["scene.toml", "out.png"].map(|name| folder.path().join(name));
    fs::write(&scene, text).unwrap();
    let line = "render {} -o {} --mode environment";
    ok(line, &[&scene, &png]);
    fs::remove_file(&png).unwrap();
    let line = format!("{line} --backend gpu --adapter {adapter}");
    let error = crate::fails(&line, &[&scene, &png]);
    assert!(
        error.contains("scene.toml") && error.contains("use --backend cpu"),
        "{error}"
    );
    assert!(!png.exists());
}

#[test]
fn a_gpu_renders_pictures_by_grids_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let scene = path("scene.toml");
    fs::write(&scene, OCCLUDERS.replace("ENCODING", "cone")).unwrap();
    for (options, out, status, why) in [
        (
            "--mode cone --backend gpu",
            "a.csv",
            2,
            "leave out --backend gpu",
        ),
        ("--mode truth --backend gpu", "a.png", 2, "on the CPU"),
        (
            "--mode cone --backend gpu --adapter Voodoo",
            "a.png",
            1,
            "`Voodoo`",
        ),
    ] {
        let output = run(
            &format!("render {{}} -o {{}} {options}"),
            &[&scene, &path(out)],
        );
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{stderr}");
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
        // With up to 128 of its 1024 registers a wave, a SIMD unit holds half of its maximum of
        // waves.
        assert!(vgprs <= 128, "{row}");
        seen += 1;
    }
    assert!(seen >= 16, "{seen}");
}

#[test]
fn verify_bake_compares_the_sweeps_of_gpu_and_cpu_with_rays() {
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

#[test]
fn listing_adapters_prints_nothing_on_stderr() {
    // `.cargo/config.toml` turns off the Mesa layer that complains about a missing display.
    let output = crate::xtask(["adapters"])
        .env_remove("XDG_RUNTIME_DIR")
        .output()
        .unwrap();
    assert!(output.status.success());
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}
