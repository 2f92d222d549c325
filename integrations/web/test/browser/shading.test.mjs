import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Baker } from '../../dist/wasm.js';
import { NATIVE, PACKAGE, ROOT } from '../files.mjs';
import { open, start, whySkipped } from './harness.mjs';

/** The filters of a texture have 8 bits or more; both twins round in single precision. */
const WGSL_TOLERANCE = 5e-4;

/** Pictures have 8 bits; edges are seen a pixel apart. */
const PICTURE_TOLERANCE = 2 / 255;
const PICTURE_SHARE = 0.99;

const skip = whySkipped();
const native = existsSync(join(NATIVE, 'cone.png')) ? skip : skip || 'run `node test/native.mjs` first';
const base64 = (name) => readFileSync(join(NATIVE, `${name}.obj.ao.ktx2`)).toString('base64');
let browser;
let view;

before(async () => {
  if (skip) return;
  browser = await start();
  view = await open(browser, '/package/test/browser/pages/blank.html');
});

after(() => browser?.close());

/** Calls an exported function of a module of `pages`. */
function call(module, name, args) {
  return view.page.evaluate(
    async ([file, exported, given]) => (await import(file))[exported](given),
    [`/package/test/browser/pages/${module}.js`, name, args],
  );
}

const scene = (args) => call('scenes', 'render', { grid: base64('robot'), light: 'ambient', ...args });

function meanDifference(a, b) {
  assert.equal(a.length, b.length);
  return a.reduce((sum, v, idx) => sum + Math.abs(v - b[idx]), 0) / a.length;
}

test('65,536 receivers by WGSL are those of the Rust twin', { skip: native }, async () => {
  const urls = {
    gridUrl: '/package/test/native/robot.obj.ao.ktx2',
    receiversUrl: '/package/test/native/receivers.f32',
  };
  const { worst, count, shaded, faults } = await call('receivers', 'compare', urls);
  console.log(`65,536 receivers: ${worst.toExponential(2)} at most`);
  assert.deepEqual(faults, []);
  assert.equal(count, 65_536);
  assert.ok(shaded > 20_000, `${shaded}`);
  assert.ok(worst <= WGSL_TOLERANCE, `${worst}`);
});

test('pictures are those of the native renderer', { skip: native }, async () => {
  const module = await WebAssembly.compile(readFileSync(join(PACKAGE, 'dist', 'aogrid.wasm')));
  const baker = await Baker.start(module);
  const corners = {};
  for (const name of ['robot', 'table']) {
    const bytes = new Uint8Array(readFileSync(join(ROOT, 'assets', `${name}.obj`)));
    corners[name] = [...baker.corners(baker.load(`${name}.obj`, bytes))];
  }
  const grids = { robot: base64('robot'), table: base64('table'), corners };
  for (const [how, mode] of [['node', 'cone'], ['shadows', 'cone'], ['merge', 'merge']]) {
    const expected = await call('scenes', 'picture', `/package/test/native/${mode}.png`);
    // The corner shows nothing but the background.
    const background = expected[0] / 255;
    for (const isWebGL of [false, true]) {
      const found = await call('scenes', 'renderScene', { ...grids, isWebGL, how, background });
      const gray = expected.map((_, idx) => found[4 * idx]);
      const near = gray.filter((v, idx) => Math.abs(v - expected[idx] / 255) <= PICTURE_TOLERANCE);
      const share = near.length / gray.length;
      console.log(`${how}, ${isWebGL ? 'WebGL 2' : 'WebGPU'}: ${share.toFixed(4)} within 2/255`);
      assert.ok(share >= PICTURE_SHARE, `${how} ${isWebGL}: ${share}`);
      // A blank picture would not do: a tenth of the pixels is darkened.
      assert.ok(gray.filter((v) => v < 0.95).length > gray.length / 10);
    }
  }
});

test('WebGPU and WebGL 2 agree', { skip: native }, async () => {
  for (const combine of ['multiply', 'merge']) {
    const args = { combine, count: 3, pane: true };
    const [a, b] = [await scene({ ...args, isWebGL: false }), await scene({ ...args, isWebGL: true })];
    const mean = meanDifference(a, b);
    console.log(`${combine}: WebGPU and WebGL 2 differ by ${(255 * mean).toFixed(4)} of 255`);
    assert.ok(mean <= 0.2 / 255, `${mean}`);
  }
});

test('light of lamps is not darkened, to the bit', { skip: native }, async () => {
  for (const isWebGL of [false, true]) {
    const [off, on] = [
      await scene({ isWebGL, light: 'sun', add: false }),
      await scene({ isWebGL, light: 'sun', add: true }),
    ];
    assert.deepEqual(on, off);
    assert.ok(Math.max(...on.filter((_, idx) => idx % 4 === 0)) > 0.1);
    const lit = await scene({ isWebGL, light: 'both', add: true });
    assert.notDeepEqual(lit, await scene({ isWebGL, light: 'both', add: false }));
  }
});

test('a transparent pane darkens', { skip: native }, async () => {
  const pane = (add, isPane) => scene({ isWebGL: false, add, pane: isPane });
  const [off, on] = [await pane(false, true), await pane(true, true)];
  const [bare, shaded] = [await pane(false, false), await pane(true, false)];
  let panes = 0;
  let darker = 0;
  for (let idx = 0; idx < off.length; idx += 4) {
    if (Math.abs(off[idx] - bare[idx]) < 0.01) continue;
    panes++;
    // The share of the pane itself: half of it covers what is behind.
    const own = off[idx] - on[idx] - 0.5 * (bare[idx] - shaded[idx]);
    darker += own > 0.01 ? 1 : 0;
  }
  assert.ok(panes > 200, `${panes}`);
  assert.ok(darker > 0.2 * panes, `${darker} of ${panes}`);
});

test('grids are loaded, and broken ones refused', { skip: native }, async () => {
  const robot = '/package/test/native/robot.obj.ao.ktx2';
  assert.deepEqual(await call('scenes', 'load', robot), [32, 32, 32]);
  assert.equal(await call('scenes', 'load', '/assets/robot.obj'), 'not-ktx2');
});

test('misuse is explained', { skip: native }, async () => {
  const golden = join(ROOT, 'grid-format', 'tests', 'golden', 'v1-occlusion-unorm8.ao.ktx2');
  const occlusion = readFileSync(golden).toString('base64');
  const messages = await call('scenes', 'misuse', { grid: base64('robot'), occlusion });
  assert.equal(messages.length, 3);
  assert.match(messages[0], /capacity 1000 is not in 1\.\.73/);
  assert.match(messages[1], /encoding `occlusion`, without cones/);
  assert.match(messages[2], /new AoGridShadows\(\{ capacity: 2 \}\)/);
});

test('the plain WebGPU example draws a moving shadow', { skip }, async () => {
  const { page, messages } = await open(browser, '/package/examples/webgpu/index.html', {
    viewport: { width: 320, height: 240 },
  });
  await page.waitForFunction(() => document.getElementById('status').textContent === '', null, {
    timeout: 120_000,
  });
  const first = await page.screenshot();
  await page.waitForTimeout(1500);
  assert.notDeepEqual(await page.screenshot(), first);
  assert.deepEqual(messages, []);
  await page.close();
});

test('the console is empty', { skip: native }, () => {
  assert.deepEqual(view.messages, []);
});
