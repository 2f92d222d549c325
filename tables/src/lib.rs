//! The tables `T_clip` and `T_merge`, with which a renderer clips an occlusion cone by a
//! receiver's tangent plane and unites two cones.
//!
//! ```
//! use aogrid_tables::{ClipTable, Format, MergeTable, clip, clip_texels, merge};
//!
//! // A cone over a tenth of the sphere, its axis 60° from the receiver's normal.
//! let clipped = clip::closed_form(0.1_f32, 0.5);
//! let looked_up = ClipTable::committed().sample(0.1, 0.5);
//! assert!((clipped.occlusion - looked_up.occlusion).abs() < 1.4e-3);
//!
//! // Together with a cone over a fifth of the sphere, a right angle away.
//! let union = merge::closed_form(0.1_f32, 0.2, std::f32::consts::FRAC_PI_2);
//! let looked_up = MergeTable::committed().sample(0.1, 0.2, std::f32::consts::FRAC_PI_2);
//! assert!((union - looked_up).abs() < 6.4e-3);
//!
//! // Upload these as an Rgba16Float texture of ClipTable::SIZE texels.
//! let texels = clip_texels(Format::F16);
//! assert_eq!(texels.len(), 64 * 64 * 4 * 2);
//! ```
//!
//! # Theory
//!
//! A cone stands for the directions that an occluder hides. It is given by the fraction `a` of the
//! sphere that it covers, 0..=1, and never by its half-angle α, a = (1 − cos α)/2. All of 0..=π is
//! valid for α: for a point inside an object the cone exceeds the hemisphere.
//!
//! * [`clip`]: `T_clip(a, cos β)` (RR-5779, sections 5.1 and 5.2.2; JGT 2007, section 3.3.1). The
//!   part of the cone above the tangent plane: its occlusion AO, its fraction a′, and the weight f
//!   of its axis.
//! * [`merge`]: `T_merge(a1, a2, γ)` (RR-5779, section 5.2.2; JGT supplement). The fraction of the
//!   sphere that the union of two cones covers.
//!
//! Each is implemented twice. `integrate` sums rings around an axis numerically, as the papers do,
//! and generates the committed tables. `closed_form` is the reference that they are checked
//! against, and an alternative to the look-up.
//!
//! Differences from the papers:
//!
//! * One printed listing reads an occlusion from `T_clip`, another an aperture and f. Ours has
//!   three channels: AO, a′ and f.
//! * f weights the cone's axis, as in the text of RR-5779; the listings weight the normal with it.
//! * The printed code of `T_merge` says `beta` for `gamma`; for nested cones it returns an angle in
//!   place of a solid angle; it divides 0 by 0 at γ = α_B; in `f32` it finds that opposite caps
//!   share nothing; and the left Riemann sum errs by 4e-4. Eq. 2 integrates over A ∩ B, not A ∪ B.
//!   Ours splits the integral of eq. 1 at its kinks, uses a quadrature rule that handles
//!   square-root ends, and agrees with the closed form to 1e-12. The arc cosine's argument is
//!   clamped, as in the printed code but not in eq. 1, so that it holds beyond the hemisphere.
//! * The last axis of `T_merge` is γ itself. With cos γ the error of look-ups would be nearly three
//!   times as large.
//!
//! # Practice
//!
//! * [`clip_texels`], [`merge_texels`]: the committed tables as a renderer uploads them.
//!   [`transmittance_texels`]: 1 − AO of `T_clip`, all that a renderer needs which multiplies
//!   occlusion; [`intersection_texels`]: the fraction that both cones cover, which a renderer
//!   subtracts from a running sum.
//! * [`texture_coordinate`]: the coordinate of a shader's look-up. The nodes include the ends of
//!   the axes.
//! * [`ClipTable`], [`MergeTable`]: the tables on the CPU, with look-ups filtered as on a GPU. They
//!   can be generated in any size, row by row; [`generated_files`] returns the committed files.
//! * [`error_report`]: the errors of all of them against the closed forms. The figures below come
//!   from it.
//!
//! ## Sizes
//!
//! Largest and rms error of look-ups in the master:
//!
//! | `T_clip` | AO | | (AO/2) d′ | | | `T_merge` | union | |
//! |---|---|---|---|---|---|---|---|---|
//! | 32² | 2.8e-3 | 3.8e-4 | 2.6e-2 | 9.4e-4 | | 32²×32 | 8.1e-3 | 4.2e-4 |
//! | 48² | 1.9e-3 | 1.7e-4 | 2.3e-2 | 5.6e-4 | | 40²×32 | 6.4e-3 | 3.2e-4 |
//! | **64²** | 1.4e-3 | 1.0e-4 | 2.0e-2 | 3.9e-4 | | 48²×24 | 5.3e-3 | 3.8e-4 |
//! | 96² | 9.0e-4 | 4.6e-5 | 1.7e-2 | 2.4e-4 | | **48²×32** | 5.3e-3 | 2.7e-4 |
//! | 128² | 6.7e-4 | 2.7e-5 | 1.5e-2 | 1.7e-4 | | 64²×32 | 4.0e-3 | 2.3e-4 |
//!
//! `T_clip` has 64² nodes: the rms error is then that of rounding to f16 (1.0e-4), and the largest
//! error is a third of what an 8-bit target resolves. (AO/2) d′ is the vector that a merge adds up
//! for a cone. Its error is largest next to a = ½, cos β = 1, where f jumps from 1 to 0 and no size
//! helps: f itself is off by ½ there, which is harmless because d = n.
//!
//! `T_merge` has 48²×32 nodes. On the face γ = 0 it is max(a1, a2), a crease along the diagonal of
//! the texels, where linear filtering always errs by ¼ of a cell; the same holds at γ = π. That is
//! the largest error anywhere, and the only reason for more than 40 nodes along a1 and a2. γ needs
//! fewer.
//!
//! ## Formats
//!
//! | | memory | largest rounding | AO of look-ups | | union of look-ups | |
//! |---|---|---|---|---|---|---|
//! | f32 master | | 3.0e-8 | 1.4e-3 | 1.0e-4 | 5.3e-3 | 2.7e-4 |
//! | [`Format::F16`] | 32 + 144 KiB | 2.4e-4 | 1.4e-3 | 1.2e-4 | 5.5e-3 | 2.8e-4 |
//! | [`Format::Unorm8`] | 16 + 72 KiB | 2.0e-3 | 2.2e-3 | 7.4e-4 | 6.7e-3 | 7.1e-4 |
//!
//! f16 adds almost no error and is recommended. 8-bit unorm halves the memory, and its rms error is
//! still below what an 8-bit target resolves.

mod cap;
pub mod clip;
mod derived;
mod errors;
mod files;
mod format;
mod generated;
pub mod merge;
mod quadrature;
mod real;
mod table;
mod texture;

pub use clip::Clip;
pub use derived::{intersection_texels, transmittance_texels};
pub use errors::{ErrorRow, Measured, error_report};
pub use files::{GeneratedFile, generated_files};
pub use format::Format;
pub use generated::{clip_texels, merge_texels};
pub use real::Real;
pub use table::{ClipRow, ClipTable, MergeRow, MergeTable};
pub use texture::texture_coordinate;
