//! The Rust of `docs/runtime.md`, each block in a function that takes what the block does not
//! declare.

use std::error::Error;

use aogrid_grid_format::Grid;
use aogrid_runtime::*;

type Matrix = [[f32; 4]; 4];

fn with_wgpu_the_raster_pass(
    (device, queue): (wgpu::Device, wgpu::Queue),
    (depth_view, normal_view): (wgpu::TextureView, wgpu::TextureView),
    mut render_pass: wgpu::RenderPass<'_>,
    bytes: Vec<u8>,
    (clip_from_world, world_from_object): (Matrix, Matrix),
) -> Result<(), Box<dyn Error>> {
    // docs/runtime.md, "With wgpu: the raster pass":
    // Once. The same description of your G-buffer serves every pass.
    let format = GBufferFormat {
        positions: Positions::Depth, // or World
        normals: Normals::Unsigned,  // (n + 1)/2, or Signed
        receivers: Receivers::None,  // or Ids, IdsAndLayers
        depth: None,                 // or Some(DepthTest { format, compare })
    };
    let grid = GridTexture::new(&device, &queue, &Grid::from_bytes(&bytes)?, "robot")?;
    let descriptor = OcclusionPassDescriptor {
        label: "proximity shadows".into(),
        mode: Mode::Cone,
        output: Output::Transmittance,
        target: wgpu::TextureFormat::R16Float,
        gbuffer: format,
        front_face: wgpu::FrontFace::Ccw,
    };
    let mut pass = OcclusionPass::new(&device, &queue, descriptor)?;

    // Each frame. Instances share the grid; each has a transform of its own.
    let gbuffer = GBufferViews {
        clip_from_world,
        positions: &depth_view,
        normals: Some(&normal_view),
        receivers: None,
    };
    let frame = Frame {
        gbuffer,
        occluders: &[(&grid, Instance::at(world_from_object))],
    };
    pass.prepare(&device, &queue, &frame)?;
    // In a render pass with the target, cleared to pass.clear_color().
    pass.draw(&mut render_pass);
    // End.
    Ok(())
}

fn merging_by_raster(
    (device, queue): (wgpu::Device, wgpu::Queue),
    depth_view: wgpu::TextureView,
    mut encoder: wgpu::CommandEncoder,
    format: GBufferFormat,
    frame: Frame<'_>,
) -> Result<(), Box<dyn Error>> {
    // docs/runtime.md, "Merging by raster":
    let descriptor = MergePassDescriptor {
        label: "proximity shadows".into(),
        format: wgpu::TextureFormat::Rgba16Float,
        mean: false,
        gbuffer: format,
        front_face: wgpu::FrontFace::Ccw,
    };
    let mut pass = MergePass::new(&device, &queue, descriptor)?;
    pass.prepare(&device, &queue, &frame)?;
    pass.record(&mut encoder, Some(&depth_view)); // None without a depth test
    let left = pass.result(); // (AO/2) d′ summed in xyz, 1 − AO in w
    // End.
    left.map(|_| ()).ok_or("nothing was prepared".into())
}

