//! Textures that are computed from the committed tables.

use crate::format::Format;
use crate::generated::clip_master;
use crate::table::MergeTable;

/// Returns 1 − AO of `T_clip`, the factor that a renderer multiplies ambient light by, in a quarter
/// of the memory of [`clip_texels`](crate::clip_texels).
/// [`ClipTable::SIZE`](crate::ClipTable::SIZE) texels, x fastest, tightly packed, little-endian;
/// one channel (`r16float` or `r8unorm`).
pub fn transmittance_texels(format: Format) -> Vec<u8> {
    let transmittance = |[occlusion, _, _]: [f32; 3]| 1.0 - occlusion;
    format.encode(clip_master().into_iter().map(transmittance))
}

/// Returns the intersection I(a1, a2, γ) = a1 + a2 − `T_merge`, the fraction that both cones cover.
/// A renderer that keeps a running sum of fractions subtracts it. [`MergeTable::SIZE`] texels, x
/// fastest, tightly packed, little-endian; one channel (`r16float` or `r8unorm`).
///
/// The renderer then adds a1 + a2, the part of the union that is linear, at full precision, without
/// the rounding of the texture and the few bits of its filter: merging a cone with an empty one
/// leaves it exactly unchanged.
pub fn intersection_texels(format: Format) -> Vec<u8> {
    format.encode(MergeTable::committed().intersections())
}
