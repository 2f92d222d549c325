use super::*;

/// Reads a valid file whose metadata is replaced by `json`, with all lengths adjusted.
fn with_json(json: &str) -> Result<Grid, ReadError> {
    let good = small();
    let number = |offset: usize| {
        let bytes = good[offset..offset + 4].try_into().unwrap();
        u32::from_le_bytes(bytes) as usize
    };
    let (kvd, kvd_length) = (number(at::KVD_OFFSET), number(at::KVD_LENGTH));
    let key = find(&good, b"aogrid\0");
    let mut pairs = good[kvd..key - 4].to_vec();
    let pair = ["aogrid\0", json, "\0"].concat();
    pairs.extend((pair.len() as u32).to_le_bytes());
    pairs.extend(pair.as_bytes());
    pairs.resize(pairs.len().next_multiple_of(4), 0);

    let mut bytes = good[..kvd].to_vec();
    bytes.extend(&pairs);
    let level = bytes.len() as u32;
    bytes.extend(&good[kvd + kvd_length..]);
    bytes[at::KVD_LENGTH..][..4].copy_from_slice(&(pairs.len() as u32).to_le_bytes());
    bytes[at::LEVEL_OFFSET..][..4].copy_from_slice(&level.to_le_bytes());
    Grid::from_bytes(&bytes)
}

fn good_json() -> String {
    let good = small();
    let start = find(&good, b"aogrid\0") + "aogrid\0".len();
    let length = good[start..].iter().position(|&b| b == 0).unwrap();
    String::from_utf8(good[start..start + length].to_vec()).unwrap()
}

/// Returns the error of reading a file whose metadata has `to` in place of `from`.
fn changed(from: &str, to: &str) -> ReadError {
    let good = good_json();
    // Each replacement must change the JSON, or nothing is tested.
    assert!(good.contains(from), "{from} is not in {good}");
    with_json(&good.replacen(from, to, 1)).unwrap_err()
}

#[test]
fn metadata_that_is_not_json_of_the_profile_is_an_error() {
    assert!(with_json(&good_json()).is_ok());
    for broken in [
        "",
        "{",
        "null",
        "[]",
        "{}",
        "\u{FEFF}{}",
        &"[".repeat(100_000),
    ] {
        let error = with_json(broken).unwrap_err();
        assert!(matches!(error, ReadError::Metadata(_)), "{error}");
    }
}

#[test]
fn newer_and_malformed_versions_are_errors() {
    let newer = changed(r#""version":"1.0""#, r#""version":"2.0""#);
    assert!(matches!(newer, ReadError::NewerVersion(2)));
    assert!(newer.to_string().contains("update aogrid"), "{newer}");
    for version in ["", "1", "x.y", "0.9", "-1.0"] {
        let error = changed(r#""version":"1.0""#, &format!(r#""version":"{version}""#));
        assert!(
            matches!(error, ReadError::MetadataRange("version")),
            "{error}"
        );
    }
}

#[test]
fn encodings_that_are_unknown_or_do_not_fit_the_texture_are_errors() {
    let unknown = changed(r#""encoding":"occlusion""#, r#""encoding":"sh9""#);
    assert!(matches!(unknown, ReadError::UnknownEncoding(name) if name == "sh9"));
    let cone = changed(r#""encoding":"occlusion""#, r#""encoding":"cone""#);
    assert!(matches!(
        cone,
        ReadError::Channels {
            expected: 4,
            found: 1,
            ..
        }
    ));
}

#[test]
fn values_out_of_range_are_named() {
    let flat = changed(r#""half_extents":[1.0"#, r#""half_extents":[0.0"#);
    assert!(matches!(flat, ReadError::Spec(_)));
    let infinite = changed(r#""center":[0.0"#, r#""center":[1e999"#);
    assert!(matches!(
        infinite,
        ReadError::Metadata(_) | ReadError::Spec(_)
    ));
    for (key, good, wrong, name) in [
        ("size", "16", "4294967295", "method"),
        ("size", "16", "0", "method"),
        ("epsilon", "0.1", "-1", "epsilon"),
        ("v_m", "0.375", "1.5", "boundary"),
        ("max_distance", "null", "0", "max_distance"),
        ("sample_offset", "[0.00031", "[3.1", "sample_offset"),
        ("largest", "1.0", "1.1", "largest"),
    ] {
        let error = changed(
            &format!(r#""{key}":{good}"#),
            &format!(r#""{key}":{wrong}"#),
        );
        assert!(
            matches!(error, ReadError::MetadataRange(found) if found == name),
            "{error}"
        );
    }
}

#[test]
fn newer_minor_versions_may_add_json_keys() {
    let good = good_json();
    let more = good.replacen(r#""version":"1.0""#, r#""version":"1.7","color":"red""#, 1);
    let grid = with_json(&more.replacen(r#""bake":{"#, r#""bake":{"phase":3,"#, 1)).unwrap();
    assert_eq!(grid.record(), &record());
}

#[test]
fn files_without_aogrid_metadata_are_identified_in_the_error() {
    let mut bytes = small();
    let key = find(&bytes, b"aogrid\0");
    bytes[key] = b'x';
    let error = Grid::from_bytes(&bytes).unwrap_err();
    assert!(matches!(error, ReadError::NoMetadata), "{error}");
    assert!(matches!(with_u32(at::KVD_LENGTH, 0), ReadError::NoMetadata));
}
