use std::fs;
use std::path::Path;

use super::{fails, run, with_sample};

#[test]
fn wrong_usage_is_exit_status_2() {
    let (folder, model) = with_sample("box");
    let out = folder.path().join("a.ao.ktx2");
    for wrong in [
        "",
        "--resolution 7",
        "--resolution 32x32",
        "--face-size 4",
        "--epsilon 0",
        "--epsilon 1.5",
        "--epsilon 0.1 --half-extents 1,1,1",
        "--half-extents 1,2",
        "--half-extents -1,2,3",
        "--resolution -8",
        "--rays 3",
        "--seed 3",
        "--sampling monte-carlo --face-size 8",
        "--sampling monte-carlo --rays 0",
        "--sample-offset 1,0,0",
        "--max-distance -1",
        "--threads 0",
        "--format r8",
        "--nonsense",
    ] {
        let line = match wrong {
            "" => "bake {}".to_owned(),
            wrong => format!("bake {{}} -o {{}} {wrong}"),
        };
        let output = match wrong {
            "" => run(&line, &[&model]),
            _ => run(&line, &[&model, &out]),
        };
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        assert!(!output.stderr.is_empty() && !out.exists(), "{wrong}");
    }
}

#[test]
fn invalid_models_are_named_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.ao.ktx2");
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let empty = folder.path().join("folder");
    fs::create_dir(&empty).unwrap();
    for (path, why) in [
        (folder.path().join("missing.obj"), "No such file"),
        (folder.path().join("missing folder/a.obj"), "No such file"),
        (empty, "no models"),
        (file("model.fbx", ""), "format is not known"),
        (file("page.obj", "<!DOCTYPE html>"), "web page"),
        (
            file("pointer.glb", "version https://git-lfs.github.com/spec/v1"),
            "git lfs pull",
        ),
        (file("empty.obj", ""), "no triangles"),
        (
            file("nan.obj", &format!("{corners}v nan 0 0\nf 1 2 4")),
            "line 4",
        ),
        (file("index.obj", &format!("{corners}f 1 2 9")), "line 4"),
        (file("point.obj", "v 1 1 1\nf 1 1 1"), "no area"),
        (
            file("huge.obj", "v 3e38 0 0\nv -3e38 0 0\nv 0 3e38 0\nf 1 2 3"),
            "box",
        ),
    ] {
        let error = fails("bake {} -o {}", &[&path, &out]);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(error.contains(&name) && error.contains(why), "{error}");
        assert!(!out.exists());
    }
}

#[test]
fn invalid_outputs_are_refused_before_the_work() {
    let (folder, model) = with_sample("box");
    let path = |name: &str| folder.path().join(name);
    let ending = fails("bake {} -o {}", &[&model, &model]);
    assert!(ending.contains(".ao.ktx2"), "{ending}");
    fs::create_dir(path("folder")).unwrap();
    let is_folder = fails("bake {} -o {}", &[&model, &path("folder")]);
    assert!(is_folder.contains("it is a folder"), "{is_folder}");
    fs::create_dir(path("folder.ktx2")).unwrap();
    let is_folder = fails("bake {} -o {}", &[&model, &path("folder.ktx2")]);
    assert!(is_folder.contains("it is a folder"), "{is_folder}");
    let no_folder = fails("bake {} -o {}", &[&model, &path("none/a.ao.ktx2")]);
    assert!(no_folder.contains("does not exist"), "{no_folder}");
    fs::write(path("file"), "").unwrap();
    let is_file = fails("bake {} -o {} --parts", &[&model, &path("file")]);
    assert!(is_file.contains("it is a file"), "{is_file}");
    fs::create_dir(path("other")).unwrap();
    fs::copy(&model, path("other/box.obj")).unwrap();
    let other = path("other/box.obj");
    let twice = fails("bake {} {} -o {}", &[&model, &model, &path("folder")]);
    assert!(twice.contains("named twice"), "{twice}");
    let slash = fails("sample box -o {}", &[&path("new.obj/")]);
    assert!(slash.contains("not a file's name"), "{slash}");
    let clash = fails("bake {} {} -o {}", &[&model, &other, &path("folder")]);
    assert!(clash.contains("into the same file"), "{clash}");
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_neither_read_nor_replaced() {
    use std::os::unix::fs::FileTypeExt;
    let (folder, model) = with_sample("box");
    let pipe = folder.path().join("pipe.ao.ktx2");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let error = fails("bake {} -o {} --resolution 8", &[&model, &pipe]);
    assert!(error.contains("not a regular file"), "{error}");
    let error = fails("info {}", &[&pipe]);
    assert!(error.contains("not a regular file"), "{error}");
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    // A link stays a link; the file that it points to is replaced.
    let (real, link) = (
        folder.path().join("real.ao.ktx2"),
        folder.path().join("link.ao.ktx2"),
    );
    super::ok("bake {} -o {} --resolution 8", &[&model, &real]);
    std::os::unix::fs::symlink(&real, &link).unwrap();
    super::ok("bake {} -o {} --resolution 9", &[&model, &link]);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(super::ok("info {}", &[&real]).contains("9×9×9"));
}

#[test]
fn a_command_does_not_overwrite_its_input() {
    let (folder, model) = with_sample("box");
    let grid = folder.path().join("box.ao.ktx2");
    super::ok("bake {} -o {} --resolution 8", &[&model, &grid]);
    for line in ["slices {} -o {}", "export {} --to npy -o {}"] {
        let error = fails(line, &[&grid, &grid]);
        assert!(error.contains("it is the input"), "{error}");
    }
    let error = fails("slices {} --mesh {} -o {}", &[&grid, &model, &model]);
    assert!(error.contains("it is the input"), "{error}");
    super::ok("verify {}", &[&grid]);
}

#[test]
fn names_cannot_break_lines_or_color_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("a.obj");
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    fs::write(&model, format!("{corners}o \x1b[31mred\nf 1 2 3\n")).unwrap();
    let out = folder.path().join("out");
    let output = run("bake {} -o {} --parts --resolution 8", &[&model, &out]);
    assert!(output.status.success());
    assert!(!output.stderr.contains(&0x1b) && !output.stderr.is_empty());
    let error = fails("info {}", &[&folder.path().join("a\nb.ao.ktx2")]);
    assert!(error.contains("a\u{FFFD}b"), "{error}");
}

#[test]
fn every_command_names_a_file_it_cannot_read() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.ao.ktx2");
    let out = folder.path().join("out");
    fs::write(&broken, "not a texture").unwrap();
    let missing = Path::new("missing.ao.ktx2");
    for path in [&*broken, missing] {
        let lines = [
            "info {}",
            "diff {} {}",
            "slices {} -o {}",
            "export {} --to npy -o {}",
        ];
        for line in lines {
            let second = if line.starts_with("diff") { path } else { &out };
            let error = match line {
                "info {}" => fails(line, &[path]),
                _ => fails(line, &[path, second]),
            };
            assert!(
                error.contains(&*path.file_name().unwrap().to_string_lossy()),
                "{error}"
            );
        }
    }
    assert!(!out.exists());
}

#[cfg(unix)]
#[test]
fn a_file_without_permission_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let (folder, model) = with_sample("box");
    fs::set_permissions(&model, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::read(&model).is_ok() {
        return aogrid_tests::skip("this user may read everything");
    }
    let error = fails("bake {} -o {}", &[&model, &folder.path().join("a.ao.ktx2")]);
    assert!(
        error.contains("box.obj") && error.contains("denied"),
        "{error}"
    );
}
