//! Light from all around: a sky that fades towards a pale horizon, between a red wall to the left and
//! a blue-green one to the right, over a ground as dark as earth. No file: it is made here.

use std::error::Error;
use std::f32::consts::{PI, TAU};

use aogrid_runtime::{
    AogridEnvironment, EnvironmentFrame, EnvironmentMap, EnvironmentPass,
    EnvironmentPassDescriptor, EnvironmentTexture, Normals, Positions, Reflection, Up,
};
use glam::{Mat4, Vec3};

use crate::targets::LIGHT;

/// Texels across and down.
const SIZE: [usize; 2] = [128, 64];

/// The sine of the walls' upper edge.
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
            positions: Positions::World,
            normals: Normals::Unsigned,
        };
        Ok(Self {
            map: EnvironmentTexture::new(device, queue, &map, "sky"),
            pass: EnvironmentPass::new(device, descriptor)?,
        })
    }

    /// Once a frame. `hidden`: what occluders add up to, with axes.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        hidden: &wgpu::TextureView,
        normals: &wgpu::TextureView,
    ) -> Result<(), Box<dyn Error>> {
        let frame = EnvironmentFrame {
            // Only depths and mirrors ask where the camera is.
            clip_from_world: Mat4::IDENTITY.to_cols_array_2d(),
            eye: [0.0; 4],
            lobe_half_angle: 0.0,
            environment: AogridEnvironment::new(Up::Y, 0.0),
            map: &self.map,
            occlusion: hidden,
            normals,
            positions: None,
        };
        Ok(self.pass.prepare(device, queue, &frame)?)
    }

    /// Writes what each pixel reflects, and 1 in alpha.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.pass.draw(pass);
    }
}

/// Where a texel is seen: the middle of the map is +z, and +x a quarter of its width from the left.
fn direction(idx: usize) -> Vec3 {
    let [u, v] = [idx % SIZE[0], idx / SIZE[0]].map(|n| n as f32 + 0.5);
    let azimuth = TAU * (0.5 - u / SIZE[0] as f32);
    let colatitude = PI * v / SIZE[1] as f32;
    let level = colatitude.sin();
    Vec3::new(
        level * azimuth.sin(),
        colatitude.cos(),
        level * azimuth.cos(),
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
