//! The measured kernels: compute shaders that shade a pixel with one occluder or several.

use aogrid_runtime::wgsl::{ENVIRONMENT, SHADING, VOLUMES, tiled_pass};

const NAIVE: &str = include_str!("naive.wgsl");

/// The bindings of all kernels. Each pass reads its own row of the G-buffer and its own occluder,
/// so that the compiler cannot share reads between passes.
const BINDINGS: &str = "
@group(0) @binding(0) var positions: texture_2d<f32>;
@group(0) @binding(1) var normals: texture_2d<f32>;
@group(0) @binding(2) var grid: texture_3d<f32>;
@group(0) @binding(3) var table: texture_2d<f32>;
@group(0) @binding(4) var linear_clamp: sampler;
@group(0) @binding(5) var result: texture_storage_2d<r32float, write>;
@group(0) @binding(7) var overlaps: texture_3d<f32>;
";

/// A compute shader to measure.
pub(super) struct Kernel {
    pub(super) name: String,
    pub(super) wgsl: String,
    pub(super) entry_point: String,
    /// Values of the shader's `override` constants.
    pub(super) constants: Vec<(&'static str, f64)>,
}

/// A shader's code for one occluder, repeated to measure the cost of one more occluder.
pub(super) struct Pass {
    pub(super) name: &'static str,
    /// Type of the occluder's uniform.
    occluder: &'static str,
    /// Expression of the transmittance; `o`, `p` and `n` are the occluder, the position and the
    /// normal. If the expression contains `left`, that is the accumulated occlusion so far, and the
    /// expression is the new one.
    transmittance: &'static str,
}

/// The marker for an occluder that every lane chooses from a storage buffer, as instanced draws do,
/// instead of one uniform.
const PER_LANE: &str = "";

/// The library's shaders beside those that the papers print.
pub(super) const PASSES: [Pass; 16] = [
    Pass {
        name: "occlusion, RR-5779 as printed",
        occluder: "Naive",
        transmittance: "naive_occlusion(o, p)",
    },
    Pass {
        name: "occlusion",
        occluder: "AogridOccluder",
        transmittance: "aogrid_occlusion_transmittance(textureSampleLevel(grid, linear_clamp, \
                        aogrid_grid_position(o, p), 0.0).r, false)",
    },
    Pass {
        name: "occlusion, box test, strength",
        occluder: "AogridOccluder",
        transmittance: "aogrid_occlusion(o, grid, linear_clamp, p, false)",
    },
    Pass {
        name: "cone, RR-5779 as printed",
        occluder: "Naive",
        transmittance: "naive_cone(o, p, n)",
    },
    Pass {
        name: "cone",
        occluder: "AogridOccluder",
        transmittance: "cone_without_strength(o, p, n)",
    },
    Pass {
        name: "soft cone, strength",
        occluder: "AogridOccluder",
        transmittance: "aogrid_cone_faded(o, grid, table, linear_clamp, p, n)",
    },
    Pass {
        name: "cone, box test",
        occluder: "AogridOccluder",
        transmittance: "cone_with_box_test(o, p, n)",
    },
    Pass {
        name: "soft cone, box test, strength",
        occluder: "AogridOccluder",
        transmittance: "soft_cone_in_its_box(o, p, n)",
    },
    Pass {
        name: "soft cone, far field, strength",
        occluder: "AogridOccluder",
        transmittance: "aogrid_cone(o, grid, table, linear_clamp, p, n)",
    },
    Pass {
        name: "the same on the object itself",
        occluder: "AogridOccluder",
        transmittance: "aogrid_cone_on_itself(o, grid, table, linear_clamp, p, n)",
    },
    Pass {
        name: "soft cone, strength, one per lane",
        occluder: PER_LANE,
        transmittance: "aogrid_cone_faded(o, grid, table, linear_clamp, p, n)",
    },
    Pass {
        name: "cone and axis, multiplied",
        occluder: "AogridOccluder",
        transmittance: "cone_and_axis(left, o, p, n)",
    },
    Pass {
        name: "cones merged",
        occluder: "AogridOccluder",
        transmittance: "aogrid_merge_cone(left, o, grid, table, overlaps, linear_clamp, p, n)",
    },
    Pass {
        name: "cone, closed form",
        occluder: "AogridOccluder",
        transmittance: "cone_in_closed_form(o, p, n)",
    },
    Pass {
        name: "volume of a triangle",
        occluder: "VolumeTriangle",
        transmittance: "1.0 - aogrid_volume_occlusion(o.volume, o.a.xyz - p, o.b.xyz - p, o.c.xyz - p, \
                        n)",
    },
    Pass {
        name: "form factor of a triangle",
        occluder: "VolumeTriangle",
        transmittance: "1.0 - aogrid_form_factor(aogrid_above_horizon(o.a.xyz - p, o.b.xyz - p, \
                        o.c.xyz - p, n), n)",
    },
];

/// Combinations of the library's functions without strength, which the printed shaders lack.
const PARTS: &str = "
struct VolumeTriangle { a: vec4f, b: vec4f, c: vec4f, volume: AogridVolume }
fn cone_of(o: AogridOccluder, p_grid: vec3f, n: vec3f) -> f32 {
    let texel = textureSampleLevel(grid, linear_clamp, p_grid, 0.0);
    let cos_beta = aogrid_cos_beta(aogrid_axis(o, texel.rgb), n);
    return aogrid_clip_transmittance(table, linear_clamp, texel.a, cos_beta);
}
fn cone_without_strength(o: AogridOccluder, p: vec3f, n: vec3f) -> f32 {
    return cone_of(o, aogrid_grid_position(o, p), n);
}
fn cone_with_box_test(o: AogridOccluder, p: vec3f, n: vec3f) -> f32 {
    let lookup = aogrid_lookup(o, p);
    return select(1.0, cone_of(o, lookup.position, n), lookup.is_reached);
}
fn soft_cone_in_its_box(o: AogridOccluder, p: vec3f, n: vec3f) -> f32 {
    let found = aogrid_lookup(o, p);
    let lookup = AogridLookup(found.position, found.is_reached, vec3f(), 1.0, 1.0, 0.0);
    let t = aogrid_cone_at(o, grid, table, linear_clamp, lookup, n);
    return select(1.0, t, lookup.is_reached);
}
fn cone_and_axis(left: vec4f, o: AogridOccluder, p: vec3f, n: vec3f) -> vec4f {
    let lookup = aogrid_lookup(o, p);
    if !lookup.is_reached {
        return left;
    }
    let one = aogrid_cone_with_axis_at(o, grid, table, linear_clamp, lookup, n);
    return aogrid_multiply(left, one);
}
fn chosen(id: vec2u) -> u32 {
    return id.x & 15u;
}
fn cone_in_closed_form(o: AogridOccluder, p: vec3f, n: vec3f) -> f32 {
    let texel = textureSampleLevel(grid, linear_clamp, aogrid_grid_position(o, p), 0.0);
    let cos_beta = aogrid_cos_beta(aogrid_axis(o, texel.rgb), n);
    return aogrid_clip_transmittance_closed_form(texel.a, cos_beta);
}
";

/// Returns the kernels of the tiled pass: gathering, and shading, whose loop over occluders counts
/// once.
pub(super) fn tiled() -> [Kernel; 4] {
    let kernel = |name: &str, entry_point: &str, format, shading, writes_axis| Kernel {
        name: name.to_owned(),
        wgsl: tiled_pass(format),
        entry_point: entry_point.to_owned(),
        constants: vec![
            ("shading", shading),
            ("writes_axis", writes_axis),
            ("grids_hold_cones", 1.0),
            ("positions_are_depths", 0.0),
            ("normal_scale", 2.0),
            ("normal_offset", -1.0),
            ("receiver_channels", 0.0),
        ],
    };
    let shade = "shade_pixels";
    [
        kernel("tiles: gathering", "gather_tile", "r32float", 1.0, 0.0),
        kernel("tiles: cones multiplied", shade, "r32float", 1.0, 0.0),
        kernel("tiles: cones and axes", shade, "rgba16float", 2.0, 1.0),
        kernel("tiles: cones merged", shade, "rgba16float", 3.0, 1.0),
    ]
}

impl Pass {
    /// Returns a kernel with the pass repeated `count` times.
    pub(super) fn repeated(&self, count: u32) -> Kernel {
        let (buffer, index) = match self.occluder {
            PER_LANE => (
                "var<storage, read> occluders: array<AogridOccluder>".to_owned(),
                "chosen(id.xy) + ",
            ),
            uniform => (
                format!("var<uniform> occluders: array<{uniform}, {count}>"),
                "",
            ),
        };
        let is_running = self.transmittance.contains("left");
        let (step, written) = match is_running {
            true => (
                format!("left = {};", self.transmittance),
                "vec4f(dot(left, vec4f(1.0)))",
            ),
            false => (format!("t *= {};", self.transmittance), "vec4f(t)"),
        };
        let mut body = String::new();
        for idx in 0..count {
            body += &format!(
                "    {{
        let at = id.xy + vec2u(0u, {idx}u);
        let o = occluders[{index}{idx}u];
        let p = textureLoad(positions, at, 0).xyz;
        let n = fma(textureLoad(normals, at, 0).xyz, vec3f(2.0), vec3f(-1.0));
        {step}
    }}\n"
            );
        }
        let entry = format!(
            "@group(0) @binding(6) {buffer};
@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3u) {{
    var t = 1.0;
    var left = vec4f(0.0, 0.0, 0.0, 1.0);
{body}    textureStore(result, id.xy, {written});
}}\n"
        );
        Kernel {
            name: self.name.to_owned(),
            wgsl: [SHADING, VOLUMES, BINDINGS, NAIVE, PARTS, &entry].concat(),
            entry_point: "shade".to_owned(),
            constants: vec![],
        }
    }
}

