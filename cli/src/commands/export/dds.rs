//! Volume textures as DirectDraw surfaces with the DX10 header: texels as stored.

use anyhow::Context;
use aogrid_grid_format::{Grid, TexelFormat};
use ddsfile::{AlphaMode, Caps2, D3D10ResourceDimension, Dds, DxgiFormat, NewDxgiParams};

/// Returns a grid as a volume texture.
pub(super) fn encode(grid: &Grid) -> anyhow::Result<Vec<u8>> {
    let [width, height, depth] = grid.spec().resolution();
    let mut dds = Dds::new_dxgi(NewDxgiParams {
        width,
        height,
        depth: Some(depth),
        format: format(grid),
        mipmap_levels: None,
        array_layers: None,
        caps2: Some(Caps2::VOLUME),
        is_cubemap: false,
        resource_dimension: D3D10ResourceDimension::Texture3D,
        // The fourth channel is no transparency: programs must not multiply the others by it.
        alpha_mode: AlphaMode::Custom,
    })
    .context("cannot make a DDS header")?;
    dds.data = grid.texels().to_vec();
    let mut bytes = Vec::new();
    dds.write(&mut bytes)
        .context("cannot encode the DDS file")?;
    Ok(bytes)
}

fn format(grid: &Grid) -> DxgiFormat {
    let [one, four] = match grid.format() {
        TexelFormat::Unorm8 => [DxgiFormat::R8_UNorm, DxgiFormat::R8G8B8A8_UNorm],
        TexelFormat::F16 => [DxgiFormat::R16_Float, DxgiFormat::R16G16B16A16_Float],
        TexelFormat::F32 => [DxgiFormat::R32_Float, DxgiFormat::R32G32B32A32_Float],
    };
    match grid.encoding().channels() {
        1 => one,
        _ => four,
    }
}
