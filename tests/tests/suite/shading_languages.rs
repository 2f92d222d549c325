//! The shading library in GLSL and HLSL: complete, and compiled by glslang where that is installed.

use std::fs;
use std::path::Path;
use std::process::Command;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Placement, Preset};
use aogrid_grid_format::Grid;
use aogrid_runtime::{AogridOccluder, Instance, wgsl};
use aogrid_tests::skip;
use glam::{DMat3, DMat4, DVec3};

/// The libraries, and the names of their files.
const LIBRARIES: [(&str, &str); 4] = [
    ("aogrid", wgsl::SHADING),
    ("aogrid_environment", wgsl::ENVIRONMENT),
    ("aogrid_surface", wgsl::SURFACE),
    ("aogrid_volumes", wgsl::VOLUMES),
];

fn read(name: &str, ending: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/shading-languages");
    fs::read_to_string(folder.join(format!("{name}.{ending}"))).unwrap()
}

/// Returns the names behind a word that begins a line of WGSL.
fn names<'a>(source: &'a str, word: &'a str) -> impl Iterator<Item = &'a str> {
    let items = source
        .lines()
        .filter_map(move |line| line.strip_prefix(word));
    items.map(|item| item.split(['(', ' ', '{']).next().unwrap())
}

#[test]
fn every_function_and_type_is_there_once() {
    let mut n = 0;
    for (name, source) in LIBRARIES {
        for ending in ["glsl", "hlsl"] {
            let text = read(name, ending);
            let is_definition = |line: &str, function: &str| {
                !line.starts_with([' ', '/']) && line.contains(&format!(" {function}("))
            };
            for function in names(source, "fn ") {
                let found = text.lines().filter(|line| is_definition(line, function));
                assert_eq!(found.count(), 1, "{function} in {name}.{ending}");
                n += 1;
            }
            for of_type in names(source, "struct ") {
                let found = text.matches(&format!("\nstruct {of_type} {{\n")).count();
                assert_eq!(found, 1, "{of_type} in {name}.{ending}");
            }
        }
    }
    assert!(n >= 2 * 60, "{n} functions");
}

/// A pixel shader that calls a function of each library; `VEC3`, `VEC4` and samplers are those of the
/// language.
const CALLS: &str = "
    VEC4 merged = aogrid_merge_cone(VEC4(0.0, 0.0, 0.0, 1.0), occluder, grid, clips, overlaps,SAMPLER \
        p.xyz, p.yzx);
    float t = aogrid_cone(occluder, grid, clips,SAMPLER p.xyz, p.yzx);
    VEC3 light = aogrid_lambertian(environment, map,SAMPLER merged, p.yzx);
    float hidden = aogrid_volume_occlusion(volume, p.xyz, p.yzx, p.zxy, p.zzx);
    VEC4 result = VEC4(light * (t - hidden), aogrid_mean(merged, merged, overlapsLAST).w);
";

fn glsl(version: &str) -> String {
    let precision = "precision highp float;\nprecision highp int;\n";
    let precision = if version.ends_with("es") {
        precision
    } else {
        ""
    };
    let libraries = LIBRARIES.map(|(name, _)| read(name, "glsl")).concat();
    let calls = CALLS
        .replace("VEC", "vec")
        .replace("SAMPLER", "")
        .replace("LAST", "");
    format!(
        "#version {version}\n{precision}{libraries}\n\
         uniform highp sampler3D grid;\nuniform highp sampler2D clips;\nuniform highp sampler3D overlaps;\n\
         uniform highp sampler2D map;\nuniform AogridOccluder occluder;\n\
         uniform AogridEnvironment environment;\nuniform AogridVolume volume;\nin vec4 p;\nout vec4 color;\n\
         void main() {{{calls}    color = result;\n}}\n"
    )
}

fn hlsl() -> String {
    let libraries = LIBRARIES.map(|(name, _)| read(name, "hlsl")).concat();
    let calls = CALLS.replace("VEC", "float");
    let calls = calls
        .replace("SAMPLER", " linear_clamp,")
        .replace("LAST", ", linear_clamp");
    format!(
        "{libraries}\nTexture3D<float4> grid;\nTexture2D<float4> clips;\nTexture3D<float4> overlaps;\n\
         Texture2D<float4> map;\nSamplerState linear_clamp;\n\
         cbuffer Shading {{ AogridOccluder occluder; AogridEnvironment environment; AogridVolume volume; }};\n\
         float4 main(float4 p : P) : SV_Target {{{calls}    return result;\n}}\n"
    )
}

/// Compiles a shader with glslang, as GLSL or HLSL by the name's ending; returns what it says of a wrong one.
fn compile(name: &str, source: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, source).unwrap();
    let mut glslang = Command::new("glslangValidator");
    if name.ends_with("hlsl") {
        let spirv = folder.path().join("a.spv");
        glslang
            .args(["-D", "-V", "-S", "frag", "-e", "main", "-o"])
            .arg(spirv);
    }
    let output = glslang.arg(path).output().unwrap();
    match output.status.success() {
        true => Ok(()),
        false => Err(String::from_utf8_lossy(&output.stdout).into_owned()),
    }
}

/// Whether glslang is installed, with a note if not.
fn has_glslang() -> bool {
    let has = Command::new("glslangValidator")
        .arg("--version")
        .output()
        .is_ok();
    if !has {
        skip("glslangValidator is not there");
    }
    has
}

#[test]
fn glslang_compiles_all_languages() {
    if !has_glslang() {
        return;
    }
    for version in ["300 es", "310 es", "330", "450"] {
        compile("a.frag", &glsl(version)).unwrap_or_else(|said| panic!("{version}: {said}"));
    }
    compile("a.hlsl", &hlsl()).unwrap();
    // A wrong shader must not pass.
    let wrong = glsl("330").replace(
        "float t = aogrid_cone(occluder,",
        "float t = aogrid_cone(t,",
    );
    compile("b.frag", &wrong).unwrap_err();
}

