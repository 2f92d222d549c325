//! Signed layers against rays through every triangle, and the rule against shapes whose inside is
//! known.

use super::*;
use crate::mesh::Part;
use crate::models::Model;
use crate::{BakeOptions, Extent, Placement};

/// A ray that passes an edge more closely than this, in cells, may be counted on either side: the
/// sweep's slopes are rounded to 2⁻²⁰ of a cell, and coordinates reach 32 cells.
const GRAZING: f64 = 1e-4;

fn mesh_of(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> TriangleMesh {
    let part = Part {
        name: "test".into(),
        triangles: 0..triangles.len(),
    };
    TriangleMesh::new(positions, triangles, vec![part]).unwrap()
}

/// `mesh` with its triangles changed.
fn edited(mesh: &TriangleMesh, edit: impl FnOnce(&mut Vec<[u32; 3]>)) -> TriangleMesh {
    let mut triangles = mesh.triangles().to_vec();
    edit(&mut triangles);
    mesh_of(mesh.positions().to_vec(), triangles)
}

/// `mesh` less one of its triangles.
fn without(mesh: &TriangleMesh, triangle: usize) -> TriangleMesh {
    edited(mesh, |triangles| {
        triangles.remove(triangle);
    })
}

fn prepared(mesh: &TriangleMesh, resolution: [u32; 3]) -> PreparedMesh {
    let placement = Placement {
        resolution,
        ..Placement::paper()
    };
    let spec = placement.place(&mesh.bounds()).unwrap();
    PreparedMesh::new(mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap()
}

/// The directions of a cell, in cells: the texels of six faces.
fn directions(mesh: &PreparedMesh) -> Vec<[f64; 3]> {
    let size = mesh.spec().cell_size();
    let texels = crate::cube_face::texels(FACE_SIZE).into_iter();
    texels
        .map(|texel| std::array::from_fn(|x| texel.direction[x] / size[x]))
        .collect()
}

/// The sign with which a triangle counts ahead of `origin`, zero if it is not hit, and whether the
/// ray passes one of its edges too closely to tell.
fn signed_hit(corners: [[f64; 3]; 3], origin: [f64; 3], d: [f64; 3]) -> (i32, bool) {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [0, 1, 2].map(|x| a[(x + 1) % 3] * b[(x + 2) % 3] - a[(x + 2) % 3] * b[(x + 1) % 3])
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let length = |a: [f64; 3]| dot(a, a).sqrt();
    let from = corners.map(|c| [0, 1, 2].map(|x| c[x] - origin[x]));
    let along = |i: usize| {
        let (a, b) = (from[i], from[(i + 1) % 3]);
        [0, 1, 2].map(|x| b[x] - a[x])
    };
    let normal = cross(along(0), along(1));
    // The signed distance of the ray from each edge, positive on its left.
    let sides = [0, 1, 2].map(|i| {
        let across = cross(along(i), d);
        -dot(across, from[i]) / length(across).max(1e-30)
    });
    let ahead = dot(normal, from[0]) / dot(normal, d);
    let near = sides.iter().any(|s| s.abs() < GRAZING);
    let all = |sign: f64| sides.iter().all(|s| s * sign > 0.0);
    let inside = all(1.0) || all(-1.0);
    let maybe = [1.0, -1.0]
        .iter()
        .any(|sign| sides.iter().all(|s| s * sign > -GRAZING));
    let close = ahead.abs() * length(d) < GRAZING;
    match inside && ahead > 0.0 {
        true => (dot(normal, d).signum() as i32, near || close),
        false => (0, maybe && (near || close)),
    }
}

/// One cell in so many is compared: few, as every direction of a cell asks every triangle; prime,
/// so that all rows and columns have some.
const STEP: usize = 23;

/// Compares cells of the region with rays through all triangles. Returns how many directions
/// were compared and how many grazed an edge.
fn compare(mesh: &PreparedMesh) -> (usize, usize) {
    let layers = mesh.signed_layers().expect("it has unbalanced edges");
    let scale = f64::from(1_u32 << mesh.lattice().bits());
    let corner = |v: u32| mesh.vertices()[v as usize].map(|x| f64::from(x) / scale);
    let triangles: Vec<_> = mesh.triangles().iter().map(|t| t.map(corner)).collect();
    let directions = directions(mesh);
    let (mut compared, mut grazed) = (0, 0);
    for idx in (0..mesh.spec().cell_count()).step_by(STEP) {
        let cell = mesh.spec().cell_at(idx);
        if layers.region.idx(cell).is_none() {
            assert_eq!(layers.counts(cell), LayerCounts::default());
            continue;
        }
        let mut expected = LayerCounts::default();
        let mut doubtful = 0;
        for &d in &directions {
            let hits = triangles
                .iter()
                .map(|t| signed_hit(*t, cell.map(f64::from), d));
            let (s, grazes) = hits.fold((0, false), |(s, g), hit| (s + hit.0, g || hit.1));
            doubtful += u16::from(grazes);
            expected.positive += u16::from(s > 0);
            expected.negative += u16::from(s < 0);
            expected.odd += u16::from(s % 2 != 0);
        }
        let found = layers.counts(cell);
        if layers.winding_is_consistent() {
            assert!(
                found.positive.abs_diff(expected.positive) <= doubtful,
                "{cell:?}"
            );
            assert!(
                found.negative.abs_diff(expected.negative) <= doubtful,
                "{cell:?}"
            );
        } else {
            assert_eq!((found.positive, found.negative), (0, 0));
        }
        let odd = (found.odd, expected.odd);
        assert!(
            odd.0.abs_diff(odd.1) <= doubtful,
            "{cell:?}: {odd:?} {doubtful}"
        );
        compared += directions.len();
        grazed += usize::from(doubtful);
    }
    (compared, grazed)
}

/// Every `n`-th triangle gone.
fn with_holes(mesh: &TriangleMesh, n: usize) -> TriangleMesh {
    edited(mesh, |triangles| {
        let mut idx = 0;
        triangles.retain(|_| {
            idx += 1;
            idx % n != 0
        });
    })
}

/// Every `n`-th triangle turned over.
fn flipped(mesh: &TriangleMesh, n: usize) -> TriangleMesh {
    edited(mesh, |triangles| {
        triangles.iter_mut().step_by(n).for_each(|t| t.swap(0, 1));
    })
}

#[test]
fn layers_are_those_of_rays() {
    let robot = Model::Robot.mesh(None).unwrap();
    let torus = Model::Torus.mesh(None).unwrap();
    let soup: Vec<[f32; 3]> = (0..90)
        .map(|i: u32| [3, 5, 7].map(|k| (i * i * k % 101) as f32 / 50.0))
        .collect();
    let triangles = (0..30).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    for (name, mesh, resolution) in [
        ("robot with holes", with_holes(&robot, 9), [9, 12, 8]),
        ("torus with holes", with_holes(&torus, 20), [16, 8, 13]),
        ("soup", mesh_of(soup, triangles), [10, 8, 9]),
        ("a few flipped", flipped(&torus, 97), [10; 3]),
        ("many flipped", flipped(&with_holes(&torus, 20), 5), [10; 3]),
    ] {
        let mesh = prepared(&mesh, resolution);
        let (compared, grazed) = compare(&mesh);
        assert!(
            compared > 5_000 && grazed * 50 < compared,
            "{name}: {grazed} of {compared}"
        );
    }
}

#[test]
fn wide_sums_are_those_of_narrow_ones() {
    let mesh = with_holes(&Model::Robot.mesh(None).unwrap(), 7);
    let mesh = prepared(&mesh, [12; 3]);
    let surface = unbalanced::Surface::of(&mesh).unwrap();
    let region = Region::around(&mesh);
    let frames = [0, 1, 2].map(|w| Frame::new(&mesh, &region, w));
    let hits = RowHits::all(&mesh, &frames);
    let narrow = count_all::<i16>(&mesh, &surface, &region, &frames, &hits);
    let wide = count_all::<i32>(&mesh, &surface, &region, &frames, &hits);
    assert!(narrow == wide && narrow.iter().any(|c| c.positive > 0));
}

#[test]
fn threads_do_not_matter() {
    let mesh = with_holes(&Model::Robot.mesh(None).unwrap(), 7);
    let mesh = prepared(&mesh, [16; 3]);
    let with = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        pool.unwrap().install(|| mesh.signed_layers())
    };
    assert!(with(1).is_some() && with(1) == with(5));
}

#[test]
fn closed_meshes_have_nothing_to_count() {
    for sample in [Model::Robot, Model::LShape, Model::Sphere] {
        let mesh = sample.mesh(None).unwrap();
        assert!(prepared(&mesh, [8; 3]).signed_layers().is_none());
    }
}

/// Returns how many cells are interior, doubtful and inward, none of which sees no sky at all.
fn classes(mesh: &TriangleMesh) -> [usize; 3] {
    let mesh = prepared(mesh, [16; 3]);
    let layers = mesh.signed_layers().expect("it has unbalanced edges");
    let mut n = [0; 3];
    for idx in 0..mesh.spec().cell_count() {
        let class = layers.class(mesh.spec().cell_at(idx), false);
        let facts = [class.is_interior, class.is_doubtful, class.is_inward];
        for (n, fact) in n.iter_mut().zip(facts) {
            *n += usize::from(fact);
        }
    }
    n
}

/// Cell centers of a 16³ grid with ε = 0.1 within a unit cube.
fn cells_within_a_cube() -> usize {
    let mesh = Model::Box.mesh(None).unwrap();
    let mesh = prepared(&mesh, [16; 3]);
    let [low, high] = mesh.bounds();
    let inside = |cell: [u32; 3]| {
        let at = cell.map(|i| (i as i32) << mesh.lattice().bits());
        (0..3).all(|x| (low[x]..high[x]).contains(&at[x]))
    };
    let cells = (0..mesh.spec().cell_count()).map(|idx| mesh.spec().cell_at(idx));
    cells.filter(|&cell| inside(cell)).count()
}

#[test]
fn a_cube_less_a_triangle_is_as_full_as_a_cube() {
    let cube = Model::Box.mesh(None).unwrap();
    let full = cells_within_a_cube();
    assert!(full > 100);
    for missing in 0..12 {
        let open = without(&cube, missing);
        // Beside the hole half of the sky may be open: a cell is counted as it is for 16³ cells.
        assert_eq!(classes(&open)[0], full, "without triangle {missing}");
    }
}

#[test]
fn turned_over_it_is_inside_still_and_says_so() {
    let cube = Model::Box.mesh(None).unwrap();
    let open = without(&cube, 3);
    let turned = edited(&open, |t| t.iter_mut().for_each(|t| t.swap(0, 1)));
    let [interior, _, inward] = classes(&turned);
    // Nine in ten directions have to agree, so that cells beside the hole are left out.
    assert!(interior > cells_within_a_cube() / 2, "{interior}");
    assert_eq!(inward, interior);
    assert_eq!(classes(&open)[2], 0);
}

#[test]
fn repeated_triangles_are_one_surface() {
    let cube = Model::Box.mesh(None).unwrap();
    let open = without(&cube, 3);
    let twice = edited(&open, |triangles| triangles.extend_from_within(2..9));
    assert_eq!(classes(&twice), classes(&open));
    // A two-sided open cube is balanced all over, and still an open cube.
    let two_sided = edited(&open, |triangles| {
        let mut backs = triangles.clone();
        backs.iter_mut().for_each(|t| t.swap(0, 1));
        triangles.extend(backs);
    });
    assert_eq!(classes(&two_sided), classes(&open));
}

#[test]
fn a_sheet_has_no_inside_but_doubt() {
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 0.0, 1.0],
        [0.0, 0.0, 1.0],
    ];
    let sheet = mesh_of(corners.to_vec(), vec![[0, 2, 1], [0, 3, 2]]);
    let [interior, doubtful, _] = classes(&sheet);
    assert_eq!(interior, 0);
    assert!(doubtful > 0);
    let two_sided = edited(&sheet, |triangles| triangles.extend([[0, 1, 2], [0, 2, 3]]));
    assert_eq!(classes(&two_sided), classes(&sheet));
}

