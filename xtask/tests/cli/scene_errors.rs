use std::fs;

use tempfile::TempDir;

use super::fails;

/// A scene with an error, and parts of the message: the place behind `scene.toml`, or the file; the
/// key; the reason.
type Row = (&'static str, &'static str, &'static str, &'static str);

const INVALID_SCENES: &[Row] = &[
    ("up = 'x'", ":1:", "up", "`x`"),
    ("\nup = ", ":2:", "", ""),
    (
        "[camera]\nposition = [0, 0]\ntarget = [0, 0, 0]",
        ":2:",
        "camera.position",
        "length",
    ),
    (
        "[camera]\nposition = [0, 0, 'a']\ntarget = [0, 0, 0]",
        ":2:",
        "camera.position[2]",
        "string",
    ),
    (
        "[camera]\nposition = [0, 0, nan]\ntarget = [0, 0, 0]",
        ":2:",
        "camera.position[2]",
        "usable",
    ),
    (
        "[camera]\nposition = [0, 0, 1]\n",
        ":1:",
        "camera",
        "`target`",
    ),
    (
        "[camera]\nposition = [0, 0, 1]\ntarget = [0, 0, 1]",
        ":1:",
        "camera.target",
        "direction",
    ),
    (
        "[camera]\nposition = [0, 0, 1]\ntarget = [0, 0, 0]\nheight = -1",
        ":4:",
        "camera.height",
        "above zero",
    ),
    (
        "[camera]\nposition = [0, 0, 1]\ntarget = [0, 0, 0]\nresolution = [9999, 2]",
        ":4:",
        "camera.resolution[0]",
        "1..=4096",
    ),
    (
        "[picture]\ncolor = 1",
        ":2:",
        "picture.color",
        "unknown field",
    ),
    ("[[mesh]]\nname = 'a'\n", ":1:", "mesh", "exactly one"),
    (
        "[[mesh]]\nname = 'a'\nsample = 'cow'\n",
        ":3:",
        "mesh.sample",
        "space-ship",
    ),
    (
        "[[mesh]]\nname = 'a'\nfile = 'none.obj'\n",
        ":1:",
        "mesh.file",
        "No such file",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\npart = 'lid'\n",
        ":4:",
        "mesh.part",
        "there are: box",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\ntriangles = 3\n",
        ":3:",
        "mesh.triangles",
        "12",
    ),
    (
        "[[mesh]]\nname = 'a'\nrectangle = [1, 1]\ntriangles = 3\n",
        ":1:",
        "mesh.triangles",
        "sample",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n\ngrid = {resolution = 7}\n",
        ":5:",
        "mesh[0].grid.resolution",
        "8..=2048",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\ngrid = {encoding = 'sh9'}\n",
        ":4:",
        "mesh[0].grid.encoding",
        "unknown variant `sh9`, expected one of `moment`, `cone`, `occlusion`",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\ngrid = {format = 'bc4'}\n",
        ":4:",
        "mesh[0].grid.format",
        "expected one of `unorm8`, `f16`, `f32`",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\ngrid = {seed = 7}\n",
        ":4:",
        "mesh.grid",
        "`rays`",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\ngrid = {file = 'a', epsilon = 1}\n",
        ":4:",
        "mesh.grid",
        "nothing to bake",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\ngrid = {sample_offset = [0, 0, 1]}\n",
        ":4:",
        "mesh.grid",
        "offset",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[mesh]]\nname = 'a'\nsample = 'box'\n",
        ":5:",
        "mesh.name",
        "already",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[instance]]\nmesh = 'b'\n",
        ":5:",
        "instance.mesh",
        "no mesh `b`",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[instance]]\nmesh = 'a'\nscale = [1, 0, 1]",
        ":6:",
        "instance.scale",
        "zero",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[instance]]\nmesh = 'a'\nscale = true",
        ":6:",
        "instance[0].scale",
        "one number, or three",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[instance]]\nmesh = 'a'\nstrength = -1",
        ":6:",
        "instance[0].strength",
        "below zero",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[instance]]\nmesh = 'a'\nlayers = [32]",
        ":6:",
        "instance[0].layers[0]",
        "0..=31",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[instance]]\nmesh = 'a'\nmaterial = 'gold'",
        ":6:",
        "instance.material",
        "gold",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[instance]]\nmesh = 'a'\nid = 2\n[[instance]]\nmesh = 'a'",
        ":7:",
        "instance.id",
        "both have 2",
    ),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[[instance]]\nmesh = 'a'\nrotate = {axis = [0, 0, 0], degrees = 3}",
        ":6:",
        "instance.rotate",
        "axis",
    ),
    (
        "[receivers]\ncsv = 'list.csv'",
        "list.csv:3",
        "nx, ny, nz",
        "direction",
    ),
    (
        "[receivers]\ncsv = 'short.csv'",
        "short.csv",
        "nx",
        "no column",
    ),
    (
        "[receivers]\ncsv = 'none.csv'",
        "none.csv",
        "",
        "No such file",
    ),
    (
        "[receivers]\ncorner = [0, 0, 0]",
        ":1:",
        "receivers",
        "`count`",
    ),
    (
        "[receivers]\ncorner = [0, 0, 0]\nu = [1, 0, 0]\nv = [2, 0, 0]\ncount = [1, 1]",
        ":1:",
        "receivers.u",
        "rectangle",
    ),
    (
        "[area_light]\ncenter = [0, 0, 0]\nhalf_u = [1, 0, 0]\nhalf_v = [1, 1, 0]\nradiance = [1, 1, 1]",
        ":1:",
        "area_light",
        "right angles",
    ),
    (
        "[environment]\nfile = 'a'\ncolor = [1, 1, 1]",
        ":1:",
        "environment",
        "exactly one",
    ),
    (
        "[environment]\ncolor = [1, -1, 1]",
        ":2:",
        "environment.color[1]",
        "below zero",
    ),
    ("", "scene.toml", "camera", "add a [camera]"),
    (
        "[[mesh]]\nname = 'a'\nsample = 'box'\n[camera]\nposition = [0, 0, 1]\ntarget = [0, 0, 0]",
        "scene.toml",
        "instance",
        "add an [[instance]]",
    ),
];

/// Returns a folder with lists of receivers.
fn with_lists() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let list = "px,py,pz,nx,ny,nz\n1,2,3,0,0,1\n1,2,3,0,0,0\n";
    fs::write(folder.path().join("list.csv"), list).unwrap();
    fs::write(folder.path().join("short.csv"), "px,py,pz\n1,2,3\n").unwrap();
    folder
}

#[test]
fn scene_errors_name_line_and_key() {
    let folder = with_lists();
    let [scene, out] = ["scene.toml", "a.png"].map(|name| folder.path().join(name));
    for &(text, place, key, why) in INVALID_SCENES {
        fs::write(&scene, text).unwrap();
        let error = fails("render {} --mode truth -o {}", &[&scene, &out]);
        let file = match place.starts_with(':') {
            true => format!("scene.toml{place}"),
            false => place.to_owned(),
        };
        for part in [file.as_str(), key, why] {
            assert!(error.contains(part), "{text}\n{error}\n{part}");
        }
    }
}
