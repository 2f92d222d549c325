use aogrid_runtime::{
    AogridAtlasOccluder, AogridEnvironment, AogridOccluder, AogridTiles, AogridVolume, wgsl,
};
use std::mem::offset_of;

/// Returns everything that the crate publishes or compiles, with its number of entry points.
fn modules() -> [(&'static str, String, usize); 13] {
    let tiled = |format| ("tiled pass", wgsl::tiled_pass(format), 2);
    [
        ("shading", wgsl::SHADING.to_owned(), 0),
        ("environment", LIBRARY.to_owned(), 0),
        ("occlusion pass", wgsl::OCCLUSION_PASS.to_owned(), 5),
        ("merge pass", wgsl::MERGE_PASS.to_owned(), 4),
        ("volumes", wgsl::SHADING.to_owned() + wgsl::VOLUMES, 0),
        ("volume pass", wgsl::VOLUME_PASS.to_owned(), 3),
        ("upsampling", wgsl::UPSAMPLE_PASS.to_owned(), 2),
        tiled("r32float"),
        tiled("rgba16float"),
        tiled("rgba32float"),
        tiled("rgba8unorm"),
        (
            "tile lists",
            wgsl::SHADING.to_owned() + &wgsl::tile_lists(0),
            0,
        ),
        ("environment pass", wgsl::ENVIRONMENT_PASS.to_owned(), 3),
    ]
}

/// The whole library, its files one after the other.
const LIBRARY: &str = concat!(
    include_str!("../../src/constants.wgsl"),
    include_str!("../../src/lookup.wgsl"),
    include_str!("../../src/shading.wgsl"),
    include_str!("../../src/environment.wgsl"),
    include_str!("../../src/surface.wgsl"),
    include_str!("../../src/volumes.wgsl")
);

fn parse(name: &str, source: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    // No capability beyond WebGPU's own.
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    );
    validator
        .validate(&module)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    module
}

#[test]
fn every_shader_of_the_crate_is_valid_without_any_extension() {
    for (name, source, entry_points) in modules() {
        assert_eq!(
            parse(name, &source).entry_points.len(),
            entry_points,
            "{name}"
        );
    }
}

#[test]
fn every_shader_file_is_tested() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let modules = modules();
    let mut folders = vec![folder];
    let mut found = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "wgsl") {
                let text = std::fs::read_to_string(&path).unwrap();
                let text = text.replace("GROUP", "0");
                let published = modules.iter().any(|(_, source, _)| source.contains(&text));
                assert!(published, "{} is in no tested module", path.display());
                found += 1;
            }
        }
    }
    assert_eq!(found, 15);
}

#[test]
fn the_library_binds_nothing_and_uses_only_prefixed_names() {
    let parts = [
        wgsl::SHADING,
        wgsl::ENVIRONMENT,
        wgsl::SURFACE,
        wgsl::VOLUMES,
    ];
    assert_eq!(LIBRARY, parts.concat());
    let module = parse("library", LIBRARY);
    assert!(module.global_variables.is_empty(), "it binds something");
    assert!(module.overrides.is_empty(), "it asks for constants");
    let functions = module.functions.iter().map(|(_, f)| f.name.as_deref());
    let types = module.types.iter().map(|(_, t)| t.name.as_deref());
    let names: Vec<_> = functions.chain(types).flatten().collect();
    assert!(names.len() > 20);
    for name in names {
        let ours = name.starts_with("aogrid_") || name.starts_with("Aogrid");
        assert!(ours, "{name} could collide with a user's own");
    }
}

#[test]
fn every_function_has_a_cpu_twin_of_the_same_name() {
    let module = parse("library", LIBRARY);
    let twin = [
        include_str!("../../src/lookup.rs"),
        include_str!("../../src/shading.rs"),
        include_str!("../../src/environment.rs"),
        include_str!("../../src/surface.rs"),
        include_str!("../../src/volumes/twin.rs"),
    ]
    .concat();
    for (_, function) in module.functions.iter() {
        let name = function.name.as_deref().unwrap();
        assert!(twin.contains(&format!("pub fn {name}(")), "{name}");
    }
}

