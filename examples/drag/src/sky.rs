//! A procedural sky that fades to a pale horizon, between a red wall on the left and a blue-green
//! one on the right, over dark ground.

use std::error::Error;
use std::f32::consts::{PI, TAU};

use aogrid_runtime::{
    AogridEnvironment, EnvironmentFrame, EnvironmentMap, EnvironmentPass,
    EnvironmentPassDescriptor, EnvironmentTexture, GBufferViews, Reflection, Up,
};
use glam::Vec3;

use crate::targets::{GBUFFER, LIGHT};

/// The width and height of the map in texels.
const SIZE: [usize; 2] = [128, 64];

/// The sine of the elevation of the walls' upper edge.
const WALLS: f32 = 0.75;

pub struct Sky {
    map: EnvironmentTexture,
    pass: EnvironmentPass,
}

impl Sky {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, Box<dyn Error>> {
        let texels: Vec<_> = (0..SIZE[0] * SIZE[1])
            .map(|idx| radiance(direction(idx)).to_array())
            .collect();
        let map = EnvironmentMap::new(SIZE, &texels)?;
        let descriptor = EnvironmentPassDescriptor {
            label: "sky".into(),
            reflection: Reflection::Lambertian,
            target: LIGHT,
            blend: None,
            depth_stencil: None,
            gbuffer: GBUFFER,
        };
        Ok(Self {
            map: EnvironmentTexture::new(device, queue, &map, "sky"),
            pass: EnvironmentPass::new(device, descriptor)?,
        })
    }

    /// Sets the inputs of a frame. `occlusion` holds the occluders' combined axis and
    /// transmittance.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        gbuffer: GBufferViews<'_>,
        occlusion: &wgpu::TextureView,
    ) -> Result<(), Box<dyn Error>> {
        let frame = EnvironmentFrame {
            gbuffer,
            // Only glossy reflection needs the viewer and a lobe.
            eye: [0.0; 4],
            lobe_half_angle: 0.0,
            environment: AogridEnvironment::new(Up::Y, 0.0),
            map: &self.map,
            occlusion,
        };
        Ok(self.pass.prepare(device, queue, &frame)?)
    }

    /// Draws the light that each pixel reflects, with an alpha of 1.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.pass.draw(pass);
    }
}

/// Returns the direction of a texel: +z is the middle of the map, +x a quarter of its width from
/// the left.
fn direction(idx: usize) -> Vec3 {
    let [u, v] = [idx % SIZE[0], idx / SIZE[0]].map(|n| n as f32 + 0.5);
    let azimuth = TAU * (0.5 - u / SIZE[0] as f32);
    let colatitude = PI * v / SIZE[1] as f32;
    let sin_colatitude = colatitude.sin();
    Vec3::new(
        sin_colatitude * azimuth.sin(),
        colatitude.cos(),
        sin_colatitude * azimuth.cos(),
    )
}

fn radiance(towards: Vec3) -> Vec3 {
    let is_wall = towards.x.abs() > towards.z.abs() && towards.y < WALLS;
    match (is_wall, towards.y < 0.0) {
        (_, true) => Vec3::new(0.20, 0.18, 0.15),
        (true, _) if towards.x < 0.0 => Vec3::new(1.50, 0.30, 0.20),
        (true, _) => Vec3::new(0.15, 1.10, 1.40),
        (false, _) => Vec3::new(0.60, 0.58, 0.50).lerp(Vec3::new(0.35, 0.42, 0.50), towards.y),
    }
}
