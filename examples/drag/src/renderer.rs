//! A small deferred renderer: G-buffer, occlusion, ambient light, composition.

use std::error::Error;
use std::sync::Arc;

use aogrid_gpu_support::{Gpu, attachment};
use aogrid_runtime::Combine;
use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Vec3, Vec4};
use winit::window::Window;

use crate::pipelines;
use crate::scene::{FLOOR, TABLE, Vertex, models};
use crate::shadows::{ALPHA_CHANNEL, Shading, ShadowResult, Shadows, View};
use crate::sky::Sky;
use crate::targets::{GBUFFER, Targets};

/// The uniform ambient light, used without a sky.
const AMBIENT: wgpu::Color = wgpu::Color {
    r: 0.62,
    g: 0.64,
    b: 0.68,
    a: 1.0,
};

pub struct Renderer {
    gpu: Gpu,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    vertices: wgpu::Buffer,
    frame: wgpu::Buffer,
    frame_group: wgpu::BindGroup,
    gbuffer: wgpu::RenderPipeline,
    compose: wgpu::RenderPipeline,
    to_screenshot: wgpu::RenderPipeline,
    /// A mask: 1 for the channel of the texture that holds transmittances, 0 for the others.
    channel: wgpu::Buffer,
    shadows: Shadows,
    sky: Sky,
    targets: Targets,
    object: Vec3,
    pub shading: Shading,
    /// Whether the sky lights the scene instead of uniform ambient light.
    pub has_sky: bool,
}