/// Returns the document's block of a language, with the library in place of its `#include`.
fn documented(language: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let document = fs::read_to_string(root.join("docs/shading-languages.md")).unwrap();
    let (_, block) = document.split_once(&format!("```{language}\n")).unwrap();
    let (block, _) = block.split_once("```").unwrap();
    let library = read("aogrid", language);
    let is_include = |line: &str| line.starts_with("#include \"aogrid.");
    assert_eq!(block.lines().filter(|line| is_include(line)).count(), 1);
    let lines = block.lines().map(|line| match is_include(line) {
        true => library.clone(),
        false => line.to_owned() + "\n",
    });
    lines.collect()
}

#[test]
fn the_documented_shaders_compile() {
    if !has_glslang() {
        return;
    }
    let main = "in vec4 p;\nout vec4 color;\n\
                void main() { color = vec4(transmittance(p.xyz, p.yzx)); }\n";
    compile("a.frag", &(documented("glsl") + main)).unwrap();
    let main = "float4 main(float4 p : P) : SV_Target { return transmittance(p.xyz, p.yzx); }\n";
    compile("a.hlsl", &(documented("hlsl") + main)).unwrap();
}

/// Largest relative deviation of the documented formulas, in double precision, from the runtime's numbers:
/// single floats that a few steps have rounded.
const ROUNDING: f64 = 1e-5;

/// The formulas of the document, for a grid of bytes.
#[test]
fn the_documented_numbers_are_those_of_the_runtime() {
    let mesh = Model::Table.mesh(None).unwrap();
    let placement = Placement {
        resolution: [12, 13, 14],
        ..Preset::Default.placement()
    };
    let grid = aogrid_tests::grid(&mesh, &placement, &Preset::Default.options());
    let m = DMat4::from_translation(DVec3::new(1.0, 2.0, -3.0))
        * DMat4::from_rotation_z(0.5)
        * DMat4::from_scale(DVec3::splat(1.5));
    let instance = Instance::at(m.as_mat4().to_cols_array_2d());
    let found = AogridOccluder::new(&grid, &instance).unwrap();

    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let n = grid.spec().resolution().map(f64::from);
    let (c, e) = (
        vector(grid.spec().center()),
        vector(grid.spec().half_extents()),
    );
    let object_from_grid = DMat4::from_translation(c - e) * DMat4::from_scale(2.0 * e);
    let rows = (m * object_from_grid).inverse();
    let l = DMat3::from_mat4(m);
    let l = l * (1.0 / l.determinant().abs().cbrt());
    let (s, o) = (255.0 / 127.0, -128.0 / 127.0);
    let f = grid.record().flatness.map(f64::from);
    for axis in 0..3 {
        let row = l.row(axis);
        let expected = [s * row.x, s * row.y, s * row.z, o * row.element_sum()];
        assert_near([found.axis_x, found.axis_y, found.axis_z][axis], &expected);
        let expected = rows.row(axis).to_array();
        assert_near([found.grid_x, found.grid_y, found.grid_z][axis], &expected);
        let largest = outer_cells(&grid, axis).map(|(p, a)| {
            let a = a.min(0.5);
            let k = 4.0 * a * (1.0 - a);
            let flat = f[0] * p[0] * p[0] + f[1] * p[1] * p[1] + f[2] * p[2] * p[2] + f[3];
            k / (1.0 - (flat * k).min(0.97))
        });
        let reach = (largest.fold(0.0, f64::max) / 0.035).sqrt().max(4.0 / 3.0);
        let n = n[axis];
        assert_near([found.per_hull[axis]], &[2.0 * n / (n - 1.0)]);
        assert_near([found.per_reach[axis]], &[2.0 * n / ((n - 1.0) * reach)]);
        let offset = f64::from(grid.record().self_offset);
        assert_near([found.per_step[axis]], &[n / offset]);
    }
    assert_near(found.center, &m.transform_point3(c).to_array());
    assert_near([found.fade_scale, found.strength], &[4.0, 1.0]);
    assert_eq!((found.min_axis_length, found.min_factor), (0.0, 0.0));
    assert_eq!(
        (found.excluded, found.object_id, found.layers),
        ([u32::MAX; 4], u32::MAX, u32::MAX)
    );
    assert_eq!(found.flatness, grid.record().flatness);
}

/// Returns the place on the hull and the fraction of each cell of the two outer layers across an axis.
fn outer_cells(grid: &Grid, axis: usize) -> impl Iterator<Item = ([f64; 3], f64)> {
    let spec = *grid.spec();
    let last = spec.resolution().map(|n| n - 1);
    let cells = (0..spec.cell_count()).map(move |idx| (idx, spec.cell_at(idx)));
    let outer = cells.filter(move |(_, cell)| cell[axis] == 0 || cell[axis] == last[axis]);
    outer.map(move |(idx, cell)| {
        let place = |x: usize| 2.0 * f64::from(cell[x]) / f64::from(last[x]) - 1.0;
        ([0, 1, 2].map(place), f64::from(grid.cell(idx)[3]))
    })
}

fn assert_near<const N: usize>(found: [f32; N], expected: &[f64]) {
    let size = expected.iter().fold(0.0, |size: f64, v| size.max(v.abs()));
    for (found, expected) in found.iter().zip(expected) {
        let error = (f64::from(*found) - expected).abs();
        assert!(error <= ROUNDING * size, "{found} instead of {expected}");
    }
}
