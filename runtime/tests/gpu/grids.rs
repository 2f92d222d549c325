use aogrid_grid_format::{
    BakeRecord, Boundary, BoundaryMode, Encoding, Grid, GridSpec, Interior, Sampling, Source,
    TexelFormat,
};

/// The radius of the occluding ball of [`ball`].
pub const RADIUS: f32 = 0.5;

/// Cells per axis, all different so that swapped axes are detected.
pub const RESOLUTION: [u32; 3] = [16, 20, 24];

/// Returns a box around the ball: off-center, with different extents.
pub fn spec() -> GridSpec {
    GridSpec::new(RESOLUTION, [0.1, -0.2, 0.05], [1.4, 1.6, 1.5]).expect("a box")
}

/// Returns another box around the same ball, with other cells.
pub fn other_spec() -> GridSpec {
    GridSpec::new([24, 13, 18], [-0.1, 0.1, 0.0], [1.5, 1.3, 1.4]).expect("a box")
}

/// Returns the exact cones of a ball around the origin. Inside the ball the fraction grows further,
/// to 1 at its center.
pub fn ball(encoding: Encoding, format: TexelFormat) -> Grid {
    ball_in(spec(), encoding, format)
}

pub fn ball_in(spec: GridSpec, encoding: Encoding, format: TexelFormat) -> Grid {
    grid(spec, encoding, format, |p| {
        let inside = (1.0 - length(p) / RADIUS).max(0.0);
        let outside = (RADIUS / length(p)).min(1.0);
        let a = (1.0 - (1.0 - outside * outside).sqrt() + inside) / 2.0;
        let d = p.map(|x| -x / length(p).max(1e-6));
        [d[0], d[1], d[2], a]
    })
}

/// Returns the grid of [`ball`], faded so that all outer cells are unoccluded (RR-5779, 3.3.2).
pub fn faded_ball(format: TexelFormat) -> Grid {
    faded_ball_in(spec(), format)
}

pub fn faded_ball_in(spec: GridSpec, format: TexelFormat) -> Grid {
    let plain = ball_in(spec, Encoding::Cone, TexelFormat::F32);
    let outer = (0..spec.cell_count()).filter(|&idx| spec.is_outer(spec.cell_at(idx)));
    let largest = outer.map(|idx| plain.cell(idx)[3]).fold(0.0, f32::max);
    let cells: Vec<_> = (0..spec.cell_count())
        .map(|idx| {
            let [x, y, z, a] = plain.cell(idx);
            [x, y, z, ((a - largest) / (1.0 - largest)).max(0.0)]
        })
        .collect();
    Grid::encode(spec, Encoding::Cone, format, &cells, record()).expect("a grid")
}

/// Returns the same grid of an object that is flat along y, so that its far field reaches farther along
/// y than along the other axes.
pub fn flattened(grid: &Grid) -> Grid {
    let cells: Vec<_> = (0..grid.spec().cell_count())
        .map(|idx| grid.cell(idx))
        .collect();
    let record = BakeRecord {
        flatness: [-1.0, 0.9, 0.5, 0.1],
        ..grid.record().clone()
    };
    Grid::encode(*grid.spec(), grid.encoding(), grid.format(), &cells, record).expect("a grid")
}

fn grid(
    spec: GridSpec,
    encoding: Encoding,
    format: TexelFormat,
    cone: impl Fn([f32; 3]) -> [f32; 4],
) -> Grid {
    let cells: Vec<_> = (0..spec.cell_count())
        .map(|idx| {
            let p = spec.sample_from_center(spec.cell_at(idx), [0.0; 3]);
            cone(std::array::from_fn(|x| spec.center()[x] + p[x] as f32))
        })
        .collect();
    let record = BakeRecord {
        self_offset: if encoding == Encoding::Moment {
            0.25
        } else {
            0.0
        },
        ..record()
    };
    Grid::encode(spec, encoding, format, &cells, record).expect("a grid")
}

pub fn length(v: [f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

fn record() -> BakeRecord {
    BakeRecord {
        epsilon: None,
        sample_offset: [0.0; 3],
        sampling: Sampling::CubeFaces { size: 16 },
        max_distance: None,
        interior: Interior::Enclosed,
        interior_cells: 0,
        inside: None,
        snap: false,
        fit: false,
        without: vec![],
        self_offset: 0.0,
        flatness: [0.0; 4],
        check: None,
        boundary: Boundary {
            requested: BoundaryMode::None,
            applied: BoundaryMode::None,
            v_m: 0.0,
        },
        source: Source {
            name: "ball".into(),
            part: None,
            blake3: "0".repeat(64),
            triangles: 1,
        },
    }
}
