//! The kernels of rays: their sources with the constants that Rust knows, and what they bind.

use super::{Variant, tree};
use crate::kernel::{Binding, Kernel};
use crate::shaders::{Constants, Shader, WORKGROUP};

/// Texels of a workgroup: those of six faces of 16². Mesa's software stops the loops of an
/// invocation after 65,535 rounds, silently, and no texel's walk comes near a 24th of that.
pub(super) const TEXELS: u32 = 1536;

/// Numbers a cell: count, a and the three of m; or count and three sums of two words.
pub(super) const FACE_SUMS: usize = 5;
pub(super) const RANDOM_SUMS: usize = 7;

pub(super) fn compile(device: &wgpu::Device, variant: Variant, directions: bool) -> Kernel {
    use Binding::{Read, Uniform, Write};
    let bindings: &[Binding] = match variant {
        Variant::Random => &[Uniform, Read, Read, Read, Write],
        Variant::Naive => &[Uniform, Read, Read, Read, Read, Read, Write],
        _ => &[Uniform, Read, Read, Read, Read, Read, Write, Write],
    };
    Kernel::new(device, &shader(variant, directions), bindings)
}

/// All of them, in every variant.
pub(crate) fn shaders() -> Vec<Shader> {
    vec![
        shader(Variant::Faces, true),
        shader(Variant::Faces, false),
        shader(Variant::FacesWithBits, true),
        shader(Variant::Random, true),
        shader(Variant::Random, false),
        shader(Variant::Naive, true),
    ]
}

fn shader(variant: Variant, directions: bool) -> Shader {
    let constants = Constants::default()
        .unsigned("WORKGROUP", WORKGROUP)
        .boolean("DIRECTIONS", directions)
        .unsigned("INNER", tree::INNER)
        .unsigned("TRIANGLE_BITS", tree::TRIANGLE_BITS)
        .unsigned("FIRST_TRIANGLE", (1 << tree::TRIANGLE_BITS) - 1)
        // Less than this moves a ray by less than the boxes' padding, all the way.
        .float("LEAST_SLOPE", 1e-12)
        // Two products and a difference, half a step of 2⁻²³ each, and as much again.
        .float("BOX_SLACK", 1.0 + 1.0 / (1 << 20) as f32);
    let chunk = include_str!("../chunk.wgsl");
    let any_hit = include_str!("any_hit.wgsl");
    let name = match (variant, directions) {
        (Variant::Faces, true) => "rays: faces",
        (Variant::Faces, false) => "rays: faces without directions",
        (Variant::FacesWithBits, _) => "rays: faces with bits",
        (Variant::Random, true) => "rays: Monte Carlo",
        (Variant::Random, false) => "rays: Monte Carlo without directions",
        (Variant::Naive, _) => "naive",
    };
    if variant == Variant::Random {
        let parts = [
            chunk,
            any_hit,
            include_str!("../sweep/integers.wgsl"),
            include_str!("monte_carlo.wgsl"),
        ];
        let constants = constants
            .unsigned("SUMS", RANDOM_SUMS as u32)
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
        .unsigned("TEXELS", TEXELS);
    Shader {
        name,
        source: constants.before(&[chunk, any_hit, include_str!("faces.wgsl")]),
        entry_point: "faces",
    }
}
