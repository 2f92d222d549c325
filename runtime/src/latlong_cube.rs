//! A cube map of latitude-longitude coordinates.

use crate::environment::aogrid_environment_coordinate;

/// The latitude-longitude coordinates of the directions of a cube map's texels, in place of arc tangents
/// in shaders (GPU Gems, chapter 17, with 256² texels a face): u and v as 32-bit floats, the texture
/// format `Rg32Float`, six faces in the order +x, −x, +y, −y, +z, −z.
#[derive(Clone, Debug, PartialEq)]
pub struct LatLongCube {
    size: usize,
    texels: Vec<[f32; 2]>,
}

impl LatLongCube {
    /// Returns the coordinates for faces of `size` × `size` texels.
    ///
    /// # Panics
    ///
    /// If `size` is zero.
    pub fn new(size: usize) -> Self {
        assert!(size > 0, "a cube map has texels");
        let at = |idx: usize| -1.0 + (2 * idx + 1) as f32 / size as f32;
        let mut texels = Vec::with_capacity(6 * size * size);
        for face in 0..6 {
            for y in 0..size {
                let row = (0..size).map(|x| direction(face, at(x), at(y)));
                texels.extend(row.map(aogrid_environment_coordinate));
            }
        }
        Self { size, texels }
    }

    /// Returns the texels of a side of a face.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Returns the texels, little-endian on every machine that wgpu runs on: face by face, rows from
    /// the top.
    pub fn texels(&self) -> &[u8] {
        bytemuck::cast_slice(&self.texels)
    }

    /// Returns the texel that holds a direction of any length but zero, as a nearest sampler does.
    pub(crate) fn nearest(&self, direction: [f32; 3]) -> [f32; 2] {
        let (face, [s, t]) = face_coordinates(direction);
        let column = |at: f32| ((0.5 * (at + 1.0) * self.size as f32) as usize).min(self.size - 1);
        self.texels[(face * self.size + column(t)) * self.size + column(s)]
    }
}

/// Returns the direction of a position on a face, s to the right and t downward in −1..1.
fn direction(face: usize, s: f32, t: f32) -> [f32; 3] {
    match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    }
}

/// Returns the face that a direction meets, and the position on it.
fn face_coordinates([x, y, z]: [f32; 3]) -> (usize, [f32; 2]) {
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    if ax >= ay && ax >= az {
        let s = if x > 0.0 { -z } else { z };
        (usize::from(x < 0.0), [s / ax, -y / ax])
    } else if ay >= az {
        let t = if y > 0.0 { z } else { -z };
        (2 + usize::from(y < 0.0), [x / ay, t / ay])
    } else {
        let s = if z > 0.0 { x } else { -x };
        (4 + usize::from(z < 0.0), [s / az, -y / az])
    }
}
