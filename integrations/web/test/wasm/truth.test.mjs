import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';

import * as mat4 from '../../dist/mat4.js';
import { Baker } from '../../dist/wasm.js';
import { PACKAGE, ROOT } from '../files.mjs';

const module = await WebAssembly.compile(readFileSync(join(PACKAGE, 'dist', 'aogrid.wasm')));

/** Returns a sphere of radius 1 as an OBJ file. */
function sphere(segments) {
  const lines = [];
  for (let j = 0; j <= segments / 2; j++) {
    for (let i = 0; i < segments; i++) {
      const [theta, phi] = [(2 * Math.PI * j) / segments, (2 * Math.PI * i) / segments];
      lines.push(`v ${Math.sin(theta) * Math.cos(phi)} ${Math.cos(theta)} ${Math.sin(theta) * Math.sin(phi)}`);
    }
  }
  const at = (i, j) => 1 + j * segments + (i % segments);
  for (let j = 0; j < segments / 2; j++) {
    for (let i = 0; i < segments; i++) {
      const upper = j === 0 ? [at(i, j)] : [at(i, j), at(i + 1, j)];
      const lower = j + 1 === segments / 2 ? [at(i, j + 1)] : [at(i + 1, j + 1), at(i, j + 1)];
      lines.push(`f ${[...upper, ...lower].join(' ')}`);
    }
  }
  return new TextEncoder().encode(lines.join('\n'));
}

/** Returns the map from clip to world space of a camera at `eye` that looks along −x at the origin. */
function worldFromClip(eye, fov) {
  const length = Math.hypot(...eye);
  const back = eye.map((v) => v / length);
  const right = [0, 0, -1];
  const up = [
    back[1] * right[2] - back[2] * right[1],
    back[2] * right[0] - back[0] * right[2],
    back[0] * right[1] - back[1] * right[0],
  ];
  const worldFromView = [...right, 0, ...up, 0, ...back, 0, ...eye, 1];
  const focal = 1 / Math.tan(fov / 2);
  const [near, far] = [0.1, 100];
  const [a, b] = [far / (near - far), (near * far) / (near - far)];
  const projection = [focal, 0, 0, 0, 0, focal, 0, 0, 0, 0, a, -1, 0, 0, b, 0];
  return mat4.multiply(worldFromView, mat4.inverse(projection));
}

/** A sphere of radius r, its center at distance d above a point of a floor, occludes (r/d)² of its light. */
test('a sphere above a floor has the exact occlusion', async () => {
  const baker = await Baker.start(module);
  const model = baker.load('sphere.obj', sphere(128));
  const eye = [8, 0.3, 0];
  for (const [scale, above] of [[1, 2], [0.5, 2], [-1.5, 2]]) {
    baker.truth({
      width: 16,
      height: 16,
      eye,
      // So narrow that all pixels see about the same point.
      worldFromClip: worldFromClip(eye, 1e-3),
      planes: [{ center: [0, 0, 0], halfEdges: [[0, 0, 50], [50, 0, 0]] }],
      instances: [{ model, worldFromObject: mat4.multiply(mat4.translation([0, above, 0]), mat4.scale([scale, Math.abs(scale), Math.abs(scale)])) }],
    });
    baker.trace(16);
    const all = baker.trace(48);
    assert.equal(all.length, 256);
    const mean = all.reduce((sum, t) => sum + t, 0) / all.length;
    const expected = 1 - (Math.abs(scale) / above) ** 2;
    // 16,384 evenly spread rays err by less than independent ones, whose 3 standard deviations are 0.0117.
    assert.ok(Math.abs(mean - expected) < 0.0117, `${scale}: ${mean} ${expected}`);
  }
});

test('where nothing is seen or nothing occludes, all is open', async () => {
  const baker = await Baker.start(module);
  const eye = [8, 0.3, 0];
  const scene = { width: 4, height: 4, eye, worldFromClip: worldFromClip(eye, 0.1), planes: [], instances: [] };
  baker.truth(scene);
  assert.ok(baker.trace(2).every((t) => t === 1));
  baker.truth({ ...scene, planes: [{ center: [0, 0, 0], halfEdges: [[0, 0, 50], [50, 0, 0]] }] });
  assert.ok(baker.trace(2).every((t) => t === 1));
});

test('corners have unit normals: a box keeps its edges, a sphere is smooth', async () => {
  const baker = await Baker.start(module);
  const box = readFileSync(join(ROOT, 'assets', 'box.obj'));
  const cases = [
    // The largest component of a normal of a box is 1; the normal of a sphere is its position.
    ['box.obj', box, (_, n) => Math.max(...n.map(Math.abs))],
    ['sphere.obj', sphere(64), (p, n) => p.reduce((sum, v, x) => sum + v * n[x], 0)],
  ];
  for (const [name, bytes, cosine] of cases) {
    const corners = baker.corners(baker.load(name, bytes));
    assert.equal(corners.length % 18, 0);
    for (let at = 0; at < corners.length; at += 6) {
      const [p, n] = [[...corners.subarray(at, at + 3)], [...corners.subarray(at + 3, at + 6)]];
      assert.ok(Math.abs(Math.hypot(...n) - 1) < 1e-5);
      assert.ok(cosine(p, n) > 0.995, `${name} ${p} ${n}`);
    }
  }
});
