import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';

import { InstanceError, OCCLUDER_BYTES, occluderUniform, parseGrid } from '../../dist/index.js';

const { cases, table } = JSON.parse(
  readFileSync(new URL('../fixtures/occluders.json', import.meta.url), 'utf8'),
);
const golden = new URL('../../../../grid-format/tests/golden/', import.meta.url);
const bytes = (base64) => Uint8Array.from(Buffer.from(base64, 'base64'));
const grids = new Map([['table', parseGrid(bytes(table))]]);

function gridOf(name) {
  if (!grids.has(name)) {
    grids.set(name, parseGrid(readFileSync(new URL(`${name}.ao.ktx2`, golden))));
  }
  return grids.get(name);
}

test('100 random transforms give the bits of Rust', () => {
  assert.equal(cases.length, 100);
  let mirrored = 0;
  cases.forEach((expected, idx) => {
    const matrix = new Float32Array(bytes(expected.matrix).buffer);
    const instance = {
      strength: expected.strength,
      softCones: expected.softCones,
      farField: expected.farField ?? undefined,
      objectId: idx,
      layers: (1 << idx % 32) >>> 0,
      excluded: [idx, 0xffffffff, 5],
    };
    const found = occluderUniform(gridOf(expected.grid), matrix, instance);
    assert.equal(found.byteLength, OCCLUDER_BYTES);
    const [a, b] = [new Uint32Array(found), new Uint32Array(bytes(expected.occluder).buffer)];
    assert.deepEqual(a, b, `case ${idx}, ${expected.grid}`);
    const [x, y, z] = [0, 4, 8].map((c) => [...matrix.subarray(c, c + 3)]);
    const cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    mirrored += cross.reduce((sum, v, k) => sum + v * z[k], 0) < 0 ? 1 : 0;
  });
  assert.equal(mirrored, 34);
});

test('invalid instances are refused', () => {
  const grid = gridOf('table');
  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const code = (at, value, instance) => {
    const matrix = identity.with(at, value);
    try {
      occluderUniform(grid, matrix, instance);
      return undefined;
    } catch (error) {
      assert.ok(error instanceof InstanceError, `${error.stack}`);
      return error.code;
    }
  };
  assert.equal(code(0, 1), undefined);
  assert.equal(code(5, 0), 'singular');
  assert.equal(code(12, NaN), 'not-finite');
  assert.equal(code(0, 1e-45), 'not-finite');
  assert.equal(code(11, -1), 'not-affine');
  assert.equal(code(0, 1, { strength: 1.5 }), 'strength');
  assert.equal(code(0, 1, { farField: -0.1 }), 'far-field');
  assert.equal(code(0, 1, { excluded: [1, 2, 3, 4, 5] }), 'excluded');
});