/// The bindings of kernels for environment light.
const LIGHT_BINDINGS: &str = "
struct Frame { environment: AogridEnvironment, eye: vec4f, lobe: vec4f }
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var positions: texture_2d<f32>;
@group(0) @binding(2) var normals: texture_2d<f32>;
@group(0) @binding(3) var occlusion: texture_2d<f32>;
@group(0) @binding(4) var map: texture_2d<f32>;
@group(0) @binding(5) var map_sampler: sampler;
@group(0) @binding(6) var result: texture_storage_2d<rgba16float, write>;
";

/// Lighting of a pixel after its occluders have been accumulated: name and expression.
const LIGHTS: [[&str; 2]; 3] = [
    [
        "irradiance times 1 - AO",
        "hidden.w * aogrid_irradiance(frame.environment, map, map_sampler, n)",
    ],
    [
        "environment, diffuse",
        "aogrid_lambertian(frame.environment, map, map_sampler, hidden, n)",
    ],
    [
        "environment, glossy",
        "aogrid_glossy(frame.environment, map, map_sampler, hidden, n,
             aogrid_mirrored(frame.eye, textureLoad(positions, id.xy, 0).xyz, n), frame.lobe.x)",
    ],
];

/// Returns the kernels that run once a pixel after all occluders.
pub(super) fn lights() -> impl Iterator<Item = Kernel> {
    LIGHTS.into_iter().map(|[name, light]| {
        let entry = format!(
            "@compute @workgroup_size(8, 8)
fn light(@builtin(global_invocation_id) id: vec3u) {{
    let hidden = textureLoad(occlusion, id.xy, 0);
    let n = fma(textureLoad(normals, id.xy, 0).xyz, vec3f(2.0), vec3f(-1.0));
    textureStore(result, id.xy, vec4f({light}, 1.0));
}}\n"
        );
        Kernel {
            name: name.to_owned(),
            wgsl: [SHADING, ENVIRONMENT, LIGHT_BINDINGS, &entry].concat(),
            entry_point: "light".to_owned(),
            constants: vec![],
        }
    })
}
