//! The ray casting kernels: their sources with generated constants, and their bindings.

use super::{Variant, tree};
use crate::kernel::{Binding, Kernel};
use crate::shaders::{Constants, Shader, WORKGROUP};

/// The largest number of texels per workgroup: those of six faces of 16². Mesa's software
/// rasterizer silently stops the loops of an invocation after 65,535 iterations in total. An
/// invocation has 24 texels, and no texel's traversal comes near a 24th of that.
pub(super) const TEXELS_PER_WORKGROUP: u32 = 1536;

/// The numbers per cell with cube faces: the count, a, and the three components of m.
pub(super) const FACE_SUMS: usize = 5;

/// The numbers per cell with Monte Carlo directions: the count and three sums of two words.
pub(super) const MONTE_CARLO_SUMS: usize = 7;

pub(super) fn compile(device: &wgpu::Device, variant: Variant, directions: bool) -> Kernel {
    use Binding::{Read, Uniform, Write};
    let bindings: &[Binding] = match variant {
        Variant::MonteCarlo => &[Uniform, Read, Read, Read, Write],
        Variant::Naive => &[Uniform, Read, Read, Read, Read, Read, Write],
        _ => &[Uniform, Read, Read, Read, Read, Read, Write, Write],
    };
    Kernel::new(device, &shader(variant, directions), bindings)
}

/// Returns the sources of all kernels, in every variant.
pub(crate) fn shaders() -> Vec<Shader> {
    vec![
        shader(Variant::Faces, true),
        shader(Variant::Faces, false),
        shader(Variant::FacesWithBits, true),
        shader(Variant::MonteCarlo, true),
        shader(Variant::MonteCarlo, false),
        shader(Variant::Naive, true),
        points(),
    ]
}

/// Compiles the kernel of points on surfaces.
pub(super) fn compile_points(device: &wgpu::Device) -> Kernel {
    use Binding::{Read, Uniform, Write};
    let bindings = [Uniform, Read, Read, Read, Read, Read, Write];
    Kernel::new(device, &points(), &bindings)
}

fn points() -> Shader {
    let constants = constants().unsigned("RAYS_PER_WORKGROUP", TEXELS_PER_WORKGROUP);
    let parts = [
        include_str!("../chunk.wgsl"),
        include_str!("any_hit.wgsl"),
        include_str!("points.wgsl"),
    ];
    Shader {
        name: "rays: points",
        source: constants.before(&parts),
        entry_point: "points",
    }
}

/// The constants of all kernels.
fn constants() -> Constants {
    Constants::default()
        .unsigned("WORKGROUP", WORKGROUP)
        .unsigned("INNER_NODE", tree::INNER_NODE)
        .unsigned("TRIANGLE_BITS", tree::TRIANGLE_BITS)
        .unsigned("FIRST_TRIANGLE_MASK", (1 << tree::TRIANGLE_BITS) - 1)
        // A smaller component moves a ray by less than the boxes' padding over its whole length.
        .float("MIN_COMPONENT", 1e-12)
        // Two products and a difference, each half a step of 2⁻²³; doubled for safety.
        .float("BOX_SLACK", 1.0 + 1.0 / (1 << 20) as f32)
}

fn shader(variant: Variant, directions: bool) -> Shader {
    let constants = constants().boolean("WITH_DIRECTIONS", directions);
    let chunk = include_str!("../chunk.wgsl");
    let any_hit = include_str!("any_hit.wgsl");
    let name = match (variant, directions) {
        (Variant::Faces, true) => "rays: faces",
        (Variant::Faces, false) => "rays: faces without directions",
        (Variant::FacesWithBits, _) => "rays: faces with bits",
        (Variant::MonteCarlo, true) => "rays: Monte Carlo",
        (Variant::MonteCarlo, false) => "rays: Monte Carlo without directions",
        (Variant::Naive, _) => "naive",
    };
    if variant == Variant::MonteCarlo {
        let parts = [
            chunk,
            any_hit,
            include_str!("../sweep/integers.wgsl"),
            include_str!("monte_carlo.wgsl"),
        ];
        let constants = constants
            .unsigned("SUMS", MONTE_CARLO_SUMS as u32)
            .float("PRODUCT_ROUNDING", 1.0);
        return Shader {
            name,
            source: constants.before(&parts),
            entry_point: "monte_carlo",
        };
    }
    if variant == Variant::Naive {
        return Shader {
            name,
            source: constants.before(&[chunk, any_hit, include_str!("naive.wgsl")]),
            entry_point: "naive",
        };
    }
    let constants = constants
        .boolean("BITS", variant == Variant::FacesWithBits)
        .unsigned("TEXELS_PER_WORKGROUP", TEXELS_PER_WORKGROUP);
    Shader {
        name,
        source: constants.before(&[chunk, any_hit, include_str!("faces.wgsl")]),
        entry_point: "faces",
    }
}
