//! Cameras: rays for pixels, and the matrix that undoes them.

use glam::{DMat4, DVec3, DVec4};
use toml::Spanned;

use super::numbers::triple;
use super::places::Source;
use super::schema::CameraFile;

/// Looks along −z of its own space, x to the right, y upwards; square pixels.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Where it is, in world space.
    pub position: DVec3,
    /// To the right, of length 1.
    pub right: DVec3,
    /// Upwards in the picture, of length 1.
    pub up: DVec3,
    /// Where it looks, of length 1.
    pub forward: DVec3,
    /// How it projects.
    pub projection: Projection,
    /// Pixels across and down.
    pub resolution: [u32; 2],
}

/// How points get into the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Through a point: the angle between the upper and the lower edge, in radians.
    Perspective {
        /// Above zero, below π.
        vertical_fov: f64,
    },
    /// In parallel: what lies behind the camera's plane is not seen.
    Orthographic {
        /// Of the picture, in world units.
        height: f64,
    },
}

/// The widest perspective, in degrees.
const WIDEST: f64 = 170.0;

impl Camera {
    pub(super) fn new(
        source: &Source<'_>,
        spanned: &Spanned<CameraFile>,
        world_up: DVec3,
    ) -> anyhow::Result<Self> {
        let file = spanned.get_ref();
        let error = |key: &str, message: &str| source.at(spanned, key, message);
        let projection = match (file.vertical_fov, file.height) {
            (Some(_), Some(_)) => {
                let message = "it is for perspective, and `height` for orthographic cameras";
                return Err(error("camera.vertical_fov", message));
            }
            (None, Some(height)) => Projection::Orthographic { height: height.0 },
            (Some(fov), None) if fov.0 > WIDEST => {
                let message = format!("{} degrees are more than {WIDEST}", fov.0);
                return Err(error("camera.vertical_fov", &message));
            }
            (fov, None) => Projection::Perspective {
                vertical_fov: fov.map_or(40.0, |v| v.0).to_radians(),
            },
        };
        let position = DVec3::from_array(triple(file.position));
        let target = DVec3::from_array(triple(file.target));
        let Some(forward) = (target - position).try_normalize() else {
            let message = "it is where the camera is: there is no direction to look in";
            return Err(error("camera.target", message));
        };
        let right = match forward.cross(world_up).try_normalize() {
            Some(right) if forward.cross(world_up).length() > 1e-6 => right,
            // Straight up or down: any way round will do, as long as it is always the same.
            _ => DVec3::X,
        };
        let right = (right - forward * right.dot(forward)).normalize();
        Ok(Self {
            position,
            right,
            up: right.cross(forward),
            forward,
            projection,
            resolution: file.resolution.map(|n| n.0),
        })
    }

    /// The ray through the centre of pixel (x, y), y downwards: origin and a direction, of
    /// length 1, in world space.
    pub fn ray(&self, [x, y]: [u32; 2]) -> [DVec3; 2] {
        let [width, height] = self.resolution.map(f64::from);
        // In half pictures' heights from the centre.
        let across = (2.0 * (f64::from(x) + 0.5) - width) / height;
        let upwards = 1.0 - 2.0 * (f64::from(y) + 0.5) / height;
        match self.projection {
            Projection::Perspective { vertical_fov } => {
                let half = (vertical_fov / 2.0).tan();
                let towards = self.forward + half * (across * self.right + upwards * self.up);
                [self.position, towards.normalize()]
            }
            Projection::Orthographic { height } => {
                let offset = height / 2.0 * (across * self.right + upwards * self.up);
                [self.position + offset, self.forward]
            }
        }
    }

    /// The direction from a point towards whoever looks through the camera, of length 1.
    pub fn towards_viewer(&self, point: DVec3) -> DVec3 {
        match self.projection {
            Projection::Perspective { .. } => (self.position - point).normalize_or(-self.forward),
            Projection::Orthographic { .. } => -self.forward,
        }
    }

    /// To clip space as wgpu has it: x and y in −1..1 upwards, depth 0 at `near` and 1 at `far`.
    pub fn clip_from_world(&self, near: f64, far: f64) -> DMat4 {
        let aspect = f64::from(self.resolution[0]) / f64::from(self.resolution[1]);
        let row = |axis: DVec3| axis.extend(-axis.dot(self.position));
        let (right, up, depth) = (row(self.right), row(self.up), row(self.forward));
        let rows = match self.projection {
            Projection::Perspective { vertical_fov } => {
                let half = (vertical_fov / 2.0).tan();
                let z = far / (far - near) * (depth - near * DVec4::W);
                [right / (half * aspect), up / half, z, depth]
            }
            Projection::Orthographic { height } => {
                let half = height / 2.0;
                let z = (depth - near * DVec4::W) / (far - near);
                [right / (half * aspect), up / half, z, DVec4::W]
            }
        };
        DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose()
    }
}
