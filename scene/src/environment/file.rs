//! Environment maps from files, with values that are radiance.

use std::fs;
use std::path::Path;

use super::{Picture, openexr, radiance_hdr};
use crate::error::{Context, bail, ensure};

/// The largest half float, which replaces infinities in files.
const MAX_HALF: f32 = 65504.0;

/// Reads an EXR or HDR file; its first bytes decide which.
pub(super) fn read(path: &Path, warnings: &mut Vec<String>) -> crate::Result<Picture> {
    let shown = || path.display().to_string();
    let metadata = fs::metadata(path).with_context(shown)?;
    ensure!(metadata.is_file(), "{}: it is not a regular file", shown());
    let bytes = fs::read(path).with_context(shown)?;
    parse(&shown(), &bytes, warnings)
}

/// Parses the content of the file that messages call `name`.
pub(super) fn parse(
    name: &str,
    bytes: &[u8],
    warnings: &mut Vec<String>,
) -> crate::Result<Picture> {
    let mut picture = match bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => openexr::read(bytes).with_context(|| name.to_owned())?,
        [b'#', b'?', ..] => radiance_hdr::read(bytes).with_context(|| name.to_owned())?,
        _ => bail!("{name}: it is neither an EXR nor a Radiance HDR file"),
    };
    let [negative, non_finite] = sanitize(&mut picture.texels);
    if negative > 0 {
        warnings.push(format!(
            "{name}: {negative} texels have negative radiance (clamped to 0)"
        ));
    }
    if non_finite > 0 {
        warnings.push(format!(
            "{name}: {non_finite} texels are infinite (clamped to {MAX_HALF}) or NaN (set to 0)"
        ));
    }
    Ok(picture)
}

/// Replaces values that are no radiance, and returns how many texels were negative and how many
/// were infinite or NaN.
fn sanitize(texels: &mut [[f32; 3]]) -> [usize; 2] {
    let (mut negative, mut non_finite) = (0, 0);
    for texel in texels {
        negative += usize::from(texel.iter().any(|&v| v < 0.0));
        non_finite += usize::from(texel.iter().any(|v| !v.is_finite()));
        *texel = texel.map(|v| match v {
            v if v.is_nan() => 0.0,
            v if v.is_infinite() && v > 0.0 => MAX_HALF,
            v => v.max(0.0),
        });
    }
    [negative, non_finite]
}
