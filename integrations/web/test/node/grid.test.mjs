import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';

import { GridError, parseGrid } from '../../dist/index.js';
import { channelValue } from '../../dist/grid.js';

const folder = new URL('../../../../grid-format/tests/golden/', import.meta.url);
const names = readdirSync(folder).filter((name) => name.endsWith('.ao.ktx2'));
const golden = (name) => new Uint8Array(readFileSync(new URL(name, folder)));

/** Returns the code of the error that the bytes give, or nothing. */
function refusal(bytes) {
  try {
    parseGrid(bytes);
    return undefined;
  } catch (error) {
    assert.ok(error instanceof GridError, `${error.stack}`);
    return error.code;
  }
}

/** Returns a copy of the bytes of the first frozen file with a change of its metadata. */
function withMetadata(change) {
  const bytes = golden('v1-moment-unorm8.ao.ktx2');
  const view = new DataView(bytes.buffer);
  const [kvdStart, kvdLength] = [view.getUint32(56, true), view.getUint32(60, true)];
  const text = Buffer.from(bytes.subarray(kvdStart, kvdStart + kvdLength)).toString();
  const start = text.indexOf('aogrid\0{');
  const json = JSON.parse(text.slice(start + 7, text.lastIndexOf('}') + 1));
  change(json);
  const pair = Buffer.from(`aogrid\0${JSON.stringify(json)}\0`);
  const length = Buffer.alloc(4);
  length.writeUInt32LE(pair.length);
  const padding = Buffer.alloc((4 - (pair.length % 4)) % 4);
  // Offsets are in bytes, those of the text in characters: the part before it is ASCII.
  const head = bytes.subarray(kvdStart, kvdStart + start - 4);
  const kvd = Buffer.concat([head, length, pair, padding]);
  const texels = bytes.subarray(bytes.length - 9 * 8 * 11 * 4);
  const result = Buffer.concat([bytes.subarray(0, kvdStart), kvd, texels]);
  result.writeUInt32LE(kvd.length, 60);
  result.writeBigUInt64LE(BigInt(kvdStart + kvd.length), 80);
  return new Uint8Array(result);
}

test('frozen files are read', () => {
  assert.equal(names.length, 9);
  for (const name of names) {
    const [, encoding, format] = /^v1-(\w+)-(\w+)\./.exec(name);
    const grid = parseGrid(golden(name));
    assert.equal(grid.encoding, encoding);
    assert.equal(grid.format, format);
    assert.deepEqual(grid.resolution, [9, 8, 11]);
    assert.deepEqual(grid.center, [0.5, -1.25, 3]);
    assert.deepEqual(grid.halfExtents, [1.5, 2, Math.fround(0.1)]);
    assert.deepEqual(grid.origin, [0, 0, 0]);
    assert.equal(grid.writer, 'aogrid 0.1.0');
    assert.equal(grid.bake.source, 'tést "quoted".obj');
    assert.equal(grid.bake.triangles, 1234);
    assert.deepEqual(grid.bake.flatness, [0, 0, 0, 0]);
    assert.equal(grid.largest, 1);
    let sum = 0;
    const cells = 9 * 8 * 11;
    for (let idx = 0; idx < cells; idx++) {
      const stored = channelValue(grid, idx, grid.channels - 1);
      sum += encoding === 'moment' ? Math.fround(stored * stored) : stored;
    }
    // The sums of both languages are in the same order.
    assert.equal(sum / cells, grid.mean, name);
  }
});

test('an ArrayBuffer is read like an array', () => {
  const bytes = golden(names[0]);
  const padded = new Uint8Array(bytes.length + 3);
  padded.set(bytes, 3);
  assert.deepEqual(parseGrid(padded.subarray(3)).texels, parseGrid(bytes.slice().buffer).texels);
});

