use aogrid_runtime::{AogridEnvironment, AogridOccluder, wgsl};
use std::mem::offset_of;

/// Everything that the crate publishes or compiles, and how many entry points each has.
const MODULES: [(&str, &str, usize); 4] = [
    ("shading", wgsl::SHADING, 0),
    ("environment", LIBRARY, 0),
    ("occlusion pass", wgsl::OCCLUSION_PASS, 5),
    ("environment pass", wgsl::ENVIRONMENT_PASS, 3),
];

/// All of the library, one file behind the other.
const LIBRARY: &str = concat!(
    include_str!("../../src/constants.wgsl"),
    include_str!("../../src/shading.wgsl"),
    include_str!("../../src/environment.wgsl")
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
    for (name, source, entry_points) in MODULES {
        assert_eq!(
            parse(name, source).entry_points.len(),
            entry_points,
            "{name}"
        );
    }
}

#[test]
fn no_shader_file_is_left_out() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![folder];
    let mut found = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "wgsl") {
                let text = std::fs::read_to_string(&path).unwrap();
                let published = MODULES.iter().any(|(_, source, _)| source.contains(&text));
                assert!(published, "{} is in no tested module", path.display());
                found += 1;
            }
        }
    }
    assert_eq!(found, 5);
}

#[test]
fn the_library_can_be_pasted_anywhere() {
    assert_eq!(LIBRARY, [wgsl::SHADING, wgsl::ENVIRONMENT].concat());
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
fn every_function_has_a_twin_of_the_same_name() {
    let module = parse("library", LIBRARY);
    let twin = [
        include_str!("../../src/shading.rs"),
        include_str!("../../src/environment.rs"),
    ]
    .concat();
    for (_, function) in module.functions.iter() {
        let name = function.name.as_deref().unwrap();
        assert!(twin.contains(&format!("pub fn {name}(")), "{name}");
    }
}

#[test]
fn the_environment_is_laid_out_alike_in_rust_and_wgsl() {
    let module = parse("library", LIBRARY);
    let (_, environment) = module
        .types
        .iter()
        .find(|(_, t)| t.name.as_deref() == Some("AogridEnvironment"))
        .unwrap();
    let naga::TypeInner::Struct { members, span } = &environment.inner else {
        panic!("it is a struct");
    };
    let expected = [
        ("map_x", offset_of!(AogridEnvironment, map_x)),
        ("map_y", offset_of!(AogridEnvironment, map_y)),
        ("map_z", offset_of!(AogridEnvironment, map_z)),
        ("scale", offset_of!(AogridEnvironment, scale)),
    ];
    let found: Vec<_> = members
        .iter()
        .map(|m| (m.name.as_deref().unwrap(), m.offset as usize))
        .collect();
    assert_eq!(found, expected);
    assert_eq!(*span as usize, size_of::<AogridEnvironment>());
}

#[test]
fn the_occluder_is_laid_out_alike_in_rust_and_wgsl() {
    let module = parse("shading", wgsl::SHADING);
    let (_, occluder) = module
        .types
        .iter()
        .find(|(_, t)| t.name.as_deref() == Some("AogridOccluder"))
        .unwrap();
    let naga::TypeInner::Struct { members, span } = &occluder.inner else {
        panic!("it is a struct");
    };
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
        ("weakness", offset_of!(AogridOccluder, weakness)),
    ];
    let found: Vec<_> = members
        .iter()
        .map(|m| (m.name.as_deref().unwrap(), m.offset as usize))
        .collect();
    assert_eq!(found, expected);
    assert_eq!(*span as usize, size_of::<AogridOccluder>());
}
