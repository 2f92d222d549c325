// Whether a ray meets a triangle: over a tree without a stack, watertight between triangles
// that share an edge.
//
// Coordinates are whole steps of a lattice so fine that single floats would not hold them:
// differences from a ray's origin are taken first, and rounded once.

struct Scene {
    /// Cells of the grid along x, y and z.
    cells: vec3<u32>,
    /// Directions a cell.
    n_directions: u32,
    /// The first cell of this piece of the grid, and how many it has.
    first_cell: u32,
    n_cells: u32,
    n_nodes: u32,
    /// Occluders farther than this do not count, in lattice steps.
    reach: f32,
    /// Of random directions: the generator's key.
    key: array<vec4<u32>, 2>,
    n_triangles: u32,
}

/// A box, padded, and where to go on.
struct Node {
    low: vec3<f32>,
    /// The node that follows if the ray misses the box, or after a leaf.
    skip: u32,
    high: vec3<f32>,
    /// Of a leaf: its first triangle, and how many from bit 28 on; else all ones. Then the next
    /// node is the first child.
    triangles: u32,
}

/// The bake.
@group(0) @binding(1) var<uniform> scene: Scene;
/// In the order of a walk that visits everything.
@group(0) @binding(2) var<storage, read> nodes: array<Node>;
/// Nine numbers a triangle, in the order of the leaves.
@group(0) @binding(3) var<storage, read> corners: array<i32>;
/// Where samples lie: of all x, then all y, then all z.
@group(0) @binding(4) var<storage, read> samples: array<i32>;

struct Ray {
    origin: vec3<i32>,
    direction: vec3<f32>,
    /// The direction's largest component is made the last: x, y, z become y, z, x (0),
    /// z, x, y (1) or stay (2).
    turn: u32,
    /// The other two over it, and one over it.
    shear: vec2<f32>,
    inverse: f32,
    /// In lengths of the direction.
    reach: f32,
}

fn sample_of(cell: u32) -> vec3<i32> {
    let n = scene.cells;
    let x = cell % n.x;
    let y = (cell / n.x) % n.y;
    let z = cell / (n.x * n.y);
    return vec3(samples[x], samples[n.x + y], samples[n.x + n.y + z]);
}

fn turned(v: vec3<f32>, turn: u32) -> vec3<f32> {
    return select(select(v, v.zxy, turn == 1u), v.yzx, turn == 0u);
}

/// `length` is that of the direction.
fn ray_from(origin: vec3<i32>, direction: vec3<f32>, length: f32) -> Ray {
    let size = abs(direction);
    var turn = select(2u, 1u, size.y >= size.z);
    turn = select(turn, 0u, size.x >= size.y && size.x >= size.z);
    let along = turned(direction, turn);
    let inverse = 1.0 / along.z;
    return Ray(origin, direction, turn, along.xy * inverse, inverse, scene.reach / length);
}

/// A corner as the ray sees it: across (twice), and along.
fn sheared(ray: Ray, corner: u32) -> vec3<f32> {
    let steps = vec3(corners[corner], corners[corner + 1u], corners[corner + 2u]) - ray.origin;
    let v = turned(vec3<f32>(steps), ray.turn);
    return vec3(v.xy - ray.shear * v.z, v.z);
}

/// Twice the area that the ray's point spans with an edge. From the difference of its ends and
/// their sum: then an edge run the other way gives exactly the opposite, fused or not.
fn area(p: vec3<f32>, q: vec3<f32>) -> f32 {
    let along = q.xy - p.xy;
    let sum = p.xy + q.xy;
    return along.y * sum.x - along.x * sum.y;
}

fn meets(ray: Ray, triangle: u32) -> bool {
    let a = sheared(ray, 9u * triangle);
    let b = sheared(ray, 9u * triangle + 3u);
    let c = sheared(ray, 9u * triangle + 6u);
    let u = area(b, c);
    let v = area(c, a);
    let w = area(a, b);
    let is_negative = u < 0.0 || v < 0.0 || w < 0.0;
    let is_positive = u > 0.0 || v > 0.0 || w > 0.0;
    if is_negative == is_positive {
        // Outside; or the triangle is seen edge-on, and its neighbours decide.
        return false;
    }
    let whole = u + v + w;
    let along = ray.inverse * (u * a.z + v * b.z + w * c.z);
    let distance = select(-along, along, whole > 0.0);
    return distance > 0.0 && distance <= ray.reach * abs(whole);
}

fn is_hidden(ray: Ray) -> bool {
    // Zero has no inverse.
    let direction = select(ray.direction, vec3(LEAST_SLOPE), abs(ray.direction) < vec3(LEAST_SLOPE));
    let inverse = 1.0 / direction;
    let origin = vec3<f32>(ray.origin);
    var next = 0u;
    while next < scene.n_nodes {
        let node = nodes[next];
        let low = (node.low - origin) * inverse;
        let high = (node.high - origin) * inverse;
        let enter = min(low, high);
        let leave = max(low, high);
        let first = max(max(enter.x, enter.y), max(enter.z, 0.0));
        let last = min(min(leave.x, leave.y), min(leave.z, ray.reach * BOX_SLACK));
        if first > last * BOX_SLACK {
            next = node.skip;
        } else if node.triangles == INNER {
            next++;
        } else {
            let start = node.triangles & FIRST_TRIANGLE;
            let end = start + (node.triangles >> TRIANGLE_BITS);
            for (var triangle = start; triangle < end; triangle++) {
                if meets(ray, triangle) {
                    return true;
                }
            }
            next = node.skip;
        }
    }
    return false;
}
