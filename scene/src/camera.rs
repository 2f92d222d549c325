//! Cameras: rays through pixels and the projection matrix.

use glam::{DMat4, DVec3, DVec4};
use toml::Spanned;

use super::diagnostics::SceneText;
use super::schema::CameraFile;
use super::values::triple;

/// A camera that looks along −z of its own space, x to the right, y upwards; its pixels are square.
#[derive(Clone, Debug)]
pub struct Camera {
    /// The position in world space.
    pub position: DVec3,
    /// The unit vector to the right of the picture, in world space.
    pub right: DVec3,
    /// The unit vector to the top of the picture, in world space.
    pub up: DVec3,
    /// The viewing direction, a unit vector in world space.
    pub forward: DVec3,
    /// The projection.
    pub projection: Projection,
    /// The picture's width and height in pixels.
    pub resolution: [u32; 2],
}

/// A perspective or orthographic projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Projection through the camera's position.
    Perspective {
        /// The angle between the picture's upper and lower edge, in radians, above 0 and below π.
        vertical_fov: f64,
    },
    /// Parallel projection; points behind the camera's plane are not seen.
    Orthographic {
        /// The picture's height in world units.
        height: f64,
    },
}

/// The largest vertical field of view, in degrees.
const MAX_FOV_DEGREES: f64 = 170.0;

impl Camera {
    pub(super) fn new(
        source: &SceneText<'_>,
        spanned: &Spanned<CameraFile>,
        world_up: DVec3,
    ) -> crate::Result<Self> {
        let file = spanned.get_ref();
        let error = |key: &str, message: &str| source.error_at(spanned, key, message);
        let projection = match (file.vertical_fov, file.height) {
            (Some(_), Some(_)) => {
                let message =
                    "perspective cameras have it and orthographic ones `height`: leave one out";
                return Err(error("camera.vertical_fov", message));
            }
            (None, Some(height)) => Projection::Orthographic { height: height.0 },
            (Some(fov), None) if fov.0 > MAX_FOV_DEGREES => {
                let message = format!("{} degrees are more than {MAX_FOV_DEGREES}", fov.0);
                return Err(error("camera.vertical_fov", &message));
            }
            (fov, None) => Projection::Perspective {
                vertical_fov: fov.map_or(40.0, |v| v.0).to_radians(),
            },
        };
        let position = DVec3::from_array(triple(file.position));
        let target = DVec3::from_array(triple(file.target));
        let Some(forward) = (target - position).try_normalize() else {
            let message = "it equals `position`: there is no direction to look in";
            return Err(error("camera.target", message));
        };
        let right = match forward.cross(world_up).try_normalize() {
            Some(right) if forward.cross(world_up).length() > 1e-6 => right,
            // The camera looks straight up or down: any fixed choice will do.
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

    /// Returns the ray through the center of pixel (x, y), y downwards, as origin and unit
    /// direction in world space.
    pub fn ray(&self, [x, y]: [u32; 2]) -> [DVec3; 2] {
        let [width, height] = self.resolution.map(f64::from);
        // Offsets from the picture's center in units of half its height.
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

    /// Returns the unit direction from a point towards the viewer.
    pub fn towards_viewer(&self, point: DVec3) -> DVec3 {
        match self.projection {
            Projection::Perspective { .. } => (self.position - point).normalize_or(-self.forward),
            Projection::Orthographic { .. } => -self.forward,
        }
    }

    /// Returns the projection to wgpu's clip space: x and y in −1..1, y upwards, depth 0 at `near`
    /// and 1 at `far`.
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