/// Asserts that a struct in WGSL has the members of `T` at the same offsets, and its size.
fn assert_layout<T>(module: &naga::Module, name: &str, expected: &[(&str, usize)]) {
    let mut types = module.types.iter();
    let (_, found) = types
        .find(|(_, t)| t.name.as_deref() == Some(name))
        .unwrap();
    let naga::TypeInner::Struct { members, span } = &found.inner else {
        panic!("it is a struct");
    };
    let member = |m: &naga::StructMember| (m.name.clone().unwrap(), m.offset as usize);
    let found: Vec<_> = members.iter().map(member).collect();
    let expected: Vec<_> = expected
        .iter()
        .map(|(name, offset)| (name.to_string(), *offset))
        .collect();
    assert_eq!(found, expected, "{name}");
    assert_eq!(*span as usize, size_of::<T>(), "{name}");
}

#[test]
fn the_environment_has_the_same_layout_in_rust_and_wgsl() {
    let module = parse("library", LIBRARY);
    let expected = [
        ("map_x", offset_of!(AogridEnvironment, map_x)),
        ("map_y", offset_of!(AogridEnvironment, map_y)),
        ("map_z", offset_of!(AogridEnvironment, map_z)),
        ("scale", offset_of!(AogridEnvironment, scale)),
    ];
    assert_layout::<AogridEnvironment>(&module, "AogridEnvironment", &expected);
}

#[test]
fn a_volume_has_the_same_layout_in_rust_and_wgsl() {
    let module = parse("library", LIBRARY);
    let expected = [
        ("extent", offset_of!(AogridVolume, extent)),
        ("exponent", offset_of!(AogridVolume, exponent)),
        ("weight", offset_of!(AogridVolume, weight)),
        ("two_sided", offset_of!(AogridVolume, two_sided)),
    ];
    assert_layout::<AogridVolume>(&module, "AogridVolume", &expected);
}

#[test]
fn the_occluder_has_the_same_layout_in_rust_and_wgsl() {
    let module = parse("shading", wgsl::SHADING);
    let expected = [
        ("grid_x", offset_of!(AogridOccluder, grid_x)),
        ("grid_y", offset_of!(AogridOccluder, grid_y)),
        ("grid_z", offset_of!(AogridOccluder, grid_z)),
        ("axis_x", offset_of!(AogridOccluder, axis_x)),
        ("axis_y", offset_of!(AogridOccluder, axis_y)),
        ("axis_z", offset_of!(AogridOccluder, axis_z)),
        ("excluded", offset_of!(AogridOccluder, excluded)),
        ("object_id", offset_of!(AogridOccluder, object_id)),
        ("layers", offset_of!(AogridOccluder, layers)),
        ("strength", offset_of!(AogridOccluder, strength)),
        (
            "min_axis_length",
            offset_of!(AogridOccluder, min_axis_length),
        ),
        ("per_hull", offset_of!(AogridOccluder, per_hull)),
        ("fade_scale", offset_of!(AogridOccluder, fade_scale)),
        ("per_reach", offset_of!(AogridOccluder, per_reach)),
        ("min_factor", offset_of!(AogridOccluder, min_factor)),
        ("center", offset_of!(AogridOccluder, center)),
        ("per_step", offset_of!(AogridOccluder, per_step)),
        ("flatness", offset_of!(AogridOccluder, flatness)),
    ];
    assert_layout::<AogridOccluder>(&module, "AogridOccluder", &expected);
}

#[test]
fn occluders_in_atlases_and_tiles_have_the_same_layout_in_rust_and_wgsl() {
    let module = parse("shading", wgsl::SHADING);
    let expected = [
        ("occluder", offset_of!(AogridAtlasOccluder, occluder)),
        ("half_cell", offset_of!(AogridAtlasOccluder, half_cell)),
        ("atlas_scale", offset_of!(AogridAtlasOccluder, atlas_scale)),
        (
            "atlas_offset",
            offset_of!(AogridAtlasOccluder, atlas_offset),
        ),
        ("pixels", offset_of!(AogridAtlasOccluder, pixels)),
    ];
    assert_layout::<AogridAtlasOccluder>(&module, "AogridAtlasOccluder", &expected);
    let expected = [
        ("size", offset_of!(AogridTiles, size)),
        ("words", offset_of!(AogridTiles, words)),
        ("occluders", offset_of!(AogridTiles, occluders)),
    ];
    assert_layout::<AogridTiles>(&module, "AogridTiles", &expected);
}