impl Renderer {
    pub fn new(window: Arc<Window>, size: [u32; 2]) -> Result<Self, Box<dyn Error>> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let surface = instance.create_surface(window)?;
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            compatible_surface: Some(&surface),
            ..Default::default()
        }))?;
        let gpu = Gpu::on(&adapter, wgpu::Features::empty())?;
        let Gpu { device, queue, .. } = &gpu;
        let [width, height] = size.map(|n| n.max(1));
        let config = surface.get_default_config(&adapter, width, height);
        let mut config = config.ok_or("this adapter cannot draw to the window")?;
        // No sRGB conversion, so that the window shows the same values as a screenshot.
        let plain = config.format.remove_srgb_suffix();
        if surface.get_capabilities(&adapter).formats.contains(&plain) {
            config.format = plain;
        }
        surface.configure(device, &config);

        let module = device.create_shader_module(wgpu::include_wgsl!("drag.wgsl"));
        let gbuffer = pipelines::gbuffer(device, &module);
        let frame = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: 80,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let frame_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame"),
            layout: &gbuffer.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: frame.as_entire_binding(),
            }],
        });
        let (vertices, grids) = models()?;
        Ok(Self {
            vertices: gpu.buffer(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&vertices)),
            frame,
            frame_group,
            gbuffer,
            compose: pipelines::composition(device, &module, config.format),
            to_screenshot: pipelines::composition(device, &module, wgpu::TextureFormat::Rgba8Unorm),
            channel: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("channel"),
                size: 16,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            shadows: Shadows::new(device, queue, &grids, GBUFFER)?,
            sky: Sky::new(device, queue)?,
            targets: Targets::new(&gpu, [width, height]),
            object: Vec3::ZERO,
            shading: Shading::Cone(Combine::Multiply),
            has_sky: false,
            gpu,
            surface,
            config,
        })
    }

    pub fn resize(&mut self, size: [u32; 2]) {
        [self.config.width, self.config.height] = size.map(|n| n.max(1));
        self.surface.configure(&self.gpu.device, &self.config);
        self.targets = Targets::new(&self.gpu, [self.config.width, self.config.height]);
    }

    /// Moves the object to the point on the floor under the cursor.
    pub fn move_object_to(&mut self, [x, y]: [f32; 2]) {
        let ndc = [
            2.0 * x / self.config.width as f32 - 1.0,
            1.0 - 2.0 * y / self.config.height as f32,
        ];
        let world_from_clip = self.clip_from_world().inverse();
        let at = |depth| (world_from_clip * Vec4::new(ndc[0], ndc[1], depth, 1.0)).project();
        let (near, far) = (at(0.0), at(1.0));
        let t = near.y / (near.y - far.y);
        if t > 0.0 {
            let on_floor = near + (far - near) * t;
            self.object = on_floor.clamp(Vec3::splat(-FLOOR), Vec3::splat(FLOOR));
            self.object.y = 0.0;
        }
    }

    /// Draws to the window and waits for the GPU, so that the frame can be timed.
    pub fn draw(&mut self) -> Result<(), Box<dyn Error>> {
        use wgpu::CurrentSurfaceTexture as Current;
        let texture = match self.surface.get_current_texture() {
            Current::Success(texture) | Current::Suboptimal(texture) => texture,
            Current::Outdated | Current::Lost => {
                self.surface.configure(&self.gpu.device, &self.config);
                return Ok(());
            }
            Current::Timeout | Current::Occluded => return Ok(()),
            Current::Validation => return Err("the window's next frame is not valid".into()),
        };
        let view = texture.texture.create_view(&Default::default());
        self.draw_to(&view, &self.compose.clone())?;
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        self.gpu.queue.present(texture);
        Ok(())
    }

    /// Returns the scene as RGBA, 8 bits each, with its width and height.
    pub fn screenshot(&mut self) -> Result<(Vec<u8>, [u32; 2]), Box<dyn Error>> {
        let size = [self.config.width, self.config.height];
        let picture = self.gpu.target(size, wgpu::TextureFormat::Rgba8Unorm);
        let view = picture.create_view(&Default::default());
        self.draw_to(&view, &self.to_screenshot.clone())?;
        Ok((self.gpu.read_texture(&picture), size))
    }

    fn draw_to(
        &mut self,
        view: &wgpu::TextureView,
        compose: &wgpu::RenderPipeline,
    ) -> Result<(), Box<dyn Error>> {
        let clip_from_world = self.clip_from_world();
        let mut uniform = clip_from_world.to_cols_array().to_vec();
        uniform.extend(self.object.extend(0.0).to_array());
        self.gpu
            .queue
            .write_buffer(&self.frame, 0, bytemuck::cast_slice(&uniform));

        // Once per frame: the transforms of both objects.
        let world_from_objects =
            [self.object, TABLE].map(|at| Mat4::from_translation(at).to_cols_array_2d());
        let targets = &self.targets;
        let shadows_view = View {
            gbuffer: targets.gbuffer(clip_from_world.to_cols_array_2d()),
            depth: &targets.depth,
            darkened: &targets.darkened,
            blended: &targets.blended,
            stored: &targets.stored,
        };
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        self.shadows.prepare(
            device,
            queue,
            self.shading,
            &shadows_view,
            &world_from_objects,
        )?;

        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.draw_gbuffer(&mut encoder);
        let shadow = self
            .shadows
            .record(&mut encoder, self.shading, &shadows_view);
        let (transmittances, channel) = self.light(&mut encoder, shadow)?;
        self.gpu
            .queue
            .write_buffer(&self.channel, 0, bytemuck::cast_slice(&channel));
        self.draw_composition(&mut encoder, view, compose, &transmittances);
        self.gpu.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Draws the ambient light. Light from the sky is already occluded if the shading method has
    /// axes. Returns the transmittance by which the light has yet to be multiplied: a texture, and
    /// a mask of its channel.
    fn light(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shadow: ShadowResult,
    ) -> Result<(wgpu::TextureView, [f32; 4]), Box<dyn Error>> {
        let targets = &self.targets;
        if self.has_sky {
            let gbuffer = targets.gbuffer(self.clip_from_world().to_cols_array_2d());
            self.sky
                .prepare(&self.gpu.device, &self.gpu.queue, gbuffer, &shadow.sum)?;
        }
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("light"),
            color_attachments: &[attachment(&targets.light, wgpu::LoadOp::Clear(AMBIENT))],
            ..Default::default()
        });
        if !self.has_sky {
            return Ok(shadow.transmittance);
        }
        self.sky.draw(&mut pass);
        Ok(match shadow.has_axes {
            // The light is already occluded; its alpha is 1 and leaves it unchanged.
            true => (targets.light.clone(), ALPHA_CHANNEL),
            false => shadow.transmittance,
        })
    }

    fn draw_gbuffer(&self, encoder: &mut wgpu::CommandEncoder) {
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("G-buffer"),
            color_attachments: &[
                attachment(&self.targets.positions, clear),
                attachment(&self.targets.normals, clear),
                attachment(&self.targets.ids, clear),
            ],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.targets.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.gbuffer);
        pass.set_bind_group(0, &self.frame_group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        let count = self.vertices.size() / size_of::<Vertex>() as u64;
        pass.draw(0..count as u32, 0..1);
    }

    fn draw_composition(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        compose: &wgpu::RenderPipeline,
        transmittances: &wgpu::TextureView,
    ) {
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let texture = wgpu::BindingResource::TextureView;
        let resources = [
            texture(&self.targets.positions),
            texture(&self.targets.normals),
            texture(&self.targets.light),
            texture(transmittances),
            self.channel.as_entire_binding(),
        ];
        let group = self
            .gpu
            .device
            .create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("composition"),
                layout: &compose.get_bind_group_layout(0),
                entries: &(0..).zip(resources).map(entry).collect::<Vec<_>>(),
            });
        let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("composition"),
            color_attachments: &[attachment(view, clear)],
            ..Default::default()
        });
        pass.set_pipeline(compose);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }

    fn clip_from_world(&self) -> Mat4 {
        let aspect = self.config.width as f32 / self.config.height as f32;
        let eye = Vec3::new(2.6, 2.6, 4.4);
        directx::perspective(0.8, aspect, 0.1, 30.0)
            * view::look_at_mat4(eye, Vec3::new(0.0, 0.6, 0.0), Vec3::Y)
    }
}