#[test]
fn contradictory_windings_leave_the_parity() {
    let torus = Model::Torus.mesh(None).unwrap();
    let open = with_holes(&torus, 50);
    let full = classes(&open);
    assert!(full[0] > 20, "{full:?}");
    for n in [2, 3, 5] {
        let turned = flipped(&open, n);
        let layers = prepared(&turned, [16; 3]).signed_layers().unwrap();
        assert!(!layers.winding_is_consistent());
        let [interior, ..] = classes(&turned);
        assert_eq!(interior, full[0], "every {n}. triangle flipped");
    }
}

#[test]
fn grids_beyond_the_sweep_have_layers_too() {
    let cube = Model::Box.mesh(None).unwrap();
    let open = without(&cube, 3);
    // The cells are within the cube, and so small that the sweep refuses.
    let placement = Placement {
        resolution: [8; 3],
        extent: Extent::HalfExtents([1e-4; 3]),
        snap: false,
    };
    let spec = placement.place(&open.bounds()).unwrap();
    assert!(PreparedMesh::new(&open, spec, [0.0; 3]).is_err());
    let layers = SignedLayers::around(&open, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
    assert!(layers.class([3, 4, 5], false).is_interior);
    // Needles.
    let placement = Placement {
        resolution: [8; 3],
        extent: Extent::HalfExtents([1.0, 1.0, 1e-3]),
        snap: false,
    };
    let spec = placement.place(&open.bounds()).unwrap();
    let layers = SignedLayers::around(&open, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
    assert!(layers.class([3, 3, 3], false).is_interior);
    assert!(!layers.class([0, 3, 3], false).is_interior);
}

#[test]
fn strict_comparisons_decide() {
    let class = |counts, winding| {
        let layers = SignedLayers {
            region: Region {
                cells: [0..1, 0..1, 0..1],
            },
            counts: vec![counts],
            winding,
        };
        let class = layers.class([0; 3], false);
        (class.is_interior, class.is_doubtful)
    };
    let counts = |positive, negative, odd| LayerCounts {
        positive,
        negative,
        odd,
    };
    let consistent =
        |positive, negative, odd| class(counts(positive, negative, odd), Winding::Consistent);
    assert_eq!(consistent(192, 0, 0), (false, true));
    assert_eq!(consistent(193, 0, 0), (true, true));
    assert_eq!(consistent(0, 345, 0), (false, false));
    assert_eq!(consistent(0, 346, 0), (true, false));
    assert_eq!(consistent(0, 0, 346), (true, false));
    assert_eq!(consistent(96, 0, 0), (false, false));
    assert_eq!(consistent(0, 0, 97), (false, true));
    assert_eq!(consistent(0, 288, 0), (false, false));
    let contradictory = |odd| class(counts(0, 0, odd), Winding::Contradictory);
    assert_eq!(
        (contradictory(192), contradictory(193)),
        ((false, true), (true, true))
    );
}
