import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { test } from 'node:test';

import { parseGrid } from '../../dist/index.js';
import { BakeError, Baker } from '../../dist/wasm.js';
import { MODELS, NATIVE, PACKAGE } from '../files.mjs';

const module = await WebAssembly.compile(readFileSync(join(PACKAGE, 'dist', 'aogrid.wasm')));
const read = (path) => new Uint8Array(readFileSync(path));
const robot = read(MODELS[1]);

for (const model of MODELS) {
  const name = basename(model);
  const skip = existsSync(model) ? false : `${model} is not there`;
  test(`the grid of ${name} equals the native one`, { skip }, async () => {
    const baker = await Baker.start(module);
    const shares = [];
    const { bytes } = baker.bake(baker.load(name, read(model)), {}, (share) => shares.push(share));
    const native = parseGrid(read(join(NATIVE, `${name}.ao.ktx2`)));
    const found = parseGrid(bytes);
    assert.deepEqual(found, native);
    assert.deepEqual(shares, shares.toSorted((a, b) => a - b));
    assert.equal(shares.at(-1), 1);
    assert.ok(shares.length > 5);
  });
}

test('settings change the grid', async () => {
  const baker = await Baker.start(module);
  const model = baker.load('robot.obj', robot);
  const grid = (settings) => parseGrid(baker.bake(model, settings).bytes);
  const economy = grid({ preset: 'economy' });
  assert.deepEqual([economy.resolution, economy.encoding], [[16, 16, 16], 'moment']);
  const cone = grid({ resolution: 12, encoding: 'cone', epsilon: 0.25 });
  assert.deepEqual([cone.resolution, cone.encoding, cone.bake.epsilon], [[12, 12, 12], 'cone', 0.25]);
  assert.equal(grid({ preset: 'paper', resolution: 8 }).bake.raw.boundary.requested, 'jgt');
});

test('broken models and settings give one line', async () => {
  const baker = await Baker.start(module);
  const message = (run) => {
    try {
      run();
    } catch (error) {
      assert.ok(error instanceof BakeError, error.stack);
      assert.ok(!error.message.includes('\n') && error.message.length > 20, error.message);
      return error.message;
    }
    return assert.fail('no error');
  };
  const text = (content) => new TextEncoder().encode(content);
  assert.match(message(() => baker.load('a.obj', text('v 0 0\n'))), /^a\.obj: .*1/);
  assert.match(message(() => baker.load('a.glb', robot.subarray(0, 4))), /^a\.glb: /);
  assert.match(message(() => baker.load('a.png', text('\x89PNG\r\n\x1a\n0000'))), /^a\.png: /);
  const gltf = '{"asset":{"version":"2.0"},"buffers":[{"uri":"a.bin","byteLength":4}]}';
  assert.match(message(() => baker.load('a.gltf', text(gltf))), /a\.bin.*pack everything into one \.glb/);
  const model = baker.load('robot.obj', robot);
  assert.match(message(() => baker.bake(model, { resolution: 4 })), /resolution 4/);
  assert.match(message(() => baker.bake(model, { preset: 'best' })), /default, economy/);
  // The instance still works.
  assert.equal(baker.bake(model, { resolution: 8 }).bytes.length > 2048, true);
});

test('a call that traps says so', async () => {
  const baker = await Baker.start(module);
  baker.load('robot.obj', robot);
  assert.throws(() => baker.bake(7, {}), /^BakeError: the baker stopped: .*index out of bounds.*$/);
});
