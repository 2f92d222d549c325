// An any-hit query: whether a ray is occluded. The BVH is traversed without a stack; the
// intersection test is watertight between triangles that share an edge.
//
// Coordinates are integer steps of a lattice that is too fine for single floats. Differences from
// the ray's origin are taken in integers and rounded once.

struct Scene {
    /// Cells of the grid along x, y and z.
    cells: vec3<u32>,
    /// Directions per cell.
    n_directions: u32,
    /// The first cell of this dispatch, and the number of cells.
    first_cell: u32,
    n_cells: u32,
    n_nodes: u32,
    /// The maximum distance of an occluder, in lattice steps.
    max_distance: f32,
    /// The generator's key, for Monte Carlo directions.
    key: array<vec4<u32>, 2>,
    n_triangles: u32,
}

/// A node of the BVH, with a padded box.
struct Node {
    low: vec3<f32>,
    /// The next node if the ray misses the box, or after a leaf.
    skip: u32,
    high: vec3<f32>,
    /// The first triangle of a leaf in bits 0–27, and the number of its triangles from bit 28 on.
    /// All ones for an inner node, whose first child is the following node.
    triangles: u32,
}

/// The uniforms of the dispatch.
@group(0) @binding(1) var<uniform> scene: Scene;
/// The nodes of the BVH in depth-first order.
@group(0) @binding(2) var<storage, read> nodes: array<Node>;
/// Nine coordinates per triangle, in the order of the leaves.
@group(0) @binding(3) var<storage, read> corners: array<i32>;
/// The sample positions of the cells: all x, then all y, then all z.
@group(0) @binding(4) var<storage, read> samples: array<i32>;

struct Ray {
    origin: vec3<i32>,
    direction: vec3<f32>,
    /// The cyclic permutation that makes the direction's largest component the last: x, y, z become
    /// y, z, x (0), z, x, y (1) or stay as they are (2).
    permutation: u32,
    /// The other two components divided by the largest one, and the reciprocal of the largest.
    shear: vec2<f32>,
    inverse: f32,
    /// The maximum distance in lengths of the direction.
    max_t: f32,
}

/// The sample position of a cell.
fn sample_position(cell: u32) -> vec3<i32> {
    let n = scene.cells;
    let x = cell % n.x;
    let y = (cell / n.x) % n.y;
    let z = cell / (n.x * n.y);
    return vec3(samples[x], samples[n.x + y], samples[n.x + n.y + z]);
}

fn permuted(v: vec3<f32>, permutation: u32) -> vec3<f32> {
    return select(select(v, v.zxy, permutation == 1u), v.yzx, permutation == 0u);
}

/// A ray from a direction and its length.
fn ray_from(origin: vec3<i32>, direction: vec3<f32>, length: f32) -> Ray {
    let size = abs(direction);
    var permutation = select(2u, 1u, size.y >= size.z);
    permutation = select(permutation, 0u, size.x >= size.y && size.x >= size.z);
    let d = permuted(direction, permutation);
    let inverse = 1.0 / d.z;
    return Ray(origin, direction, permutation, d.xy * inverse, inverse, scene.max_distance / length);
}

/// A triangle corner in the ray's frame, sheared so that the ray is the z axis.
fn sheared(ray: Ray, corner: u32) -> vec3<f32> {
    let steps = vec3(corners[corner], corners[corner + 1u], corners[corner + 2u]) - ray.origin;
    let v = permuted(vec3<f32>(steps), ray.permutation);
    return vec3(v.xy - ray.shear * v.z, v.z);
}

/// The edge function: twice the signed area between the ray's point (0, 0) and an edge, computed
/// from the difference and the sum of its ends. The opposite edge thus gives exactly the negative
/// value, with or without fused multiply-add.
fn edge_function(p: vec3<f32>, q: vec3<f32>) -> f32 {
    let edge = q.xy - p.xy;
    let sum = p.xy + q.xy;
    return edge.y * sum.x - edge.x * sum.y;
}

/// Whether a ray intersects a triangle. The test follows S. Woop, C. Benthin, I. Wald, Watertight
/// Ray/Triangle Intersection (JCGT 2, 2013).
fn intersects(ray: Ray, triangle: u32) -> bool {
    let a = sheared(ray, 9u * triangle);
    let b = sheared(ray, 9u * triangle + 3u);
    let c = sheared(ray, 9u * triangle + 6u);
    let u = edge_function(b, c);
    let v = edge_function(c, a);
    let w = edge_function(a, b);
    let is_negative = u < 0.0 || v < 0.0 || w < 0.0;
    let is_positive = u > 0.0 || v > 0.0 || w > 0.0;
    if is_negative == is_positive {
        // Outside; or the triangle is seen edge-on, and its neighbors decide.
        return false;
    }
    let det = u + v + w;
    // The distance is scaled by |det|, so that no division is needed.
    let scaled_t = ray.inverse * (u * a.z + v * b.z + w * c.z);
    let distance = select(-scaled_t, scaled_t, det > 0.0);
    return distance > 0.0 && distance <= ray.max_t * abs(det);
}

/// Whether a ray hits any triangle within the maximum distance.
fn is_occluded(ray: Ray) -> bool {
    // Avoid a division by zero.
    let direction = select(ray.direction, vec3(MIN_COMPONENT), abs(ray.direction) < vec3(MIN_COMPONENT));
    let inverse = 1.0 / direction;
    let origin = vec3<f32>(ray.origin);
    var next = 0u;
    while next < scene.n_nodes {
        let node = nodes[next];
        // Slab test of the box.
        let low = (node.low - origin) * inverse;
        let high = (node.high - origin) * inverse;
        let enter = min(low, high);
        let leave = max(low, high);
        let first = max(max(enter.x, enter.y), max(enter.z, 0.0));
        let last = min(min(leave.x, leave.y), min(leave.z, ray.max_t * BOX_SLACK));
        if first > last * BOX_SLACK {
            next = node.skip;
        } else if node.triangles == INNER_NODE {
            next++;
        } else {
            let start = node.triangles & FIRST_TRIANGLE_MASK;
            let end = start + (node.triangles >> TRIANGLE_BITS);
            for (var triangle = start; triangle < end; triangle++) {
                if intersects(ray, triangle) {
                    return true;
                }
            }
            next = node.skip;
        }
    }
    return false;
}
