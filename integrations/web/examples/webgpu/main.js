// Soft contact shadows with plain WebGPU: a robot that walks in a circle, baked in the browser.
//
// Build the package (`npm run build`), serve the root of the repository (`python3 -m http.server`) and
// open /integrations/web/examples/webgpu/.

import { bake } from '../../dist/bake.js';
import { occluderUniform, parseGrid, transmittanceTable } from '../../dist/index.js';
import { SHADING } from '../../dist/wgsl.js';

const SHADER = `${SHADING}
struct Frame { clip_from_world: mat4x4f, world_from_object: mat4x4f }
struct Corner { @builtin(position) clip: vec4f, @location(0) position: vec3f, @location(1) normal: vec3f }
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> occluder: AogridOccluder;
@group(0) @binding(2) var grid: texture_3d<f32>;
@group(0) @binding(3) var table: texture_2d<f32>;
@group(0) @binding(4) var linear_clamp: sampler;

fn corner(position: vec3f, normal: vec3f) -> Corner {
    return Corner(frame.clip_from_world * vec4f(position, 1.0), position, normal);
}
@vertex fn of_robot(@location(0) position: vec3f, @location(1) normal: vec3f) -> Corner {
    let world = frame.world_from_object * vec4f(position, 1.0);
    return corner(world.xyz, (frame.world_from_object * vec4f(normal, 0.0)).xyz);
}
@vertex fn of_floor(@builtin(vertex_index) i: u32) -> Corner {
    let at = vec2f(vec2u(i & 1u, i >> 1u)) * 12.0 - 6.0;
    return corner(vec3f(at.x, 0.0, at.y), vec3f(0.0, 1.0, 0.0));
}
// Ambient light from above, times 1 - AO. Light of lamps would be added without it.
fn lit(color: vec3f, normal: vec3f, transmittance: f32) -> vec4f {
    let ambient = mix(vec3f(0.62, 0.60, 0.58), vec3f(0.96, 0.98, 1.0), 0.5 + 0.5 * normal.y);
    return vec4f(pow(color * ambient * transmittance, vec3f(1.0 / 2.2)), 1.0);
}
@fragment fn floor_color(in: Corner) -> @location(0) vec4f {
    let t = aogrid_cone(occluder, grid, table, linear_clamp, in.position, in.normal);
    return lit(vec3f(0.62), in.normal, t);
}
@fragment fn robot_color(in: Corner) -> @location(0) vec4f {
    let n = normalize(in.normal);
    let t = aogrid_cone_on_itself(occluder, grid, table, linear_clamp, in.position, n);
    return lit(vec3f(0.30, 0.42, 0.55), n, t);
}`;

/** Returns a 2D or 3D texture with these texels. */
function upload(device, size, format, dimension, texels) {
  const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
  const texture = device.createTexture({ size, format, dimension, usage });
  const [, height, depth] = size;
  const layout = { bytesPerRow: texels.byteLength / (height * depth), rowsPerImage: height };
  device.queue.writeTexture({ texture }, texels, layout, size);
  return texture.createView();
}

function buffer(device, usage, size) {
  return device.createBuffer({ size, usage: usage | GPUBufferUsage.COPY_DST });
}

/** Returns the map from world to clip space of a camera that looks down on the floor, in columns. */
function clipFromWorld(aspect) {
  const [sin, cos] = [Math.sin(0.45), Math.cos(0.45)];
  const [focal, near, far, distance, height] = [1.9, 0.1, 50, 5.2, 0.6];
  const scale = far / (near - far);
  // The rows of view space: up, and towards the viewer. Clip z is scale * (z + near), clip w is -z.
  const up = [0, cos, -sin, -height * cos];
  const back = [0, sin, cos, -height * sin - distance];
  const column = (c) => [
    c === 0 ? focal / aspect : 0,
    focal * up[c],
    scale * (back[c] + (c === 3 ? near : 0)),
    -back[c],
  ];
  return new Float32Array([0, 1, 2, 3].flatMap(column));
}

/** Returns where the robot is at a time, in seconds. */
function worldFromObject(time) {
  const angle = 0.6 * time;
  const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
  return new Float32Array([cos, 0, -sin, 0, 0, 1, 0, 0, sin, 0, cos, 0, 1.2 * sin, 0, 1.2 * cos, 1]);
}

