//! The reader on texts of a few lines.

use super::*;

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn read(faces: &str) -> Result<TriangleMesh, ObjError> {
    read_obj(format!("{CORNERS}{faces}").as_bytes())
}

fn part(name: &str, triangles: Range<usize>) -> Part {
    Part {
        name: name.into(),
        triangles,
    }
}

#[test]
fn negative_indices_count_back_from_the_face() {
    let mesh = read("f -4 -3 -2\nv 9 9 9\nf -5 -3 -2").unwrap();
    let corners: Vec<_> = mesh.corners().collect();
    assert_eq!(corners[0], [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
    assert_eq!(corners[1], [[0.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
}

#[test]
fn objects_and_their_groups_are_parts() {
    let mesh = read("f 1 2 3\no a\nf 1 2 3 4\ng b\nf 2 3 4\no a\nf 1 3 4\no empty\n").unwrap();
    let expected = [
        part(UNNAMED, 0..1),
        part("a", 1..3),
        part("a/b", 3..4),
        part("a~2", 4..5),
    ];
    assert_eq!(mesh.parts(), expected);
    let resumed = read("g a\nf 1 2 3\ng b\nf 2 3 4\ng a\nf 1 3 4\n").unwrap();
    assert_eq!(resumed.parts(), [part("a", 0..2), part("b", 2..3)]);
}

/// Reports 03 and 04: names with `#`, two objects of one name, one group in two objects.
#[test]
fn objects_do_not_merge() {
    let names = |text: &str| {
        let mesh = read(text).unwrap();
        let names = mesh.parts().iter().map(|part| part.name.clone());
        names.collect::<Vec<_>>()
    };
    let screws = names("o Screw #6-32\nf 1 2 3\no Screw #8-32\nf 2 3 4\n");
    assert_eq!(screws, ["Screw #6-32", "Screw #8-32"]);
    let wheels = names("o wheel\nf 1 2 3\no wheel\nf 2 3 4\n");
    assert_eq!(wheels, ["wheel", "wheel~2"]);
    let rims = names("o left\ng rim\nf 1 2 3\no right\ng rim\nf 2 3 4\n");
    assert_eq!(rims, ["left", "right"]);
    // An object begins without a group, whatever the one before it had.
    let begun = names("o a\ng x\nf 1 2 3\no b\nf 1 2 3\ng y\nf 2 3 4\n");
    assert_eq!(begun, ["a", "b", "b/y"]);
}

/// Reports 01 and 05: every way to write the same square.
#[test]
fn comments_marks_and_paths_lose_nothing() {
    let plain = read("f 1 2 3 4\n").unwrap();
    for text in [
        "v 0 0 0 # C:\\\nv 1 0 0\nv 1 1 0 # \\\nv 0 1 0\nf -4 -3 -2 -1",
        "v 0 0 0\nv 1 0 0\n\u{feff}v 1 1 0\nv 0 1 0\nf 1 2 3 4 # \\",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl woods\\oak\\\nf 1 2 3 4",
    ] {
        assert_eq!(read_obj(text.as_bytes()).unwrap(), plain, "{text}");
    }
}

#[test]
fn what_is_not_read_is_reported() {
    let parsed = parse(format!("{CORNERS}f 1 3 2 4\nblob 1\nf 1 2 3").as_bytes()).unwrap();
    assert_eq!(parsed.warnings.len(), 2, "{:?}", parsed.warnings);
    assert!(parsed.warnings[0].starts_with("1 polygons cross"));
    assert!(parsed.warnings[1].ends_with("line 6 (`blob`)"));
    assert!(
        parse(format!("{CORNERS}f 1 2 3").as_bytes())
            .unwrap()
            .warnings
            .is_empty()
    );
}

#[test]
fn points_lines_and_materials_are_ignored() {
    let mesh = read("mtllib no.mtl\nusemtl x\nusemtl y\np 1 2\nl 1 2 3\nf 1\nf 1 2\nf 1 2 3\nf");
    assert_eq!(mesh.unwrap().triangles().len(), 1);
}

#[test]
fn weights_and_colors_do_not_move_vertices() {
    let file = "v 0 0 0 2\nv 2 0 0 2\nv 0 2 0 0\nv 0 2 2 1 0 0\nv 5 5 5 1 2 3 4\nf 1 2 3\nf 1 2 4\nf 1 2 5";
    let mesh = read_obj(file.as_bytes()).unwrap();
    assert_eq!(mesh.bounds().max, [5.0; 3]);
    assert_eq!(mesh.corners().next().unwrap()[1], [2.0, 0.0, 0.0]);
}

#[test]
fn malformed_texture_coordinates_are_ignored() {
    assert!(read("vt x\nvn nan nan nan\nf 1/9/9 2/-7 3//0").is_ok());
}

#[test]
fn errors_name_their_line() {
    let error = |faces: &str| read(faces).unwrap_err();
    for vertex in [
        "v 1 2",
        "v nan 0 0",
        "v -nan 0 0",
        "v 1e99 0 0",
        "v 1,5 0 0",
    ] {
        // A malformed vertex is an error even if it is unused.
        let file = format!("{vertex}\nf 1 2 5");
        assert_eq!(error(&file), ObjError::Vertex(5), "{vertex}");
        let unused = format!("{vertex}\nf 1 2 3");
        assert_eq!(error(&unused), ObjError::Vertex(5), "{vertex}");
    }
    assert_eq!(error("f 1 2 3\nf 1 2 x"), ObjError::Face(6));
    assert_eq!(error("f 1 2 3\nf 1 2 /3"), ObjError::Face(6));
    let index = |line, index, count| ObjError::Index { line, index, count };
    assert_eq!(error("f 1 2 5"), index(5, 5, 4));
    assert_eq!(error("f 1 2 0"), index(5, 0, 4));
    assert_eq!(error("\nf 1 2 -5"), index(6, -5, 4));
    assert_eq!(error("f 1 2 6\no next\nv 1 1 1\n"), index(5, 6, 5));
    let none = read_obj(b"f 1 2 3").unwrap_err();
    assert_eq!(
        none.to_string(),
        "line 1: a face refers to vertex 1; there are no vertices"
    );
    let far = "f 1 2 99999999999999999999";
    assert_eq!(error(far), ObjError::Face(5));
    assert_eq!(error("l 1 2"), ObjError::Mesh(MeshError::Empty));
    assert_eq!(read_obj(b"\xFF\xFEv\0"), Err(ObjError::Utf16));
}

#[test]
fn faces_may_come_before_their_vertices() {
    assert!(read("f 1 2 5\nv 7 7 7\n").is_ok());
}

#[test]
fn broken_files_give_a_mesh_or_an_error() {
    let text = format!("{CORNERS}o a\ng b\nf 1 2 3 4\nf -1//2 -2/1 \\\n-3\n");
    super::super::load_all_broken("a.obj", text.as_bytes());
}

/// A square of two triangles, folded along its diagonal in the texture.
#[test]
fn corners_have_texture_coordinates_and_normals() {
    let text = format!(
        "{CORNERS}vt 0 0\nvt 1 0\nvt 1 1\nvt .5 .25\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/-1\nf 1/-4 3/3/1 4/4//\n"
    );
    let textured = parse_textured(text.as_bytes()).unwrap();
    // The third corner is the same in both triangles, and the first one has a normal in one alone.
    let triangles = textured.parsed.mesh.triangles();
    assert_eq!(triangles, [[0, 1, 2], [3, 2, 4]]);
    let expected = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.75]];
    assert_eq!(textured.coordinates, expected);
    let normals = textured.normals.unwrap();
    assert_eq!([normals[0], normals[3]], [[0.0, 0.0, 1.0], [0.0; 3]]);
    let mesh = read_obj(text.as_bytes()).unwrap();
    assert_eq!(mesh.positions().len(), 4);
    assert!(mesh.corners().eq(textured.parsed.mesh.corners()));
    let without = parse_textured(format!("{CORNERS}vt 0 0\nf 1/1 2/1 3/1\nf 1 2 3\n").as_bytes());
    assert_eq!(without.err(), Some(ObjError::NoCoordinates(7)));
}
