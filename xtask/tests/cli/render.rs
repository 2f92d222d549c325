use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

use super::{fails, misused, ok, run};

/// Returns a folder with a small scene in it: a box on a floor, with a camera and receivers.
fn with_scene(more: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let text = format!(
        "[camera]\nposition = [2, 2, 3]\ntarget = [0, 0.3, 0]\nresolution = [24, 16]\n\
         [receivers]\ncorner = [0.6, 0.001, 0]\nu = [0, 0, 1]\nv = [1, 0, 0]\ncount = [3, 2]\n\
         [[mesh]]\nname = 'floor'\nrectangle = [5, 5]\n[[mesh]]\nname = 'box'\nsample = 'box'\n\
         [[instance]]\nmesh = 'floor'\n[[instance]]\nmesh = 'box'\n{more}"
    );
    fs::write(&path, text).unwrap();
    (folder, path)
}

const LIT: &str = "[environment]\ncolor = [0.5, 1, 2]\n";

/// Returns the names of an EXR file's channels.
fn channels(path: &PathBuf) -> Vec<String> {
    let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
    let channels = image.layer_data.channel_data.list;
    channels.iter().map(|c| c.name.to_string()).collect()
}

#[test]
fn truth_is_written_as_picture_table_or_named_channels() {
    for (more, exr_channels, columns) in [
        ("", "AO AO.stderr", "truth truth.stderr"),
        (
            LIT,
            "AO AO.stderr B B.stderr G G.stderr R R.stderr",
            "truth truth.stderr truth.R truth.R.stderr truth.G truth.G.stderr truth.B truth.B.stderr",
        ),
    ] {
        let (folder, scene) = with_scene(more);
        let out = |name: &str| folder.path().join(name);
        let (png, exr, csv) = (out("a.png"), out("a.exr"), out("a.csv"));
        for out in [&png, &exr, &csv] {
            ok("render {} --mode truth --samples 32 -o {}", &[&scene, out]);
        }
        let image = image::open(&png).unwrap().to_rgb8();
        assert_eq!(image.dimensions(), (24, 16));
        let distinct: std::collections::HashSet<_> = image.pixels().collect();
        assert!(distinct.len() > 10, "{}", distinct.len());
        assert_eq!(channels(&exr).join(" "), exr_channels);
        let table = fs::read_to_string(&csv).unwrap();
        let mut lines = table.lines();
        let header = format!("px,py,pz,nx,ny,nz,{}", columns.replace(' ', ","));
        assert_eq!(lines.next(), Some(header.as_str()));
        assert_eq!(lines.clone().count(), 6);
        // The first receiver, beside the middle of the box, has an AO between 0.1 and 0.5.
        let first: Vec<f64> = lines
            .next()
            .unwrap()
            .split(',')
            .map(|v| v.parse().unwrap())
            .collect();
        assert_eq!(first[..3], [0.85, 0.001, 0.166_666_666_666_666_66]);
        assert!((0.1..0.5).contains(&first[6]), "{}", first[6]);
        if more == LIT {
            // The light of a constant sky is reduced by exactly the AO.
            assert!((first[8] - 0.5 * (1.0 - first[6])).abs() < 1e-5);
        }
    }
}

#[test]
fn a_lists_own_columns_are_kept_and_not_shadowed() {
    let folder = tempfile::tempdir().unwrap();
    let [scene, out] = ["scene.toml", "out.csv"].map(|name| folder.path().join(name));
    fs::write(&scene, "[receivers]\ncsv = 'list.csv'\nlift = 0.5\n").unwrap();
    let list = "name,nx,ny,nz,px,py,pz,truth\n\"a, b\",0,2,0,1,2,3,0.25\n";
    fs::write(folder.path().join("list.csv"), list).unwrap();
    ok("render {} --mode truth --samples 2 -o {}", &[&scene, &out]);
    let expected = "name,nx,ny,nz,px,py,pz,truth,rendered.truth,truth.stderr\n\
                    \"a, b\",0,2,0,1,2,3,0.25,0,0\n";
    assert_eq!(fs::read_to_string(&out).unwrap(), expected);
}

#[test]
fn the_g_buffer_is_written_to_its_own_file() {
    let (folder, scene) = with_scene("id = 9\n");
    let (png, dump) = (folder.path().join("a.png"), folder.path().join("g.exr"));
    let line = "render {} --mode truth --samples 2 -o {} --gbuffer {}";
    ok(line, &[&scene, &png, &dump]);
    assert_eq!(channels(&dump).join(" "), "N.X N.Y N.Z P.X P.Y P.Z id");
    let image = exr::prelude::read_first_flat_layer_from_file(&dump).unwrap();
    let id = &image.layer_data.channel_data.list[6];
    let values: std::collections::BTreeSet<_> =
        id.sample_data.values_as_f32().map(|v| v as u32).collect();
    assert_eq!(values.into_iter().collect::<Vec<_>>(), [0, 1, 9]);
    let error = fails(line, &[&scene, &png, &png]);
    assert!(error.contains("a.png"), "{error}");
}