test('every truncation is refused', () => {
  const bytes = golden('v1-cone-unorm8.ao.ktx2');
  for (let length = 0; length < bytes.length; length++) {
    assert.equal(refusal(bytes.subarray(0, length)), 'truncated', `${length}`);
  }
  assert.equal(refusal(bytes), undefined);
});

test('a changed byte before the texels is read or refused with a typed error', () => {
  const bytes = golden('v1-moment-f32.ao.ktx2');
  let refused = 0;
  for (let at = 0; at < 760; at++) {
    for (const byte of [0, 1, 0x7f, 0xff, 0x22, 0x7d]) {
      const broken = bytes.slice();
      broken[at] = byte;
      refused += refusal(broken) === undefined ? 0 : 1;
    }
  }
  // Text like the writer's name may change; most bytes may not.
  assert.ok(refused > 1500, `${refused}`);
});

test('faults have their codes', () => {
  const bytes = golden('v1-moment-f32.ao.ktx2');
  const changed = (change) => {
    const copy = bytes.slice();
    change(new DataView(copy.buffer), copy);
    return refusal(copy);
  };
  assert.equal(changed((view) => view.setUint8(1, 0)), 'not-ktx2');
  assert.equal(refusal(Uint8Array.from([...bytes, 0])), 'trailing-bytes');
  assert.equal(changed((view) => view.setUint32(44, 2, true)), 'not-a-grid');
  assert.equal(changed((view) => view.setUint32(12, 43, true)), 'not-a-grid');
  assert.equal(changed((view) => view.setUint32(28, 0, true)), 'not-a-grid');
  assert.equal(changed((view) => view.setUint32(48, 108, true)), 'misplaced');
  assert.equal(changed((view) => view.setUint8(104 + 30, 0x55)), 'not-a-grid');
  assert.equal(changed((view) => view.setUint32(60, 0, true)), 'no-metadata');
  assert.equal(changed((view) => view.setUint32(20, 7, true)), 'box');
  assert.equal(changed((view) => view.setUint32(20, 10, true)), 'level-length');
  const last = bytes.length - 4;
  assert.equal(changed((view) => view.setFloat32(last, 1.5, true)), 'texel');
  assert.equal(changed((view) => view.setFloat32(last, NaN, true)), 'texel');
  assert.equal(changed((view, copy) => copy.fill(0x78, 104 + 92 + 4, 104 + 92 + 23)), 'key-value');
});

test('metadata are checked', () => {
  const code = (change) => refusal(withMetadata(change));
  assert.equal(code(() => {}), undefined);
  assert.equal(code((json) => (json.unknown = [1])), undefined);
  assert.equal(code((json) => (json.version = '1.9')), undefined);
  assert.equal(code((json) => (json.version = '2.0')), 'newer-version');
  assert.equal(code((json) => (json.version = '0.9')), 'metadata-range');
  assert.equal(code((json) => delete json.bake), 'metadata');
  assert.equal(code((json) => (json.encoding = 'sh9')), 'unknown-encoding');
  assert.equal(code((json) => (json.encoding = 'constructor')), 'unknown-encoding');
  assert.equal(code((json) => (json.encoding = 'occlusion')), 'channels');
  assert.equal(code((json) => (json.center = [0, 0])), 'metadata');
  assert.equal(code((json) => (json.half_extents = [1, 0, 1])), 'box');
  assert.equal(code((json) => (json.center = [1e39, 0, 0])), 'box');
  assert.equal(code((json) => (json.mean = 1.1)), 'metadata-range');
  assert.equal(code((json) => (json.bake.flatness = [0, 0, 0, 5])), 'metadata-range');
  assert.equal(code((json) => (json.bake.self_offset = 3)), 'metadata-range');
  assert.equal(code((json) => (json.bake.method.faces.size = 4)), 'metadata-range');
  assert.equal(code((json) => (json.bake.epsilon = -1)), 'metadata-range');
  assert.equal(code((json) => (json.bake.interior = 'none')), 'metadata');
});
