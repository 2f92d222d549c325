import assert from 'node:assert/strict';
import { test } from 'node:test';

import { clipTable, overlapTable, transmittanceTable } from '../../dist/index.js';
import { halfToNumber, toHalf } from '../../dist/half.js';
import { ENVIRONMENT, SHADING, SURFACE, VOLUMES } from '../../dist/wgsl.js';

/** Half the distance of half floats in [1/2, 1], for each of two roundings. */
const TWO_ROUNDINGS = 2 * 2 ** -12;

test('T_clip obeys its exact laws', () => {
  const { size, channels, texels } = clipTable();
  const [width, height] = size;
  assert.equal(texels.length, width * height * channels);
  const ao = (x, y) => halfToNumber(texels[4 * (y * width + x)]);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      // AO(a, c) + AO(1 - a, -c) = 1.
      const sum = ao(x, y) + ao(width - 1 - x, height - 1 - y);
      assert.ok(Math.abs(sum - 1) <= 2 * TWO_ROUNDINGS, `${x} ${y} ${sum}`);
    }
  }
});

test('the transmittance is 1 - AO', () => {
  const clip = clipTable().texels;
  const { texels } = transmittanceTable();
  texels.forEach((bits, idx) => {
    const sum = halfToNumber(bits) + halfToNumber(clip[4 * idx]);
    assert.ok(Math.abs(sum - 1) <= TWO_ROUNDINGS);
  });
});

test('overlaps are symmetric, and those of a cone with itself are the cone', () => {
  const { size, texels } = overlapTable();
  const [n, height] = size;
  const at = (x, y, z) => halfToNumber(texels[(z * height + y) * n + x]);
  for (let x = 0; x < n; x++) {
    assert.ok(Math.abs(at(x, x, 0) - x / (n - 1)) <= TWO_ROUNDINGS);
    for (let y = 0; y < n; y++) assert.ok(Math.abs(at(x, y, 9) - at(y, x, 9)) <= TWO_ROUNDINGS);
  }
});

test('the shading library is there', () => {
  assert.match(SHADING, /struct AogridOccluder \{/);
  assert.match(SHADING, /fn aogrid_cone\(/);
  assert.match(ENVIRONMENT, /fn aogrid_/);
  assert.match(SURFACE, /fn aogrid_surface_light/);
  assert.match(VOLUMES, /fn aogrid_/);
});

test('half floats have their values', () => {
  const values = [[0x3c00, 1], [0xc000, -2], [0x0001, 2 ** -24], [0x7bff, 65504], [0x7c00, Infinity]];
  for (const [bits, value] of values) assert.equal(halfToNumber(bits), value);
  assert.ok(Number.isNaN(halfToNumber(0x7c01)));
});

test('numbers become the nearest half floats', () => {
  for (let bits = 0; bits <= 0x3c00; bits++) {
    const value = halfToNumber(bits);
    assert.equal(toHalf(value), bits);
    assert.equal(toHalf(-value) & 0x7fff, bits);
    if (bits === 0x3c00) break;
    const next = halfToNumber(bits + 1);
    const middle = (value + next) / 2;
    assert.equal(toHalf(middle), bits % 2 === 0 ? bits : bits + 1);
    assert.equal(toHalf(middle + (next - value) / 64), bits + 1);
    assert.equal(toHalf(middle - (next - value) / 64), bits);
  }
});