#[test]
fn renders_are_deterministic_and_depend_on_the_options() {
    let (folder, scene) = with_scene("");
    let render = |options: &str| {
        let out = folder.path().join("a.exr");
        ok(
            &format!("render {{}} --mode truth --samples 32 --force -o {{}} {options}"),
            &[&scene, &out],
        );
        fs::read(out).unwrap()
    };
    assert_eq!(render("--threads 1"), render("--threads 3"));
    assert_ne!(render("--seed 1"), render("--seed 2"));
    assert_ne!(render("--max-distance 0.1"), render(""));
    assert_ne!(render("--occluders 0"), render(""));
}

#[test]
fn invalid_outputs_are_refused() {
    let (folder, scene) = with_scene("");
    let out = |name: &str| folder.path().join(name);
    for (name, options, why) in [
        ("a.jpg", "", ".png or .exr"),
        ("a", "", ".csv"),
        ("a.png", "--mode truth", "twice"),
        ("a.csv", "--gbuffer g.exr", "--gbuffer"),
        ("scene.toml", "", ".png"),
    ] {
        let line = format!("render {{}} --mode truth -o {{}} {options}");
        let error = misused(&line, &[&scene, &out(name)]);
        assert!(error.contains(why), "{error}");
    }
    let line = "render {} --mode truth -o {}";
    let error = fails(line, &[&scene, &out("none/a.png")]);
    assert!(error.contains("does not exist"), "{error}");
    for wrong in [
        "--mode nonsense",
        "",
        "--mode truth --samples 1",
        "--mode truth --max-distance 0",
    ] {
        let output = run(
            &format!("render {{}} -o {{}} {wrong}"),
            &[&scene, &out("a.png")],
        );
        assert_eq!(output.status.code(), Some(2), "{wrong}");
    }
}

#[test]
fn an_instance_is_flattened_with_its_scale() {
    let (folder, scene) = with_scene("scale = [1, 0.5, -2]\nname = 'slab'\n");
    let dump = folder.path().join("g.exr");
    let line = "render {} --mode truth --samples 2 -o {} --gbuffer {}";
    ok(line, &[&scene, &folder.path().join("a.png"), &dump]);
    let image = exr::prelude::read_first_flat_layer_from_file(&dump).unwrap();
    let list = &image.layer_data.channel_data.list;
    let of = |name: usize| list[name].sample_data.values_as_f32();
    let highest = of(4).fold(0.0, f32::max);
    assert!((highest - 0.5).abs() < 1e-6, "{highest}");
}

#[test]
fn several_modes_are_labeled_and_pixels_without_a_surface_are_told_from_lit_ones() {
    let (folder, scene) = with_scene("");
    let picture = |modes: &str| {
        let png = folder.path().join(format!("{modes}.png"));
        let line = format!("render {{}} --mode {modes} --samples 32 -o {{}}");
        ok(&line, &[&scene, &png]);
        image::open(&png).unwrap().to_rgb8()
    };
    let (one, two) = (picture("cone"), picture("truth,cone"));
    assert_eq!(one.dimensions(), (24, 16));
    // Two pictures with a gap, under a line of text.
    assert_eq!(two.width(), 2 * 24 + 8);
    let top = two.height() - 16;
    assert!(top > 10, "{top}");
    let below = image::imageops::crop_imm(&two, 24 + 8, top, 24, 16).to_image();
    assert_eq!(below, one);
    let is_gray = |p: &image::Rgb<u8>| p.0[0] == p.0[1] && p.0[1] == p.0[2];
    let sky = one.pixels().filter(|p| !is_gray(p)).count();
    let gbuffer = folder.path().join("g.exr");
    let (line, png) = (
        "render {} --mode cone --gbuffer {} -o {}",
        folder.path().join("again.png"),
    );
    ok(line, &[&scene, &gbuffer, &png]);
    let ids = exr::prelude::read_first_flat_layer_from_file(&gbuffer).unwrap();
    let mut ids = ids.layer_data.channel_data.list.iter();
    let ids = ids.find(|channel| channel.name.eq("id")).unwrap();
    let without = ids
        .sample_data
        .values_as_f32()
        .filter(|id| *id == 0.0)
        .count();
    assert_eq!(sky, without);
}

#[test]
fn exposure_is_a_factor_for_light_in_pictures() {
    let (folder, scene) = with_scene(LIT);
    let mean = |options: &str| {
        let png = folder.path().join(format!("{}.png", options.len()));
        let line = format!("render {{}} --mode truth --samples 32 {options} -o {{}} --force");
        ok(&line, &[&scene, &png]);
        let picture = image::open(&png).unwrap().to_rgb8();
        picture.pixels().map(|p| f64::from(p.0[1])).sum::<f64>()
    };
    assert!(mean("--exposure 0.25") < 0.8 * mean(""));
    let line = "render {} --mode truth --exposure 2 -o {}";
    let exr = run(line, &[&scene, &folder.path().join("a.exr")]);
    assert_eq!(exr.status.code(), Some(2));
    let (folder, unlit) = with_scene("");
    let refused = fails(line, &[&unlit, &folder.path().join("a.png")]);
    assert!(refused.contains("lit scene"), "{refused}");
}
