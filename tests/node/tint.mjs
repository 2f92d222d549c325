// Reads a JSON array of shaders (name, code, entryPoint) from stdin, compiles each with Tint, and
// makes a pipeline of those with an entry point, on Dawn's null backend with WebGPU's default
// limits. Prints a JSON array of [name, what is wrong with it].
import { readFileSync } from 'node:fs';
import { create } from 'webgpu';

const shaders = JSON.parse(readFileSync(0, 'utf8'));
const gpu = create(['backend=null']);
const adapter = await gpu.requestAdapter();
const device = await adapter.requestDevice();

async function check({ code, entryPoint }) {
  device.pushErrorScope('validation');
  const module = device.createShaderModule({ code });
  if (entryPoint) {
    device.createComputePipeline({ layout: 'auto', compute: { module, entryPoint } });
  }
  const error = await device.popErrorScope();
  return error ? error.message : '';
}

const found = [];
for (const shader of shaders) {
  found.push([shader.name, await check(shader)]);
}
console.log(JSON.stringify(found));
device.destroy();
