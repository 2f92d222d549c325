//! The builder that assembles models from basic shapes.

use std::f64::consts::TAU;

use crate::TriangleMesh;
use crate::mesh::Part;

/// Steps per unit to which coordinates are rounded, so that models are identical on machines whose
/// sines differ in the last bits.
const STEPS_PER_UNIT: f64 = 1e6;

/// A model under construction. Triangles wind counter-clockwise seen from outside.
#[derive(Default)]
pub(super) struct Builder {
    pub positions: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// The index of each triangle's part.
    pub part_of: Vec<u32>,
    parts: Vec<String>,
}

/// A circle of a tube, in a plane perpendicular to the tube's axis.
pub(super) struct Ring {
    pub center: [f64; 3],
    pub radius: f64,
}

impl Builder {
    /// Begins a new part, to which the following triangles belong.
    pub(super) fn part(&mut self, name: &str) -> &mut Self {
        self.parts.push(name.to_owned());
        self
    }

    pub(super) fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    pub(super) fn vertex(&mut self, position: [f64; 3]) -> u32 {
        self.positions.push(position);
        self.positions.len() as u32 - 1
    }

    pub(super) fn triangle(&mut self, corners: [u32; 3]) {
        self.triangles.push(corners);
        self.part_of.push(self.parts.len() as u32 - 1);
    }

    /// Adds a planar quad, corners counter-clockwise.
    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// Adds an axis-aligned box.
    pub(super) fn cuboid(&mut self, min: [f64; 3], max: [f64; 3]) -> &mut Self {
        let corner = |bits: usize| std::array::from_fn(|x| [min[x], max[x]][bits >> x & 1]);
        self.hexahedron(std::array::from_fn(corner))
    }

    /// Adds a hexahedron. Bit x of a corner's index tells whether it lies at the upper end of axis
    /// x.
    pub(super) fn hexahedron(&mut self, corners: [[f64; 3]; 8]) -> &mut Self {
        let v = corners.map(|corner| self.vertex(corner));
        let faces = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        for face in faces {
            self.quad(face.map(|corner| v[corner]));
        }
        self
    }

    /// Adds a surface over `rings` of `sides` corners, closed at both ends by fans. All rings are
    /// perpendicular to the line from the first center to the last; none has radius zero.
    pub(super) fn tube(&mut self, rings: &[Ring], sides: u32) -> &mut Self {
        let (first, last) = (&rings[0], &rings[rings.len() - 1]);
        let axis: [f64; 3] = std::array::from_fn(|x| last.center[x] - first.center[x]);
        let [u, v] = perpendicular(axis);
        let starts: Vec<u32> = rings
            .iter()
            .map(|ring| {
                let start = self.positions.len() as u32;
                for side in 0..sides {
                    let (sin, cos) = (TAU * f64::from(side) / f64::from(sides)).sin_cos();
                    self.vertex(std::array::from_fn(|x| {
                        ring.center[x] + ring.radius * (cos * u[x] + sin * v[x])
                    }));
                }
                start
            })
            .collect();
        // Quads between neighboring rings.
        for pair in starts.windows(2) {
            for side in 0..sides {
                let next = (side + 1) % sides;
                self.quad([
                    pair[0] + side,
                    pair[0] + next,
                    pair[1] + next,
                    pair[1] + side,
                ]);
            }
        }
        let (bottom, top) = (starts[0], starts[starts.len() - 1]);
        for side in 1..sides - 1 {
            self.triangle([bottom, bottom + side + 1, bottom + side]);
            self.triangle([top, top + side, top + side + 1]);
        }
        self
    }

    /// Adds a sheet of `n[0]` × `n[1]` quads with corners `at` (i, j): counter-clockwise if i goes
    /// right and j goes up. Quads that are `open` are left out. Sheets share vertices.
    pub(super) fn panel(
        &mut self,
        n: [usize; 2],
        at: impl Fn(usize, usize) -> [f64; 3],
        open: impl Fn(usize, usize) -> bool,
    ) -> &mut Self {
        let quads = (0..n[1]).flat_map(|j| (0..n[0]).map(move |i| (i, j)));
        for (i, j) in quads.filter(|&(i, j)| !open(i, j)) {
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let vertices = corners.map(|(i, j)| self.shared_vertex(at(i, j)));
            self.quad(vertices);
        }
        self
    }

    /// Returns the vertex at a position, and adds one if there is none.
    pub(super) fn shared_vertex(&mut self, position: [f64; 3]) -> u32 {
        let near = |p: &[f64; 3]| (0..3).all(|x| (p[x] - position[x]).abs() * STEPS_PER_UNIT < 0.5);
        match self.positions.iter().position(near) {
            Some(idx) => idx as u32,
            None => self.vertex(position),
        }
    }

    /// Adds a tube between two points.
    pub(super) fn limb(&mut self, from: [f64; 3], to: [f64; 3], radii: [f64; 2]) -> &mut Self {
        let ring = |center, radius| Ring { center, radius };
        self.tube(&[ring(from, radii[0]), ring(to, radii[1])], 8)
    }

    /// Returns the finished mesh, its triangles sorted by part.
    pub(super) fn finish(self) -> TriangleMesh {
        let positions = self
            .positions
            .iter()
            .map(|p| p.map(|v| ((v * STEPS_PER_UNIT).round() / STEPS_PER_UNIT) as f32))
            .collect();
        let mut order: Vec<usize> = (0..self.triangles.len()).collect();
        order.sort_by_key(|&t| self.part_of[t]);
        let triangles = order.iter().map(|&t| self.triangles[t]).collect();
        let ends = (0..self.parts.len() as u32)
            .map(|part| order.partition_point(|&t| self.part_of[t] <= part));
        let mut start = 0;
        let parts = self
            .parts
            .iter()
            .zip(ends)
            .map(|(name, end)| Part {
                name: name.clone(),
                triangles: std::mem::replace(&mut start, end)..end,
            })
            .collect();
        TriangleMesh::new(positions, triangles, parts).expect("models are valid meshes")
    }
}

/// Returns two unit vectors u and v perpendicular to w; u, v, w are right-handed.
fn perpendicular(w: [f64; 3]) -> [[f64; 3]; 2] {
    let smallest = (0..3)
        .min_by(|&a, &b| w[a].abs().total_cmp(&w[b].abs()))
        .expect("there are three axes");
    let mut axis = [0.0; 3];
    axis[smallest] = 1.0;
    let u = normalized(cross(axis, w));
    [u, normalized(cross(w, u))]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn normalized(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}
