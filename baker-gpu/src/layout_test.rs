//! Compares the layout of mirror structs with naga's.

use crate::Shader;

/// Asserts that the WGSL struct `name` has this size and exactly these members, in this order and
/// at these offsets.
pub(crate) fn assert_layout(shader: &Shader, name: &str, size: usize, expected: &[(&str, usize)]) {
    let module = naga::front::wgsl::parse_str(&shader.source).expect("it is valid");
    let found = module.types.iter().find_map(|(_, t)| match &t.inner {
        naga::TypeInner::Struct { members, span } if t.name.as_deref() == Some(name) => {
            Some((members, *span))
        }
        _ => None,
    });
    let (members, span) = found.unwrap_or_else(|| panic!("no {name} in {}", shader.name));
    assert_eq!(span as usize, size, "{name}");
    let members: Vec<_> = members
        .iter()
        .map(|m| (m.name.as_deref().expect("it has a name"), m.offset as usize))
        .collect();
    assert_eq!(members, expected, "{name}");
}
