// Shades receivers with the WGSL library, by a compute shader without three.js.

import { occluderUniform, parseGrid, transmittanceTable } from 'aogrid';
import { SHADING } from 'aogrid/wgsl';

const SHADER = `${SHADING}
@group(0) @binding(0) var<uniform> occluder: AogridOccluder;
@group(0) @binding(1) var grid: texture_3d<f32>;
@group(0) @binding(2) var table: texture_2d<f32>;
@group(0) @binding(3) var linear_clamp: sampler;
// Position and normal of each receiver, and what is found.
@group(0) @binding(4) var<storage, read> receivers: array<f32>;
@group(0) @binding(5) var<storage, read_write> found: array<vec2f>;

@compute @workgroup_size(64)
fn shade(@builtin(global_invocation_id) id: vec3u) {
    let at = 8u * id.x;
    let position = vec3f(receivers[at], receivers[at + 1u], receivers[at + 2u]);
    let normal = vec3f(receivers[at + 3u], receivers[at + 4u], receivers[at + 5u]);
    found[id.x] = vec2f(
        aogrid_cone(occluder, grid, table, linear_clamp, position, normal),
        aogrid_cone_on_itself(occluder, grid, table, linear_clamp, position, normal));
}`;

function upload(device, size, format, dimension, bytes) {
  const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
  const texture = device.createTexture({ size, format, dimension, usage });
  const [width, height, depth] = size;
  const layout = { bytesPerRow: bytes.byteLength / (height * depth), rowsPerImage: height };
  device.queue.writeTexture({ texture }, bytes, layout, [width, height, depth]);
  return texture.createView();
}

function buffer(device, usage, data) {
  const made = device.createBuffer({ size: data.byteLength, usage: usage | GPUBufferUsage.COPY_DST });
  device.queue.writeBuffer(made, 0, data);
  return made;
}

/** Returns the largest difference of both values of all receivers, and the number of receivers. */
export async function compare({ gridUrl, receiversUrl }) {
  const bytes = async (url) => (await fetch(url)).arrayBuffer();
  const grid = parseGrid(await bytes(gridUrl));
  const floats = new Float32Array(await bytes(receiversUrl));
  const [matrix, receivers] = [floats.slice(0, 16), floats.slice(16)];
  const count = receivers.length / 8;
  const device = await (await navigator.gpu.requestAdapter()).requestDevice();
  const faults = [];
  device.addEventListener('uncapturederror', ({ error }) => faults.push(error.message));
  const module = device.createShaderModule({ code: SHADER });
  const pipeline = device.createComputePipeline({ layout: 'auto', compute: { module } });
  const table = transmittanceTable();
  const found = device.createBuffer({
    size: 8 * count,
    usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC,
  });
  const resources = [
    { buffer: buffer(device, GPUBufferUsage.UNIFORM, occluderUniform(grid, matrix)) },
    upload(device, grid.resolution, 'rgba8unorm', '3d', grid.texels),
    upload(device, table.size, 'r16float', '2d', table.texels),
    device.createSampler({ magFilter: 'linear', minFilter: 'linear' }),
    { buffer: buffer(device, GPUBufferUsage.STORAGE, receivers) },
    { buffer: found },
  ];
  const entries = resources.map((resource, binding) => ({ binding, resource }));
  const encoder = device.createCommandEncoder();
  const compute = encoder.beginComputePass();
  compute.setPipeline(pipeline);
  compute.setBindGroup(0, device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
  compute.dispatchWorkgroups(count / 64);
  compute.end();
  const read = device.createBuffer({
    size: 8 * count,
    usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST,
  });
  encoder.copyBufferToBuffer(found, 0, read, 0, 8 * count);
  device.queue.submit([encoder.finish()]);
  await read.mapAsync(GPUMapMode.READ);
  const values = new Float32Array(read.getMappedRange());
  let worst = 0;
  let shaded = 0;
  for (let idx = 0; idx < count; idx++) {
    for (const side of [0, 1]) {
      const difference = Math.abs(values[2 * idx + side] - receivers[8 * idx + 6 + side]);
      worst = Math.max(worst, Number.isNaN(difference) ? Infinity : difference);
    }
    shaded += receivers[8 * idx + 6] < 1 ? 1 : 0;
  }
  return { worst, count, shaded, faults };
}
