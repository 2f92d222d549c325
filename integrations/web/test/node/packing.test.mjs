import assert from 'node:assert/strict';
import { test } from 'node:test';

import { pack } from '../../dist/three/packing.js';

const overlap = (a, b) =>
  [0, 1, 2].every((x) => a.origin[x] < b.origin[x] + b.size[x] && b.origin[x] < a.origin[x] + a.size[x]);

test('packed boxes lie inside and do not overlap', () => {
  const uneven = Array.from({ length: 60 }, (_, i) => [8 + ((7 * i) % 23), 8 + ((5 * i) % 31), 8 + ((3 * i) % 17)]);
  for (const sizes of [[], [[32, 32, 32]], Array(11).fill([32, 32, 32]), uneven]) {
    const packed = pack(sizes, 2048);
    const boxes = sizes.map((size, idx) => ({ size, origin: packed.origins[idx] }));
    boxes.forEach((box, idx) => {
      assert.ok([0, 1, 2].every((x) => box.origin[x] + box.size[x] <= packed.size[x]));
      assert.ok(!boxes.slice(0, idx).some((other) => overlap(other, box)));
    });
    const volume = ([x, y, z]) => x * y * z;
    const used = sizes.reduce((sum, size) => sum + volume(size), 0);
    // Not guaranteed by the algorithm, but expected for these sizes.
    assert.ok(volume(packed.size) <= Math.max(2 * used, 1));
  }
});

test('boxes that do not fit are refused', () => {
  assert.equal(pack(Array(9).fill([32, 32, 32]), 63), undefined);
  assert.deepEqual(pack(Array(8).fill([32, 32, 32]), 64).size, [64, 64, 64]);
  assert.equal(pack([[65, 8, 8]], 64), undefined);
});