fn in_tiles(
    (device, queue): (wgpu::Device, wgpu::Queue),
    (storage_view, gbuffer): (wgpu::TextureView, GBufferViews<'_>),
    mut compute_pass: wgpu::ComputePass<'_>,
    format: GBufferFormat,
    (robot, table): (Grid, Grid),
    (robot_instance, table_instance): (Instance, Instance),
) -> Result<(), Box<dyn Error>> {
    // docs/runtime.md, "In tiles":
    // All grids, of one encoding and format, in one texture; occluders name them by their index.
    let atlas = GridAtlas::new(&device, &queue, &[&robot, &table], "grids")?;
    let descriptor = TiledPassDescriptor {
        label: "proximity shadows".into(),
        mode: Mode::Cone,
        combine: Combine::Merge,
        output: Output::TransmittanceAndAxis,
        target: wgpu::TextureFormat::Rgba16Float,
        gbuffer: format,
    };
    let mut pass = TiledPass::new(&device, &queue, descriptor)?;
    let frame = TiledFrame {
        gbuffer,
        atlas: &atlas,
        occluders: &[(0, robot_instance), (1, table_instance)],
        target: &storage_view,
    };
    pass.prepare(&device, &queue, &frame)?;
    pass.dispatch(&mut compute_pass);
    // End.
    Ok(())
}

fn light_from_an_environment(
    (device, queue): (wgpu::Device, wgpu::Queue),
    (sum_view, gbuffer): (wgpu::TextureView, GBufferViews<'_>),
    mut render_pass: wgpu::RenderPass<'_>,
    format: GBufferFormat,
    (width, height, radiance): (usize, usize, Vec<[f32; 3]>),
    ([x, y, z], yaw): ([f32; 3], f32),
) -> Result<(), Box<dyn Error>> {
    // docs/runtime.md, "Light from an environment":
    // Once: prefilters on all processors, a fraction of a second; 1.4 MiB on the device.
    let map = EnvironmentMap::new([width, height], &radiance)?; // as OpenEXR has it: y up
    let map = EnvironmentTexture::new(&device, &queue, &map, "sky");
    let descriptor = EnvironmentPassDescriptor {
        label: "sky".into(),
        reflection: Reflection::Lambertian, // or Glossy
        target: wgpu::TextureFormat::Rgba16Float,
        blend: None,
        depth_stencil: None,
        gbuffer: format, // only glossy surfaces read positions
    };
    let mut pass = EnvironmentPass::new(&device, descriptor)?;

    // Each frame, behind the occlusion pass; draw into the target as its only color attachment.
    let frame = EnvironmentFrame {
        gbuffer,
        eye: [x, y, z, 1.0],
        lobe_half_angle: 0.2,
        environment: AogridEnvironment::new(Up::Y, yaw),
        map: &map,
        occlusion: &sum_view,
    };
    pass.prepare(&device, &queue, &frame)?;
    pass.draw(&mut render_pass);
    // End.
    Ok(())
}

fn volumes_of_a_deforming_object(
    (device, queue): (wgpu::Device, wgpu::Queue),
    mut render_pass: wgpu::RenderPass<'_>,
    (format, gbuffer): (GBufferFormat, GBufferViews<'_>),
    (skinned, indices, triangles): (wgpu::Buffer, wgpu::Buffer, u32),
    world_from_object: Matrix,
) -> Result<(), Box<dyn Error>> {
    // docs/volumes.md, "In a renderer":
    let descriptor = VolumePassDescriptor {
        label: "proximity shadows of characters".into(),
        target: VolumePass::target_format(&device),
        resolution: VolumeResolution::Full,
        gbuffer: format,
        front_face: wgpu::FrontFace::Ccw,
    };
    let mut pass = VolumePass::new(&device, &descriptor)?;
    let object = VolumeObject {
        positions: &skinned, // your vertex buffer, with usage STORAGE
        stride: 8,           // floats from one vertex to the next
        indices: &indices,
        triangles,
        world_from_object,
        volume: AogridVolume::new(0.3, VolumeWeight::Linear { exponent: 1.0 }, false)?,
        strength: 1.0,
        layers: u32::MAX,
        excluded: [AOGRID_NO_OBJECT; 4],
    };
    let objects = &[object];
    pass.prepare(&device, &queue, &VolumeFrame { gbuffer, objects })?;
    pass.draw(&mut render_pass); // over a target that is cleared to 0
    // End.
    Ok(())
}

fn volumes_at_half_resolution(
    (device, queue): (wgpu::Device, wgpu::Queue),
    mut render_pass: wgpu::RenderPass<'_>,
    (format, gbuffer): (GBufferFormat, GBufferViews<'_>),
    half_sums: wgpu::TextureView,
) -> Result<(), Box<dyn Error>> {
    // docs/volumes.md, "In a renderer":
    let descriptor = UpsamplePassDescriptor {
        label: "proximity shadows, upsampled".into(),
        target: wgpu::TextureFormat::R16Float,
        resolution: VolumeResolution::Half,
        gbuffer: format,
    };
    let mut upsampling = UpsamplePass::new(&device, &descriptor)?;
    let extent = 0.3; // the largest of the volumes
    upsampling.prepare(&device, &queue, &gbuffer, &half_sums, extent)?;
    upsampling.draw(&mut render_pass);
    // End.
    Ok(())
}