async function main() {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) throw new Error('This browser has no WebGPU.');
  const device = await adapter.requestDevice();
  const model = await fetch('../../../../assets/robot.obj');
  const file = { name: 'robot.obj', bytes: await model.arrayBuffer() };
  let corners;
  const { bytes } = await bake(file, {}, { onLoad: (loaded) => (corners = loaded) });
  const grid = parseGrid(bytes);
  document.getElementById('status').textContent = '';
  const canvas = document.getElementById('canvas');
  [canvas.width, canvas.height] = [canvas.clientWidth, canvas.clientHeight];
  const context = canvas.getContext('webgpu');
  const format = navigator.gpu.getPreferredCanvasFormat();
  context.configure({ device, format });

  const frame = buffer(device, GPUBufferUsage.UNIFORM, 128);
  const occluder = buffer(device, GPUBufferUsage.UNIFORM, 208);
  const vertices = buffer(device, GPUBufferUsage.VERTEX, corners.byteLength);
  device.queue.writeBuffer(vertices, 0, corners);
  device.queue.writeBuffer(frame, 0, clipFromWorld(canvas.width / canvas.height));
  const table = transmittanceTable();
  const resources = [
    { buffer: frame },
    { buffer: occluder },
    upload(device, grid.resolution, 'rgba8unorm', '3d', grid.texels),
    upload(device, table.size, 'r16float', '2d', table.texels),
    device.createSampler({ magFilter: 'linear', minFilter: 'linear' }),
  ];
  const visibility = GPUShaderStage.VERTEX | GPUShaderStage.FRAGMENT;
  const kinds = [
    { buffer: {} },
    { buffer: {} },
    { texture: { viewDimension: '3d' } },
    { texture: {} },
    { sampler: {} },
  ];
  const layout = device.createBindGroupLayout({
    entries: kinds.map((kind, binding) => ({ binding, visibility, ...kind })),
  });
  const bindGroup = device.createBindGroup({
    layout,
    entries: resources.map((resource, binding) => ({ binding, resource })),
  });
  const module = device.createShaderModule({ code: SHADER });
  const attributes = [0, 1].map((at) => ({ shaderLocation: at, offset: 12 * at, format: 'float32x3' }));
  const pipeline = (vertex, fragment, buffers, topology) =>
    device.createRenderPipeline({
      layout: device.createPipelineLayout({ bindGroupLayouts: [layout] }),
      vertex: { module, entryPoint: vertex, buffers },
      fragment: { module, entryPoint: fragment, targets: [{ format }] },
      primitive: { topology },
      depthStencil: { format: 'depth24plus', depthCompare: 'less', depthWriteEnabled: true },
    });
  const floor = pipeline('of_floor', 'floor_color', [], 'triangle-strip');
  const robot = pipeline('of_robot', 'robot_color', [{ arrayStride: 24, attributes }], 'triangle-list');
  const depth = device.createTexture({
    size: [canvas.width, canvas.height],
    format: 'depth24plus',
    usage: GPUTextureUsage.RENDER_ATTACHMENT,
  });

  const draw = (milliseconds) => {
    const transform = worldFromObject(milliseconds / 1000);
    device.queue.writeBuffer(frame, 64, transform);
    // All that moves the shadow: 208 bytes a frame.
    device.queue.writeBuffer(occluder, 0, occluderUniform(grid, transform));
    const encoder = device.createCommandEncoder();
    const view = context.getCurrentTexture().createView();
    const pass = encoder.beginRenderPass({
      colorAttachments: [{ view, clearValue: [0.9, 0.92, 0.94, 1], loadOp: 'clear', storeOp: 'store' }],
      depthStencilAttachment: {
        view: depth.createView(), depthClearValue: 1, depthLoadOp: 'clear', depthStoreOp: 'discard',
      },
    });
    pass.setBindGroup(0, bindGroup);
    pass.setPipeline(floor);
    pass.draw(4);
    pass.setPipeline(robot);
    pass.setVertexBuffer(0, vertices);
    pass.draw(corners.length / 6);
    pass.end();
    device.queue.submit([encoder.finish()]);
    requestAnimationFrame(draw);
  };
  requestAnimationFrame(draw);
}

main().catch((error) => (document.getElementById('status').textContent = error.message));
