import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { parseGrid } from '../../dist/index.js';
import { PACKAGE, ROOT, SHARED } from '../files.mjs';
import { open, start, whySkipped } from './harness.mjs';

const skip = whySkipped();

/** Milliseconds for what a slow rasterizer and a busy machine may take. */
const PATIENCE = 120_000;

const SHOTS = join(PACKAGE, 'test', 'browser', 'shots');
const GLB = join(SHARED, 'data', 'meshes', 'Duck_4212.glb');
let browser;
let page;
let messages;

before(async () => {
  if (skip) return;
  mkdirSync(SHOTS, { recursive: true });
  browser = await start();
  ({ page, messages } = await open(browser, '/page/index.html', {
    viewport: { width: 800, height: 420 },
  }));
  page.setDefaultTimeout(PATIENCE);
  await page.waitForFunction(() => globalThis.stage !== undefined);
});

after(() => browser?.close());

const status = () => page.textContent('#status');
const stageValue = (read) => page.evaluate(`(${read})(stage)`);

/** Drops files on the page. */
async function drop(files) {
  await page.evaluate((given) => {
    const data = new DataTransfer();
    for (const [name, bytes] of given) data.items.add(new File([Uint8Array.from(bytes)], name));
    dispatchEvent(new DragEvent('drop', { dataTransfer: data, cancelable: true }));
  }, files);
}

const waitForStatus = (pattern) =>
  page.waitForFunction(
    (text) => new RegExp(text).test(document.getElementById('status').textContent),
    pattern,
  );

/** Sets a slider or a selection. */
const set = (id, value) =>
  page.evaluate(
    ([name, to]) => {
      const input = document.getElementById(name);
      input.value = to;
      input.dispatchEvent(new Event('input', { bubbles: true }));
      input.dispatchEvent(new Event('change', { bubbles: true }));
    },
    [id, String(value)],
  );

test('samples are baked at the start', { skip }, async () => {
  assert.match(await status(), /^table\.obj: baked in [\d.]+ s\.$/);
  assert.equal(await stageValue((s) => s.objects.filter((o) => o.grid).length), 2);
  assert.equal(await page.isHidden('#missing'), true);
  assert.match(await page.textContent('#facts'), /32 × 32 × 32 cells, 128 KiB, 60 triangles/);
});

test('a dropped OBJ and GLB are baked', { skip }, async () => {
  await drop([['box.obj', [...readFileSync(join(ROOT, 'assets', 'box.obj'))]]]);
  await waitForStatus('^box\\.obj: baked');
  if (existsSync(GLB)) {
    await drop([['duck.glb', [...readFileSync(GLB)]]]);
    await waitForStatus('^duck\\.glb: baked');
    assert.match(await page.textContent('#facts'), /4,212 triangles/);
  } else {
    console.log(`skipped: ${GLB} is not there`);
  }
  assert.equal(await page.isHidden('#baking'), true);
});

test('a dragged object moves, and the camera does not', { skip }, async () => {
  const robot = await page.evaluate(() => {
    const { mesh, group } = stage.objects[0];
    const center = mesh.geometry.boundingSphere ?? (mesh.geometry.computeBoundingSphere(), mesh.geometry.boundingSphere);
    const at = center.center.clone().applyMatrix4(mesh.matrixWorld).project(stage.camera);
    const box = document.getElementById('canvas').getBoundingClientRect();
    const pixel = [box.left + ((at.x + 1) / 2) * box.width, box.top + ((1 - at.y) / 2) * box.height];
    return { pixel, position: group.position.toArray(), camera: stage.camera.position.toArray() };
  });
  const [x, y] = robot.pixel;
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x - 30, y + 12, { steps: 4 });
  await page.mouse.up();
  const moved = await stageValue((s) => s.objects[0].group.position.toArray());
  assert.ok(moved[0] < robot.position[0] - 0.05, `${moved}`);
  assert.ok(moved[2] > robot.position[2] + 0.02, `${moved}`);
  assert.deepEqual(await stageValue((s) => s.camera.position.toArray()), robot.camera);
  assert.equal(await page.textContent('#name'), 'robot.obj');
  // Beside the objects a drag moves the camera.
  await page.mouse.move(20, 380);
  await page.mouse.down();
  await page.mouse.move(60, 380, { steps: 3 });
  await page.mouse.up();
  await page.waitForFunction((from) => stage.camera.position.x !== from, robot.camera[0]);
});

test('keys move, turn, scale and choose', { skip }, async () => {
  await page.focus('#canvas');
  const read = () => stageValue(({ objects: [{ group, turn, scale, height }] }) => [group.position.x, turn, scale, height]);
  const from = await read();
  for (const key of ['ArrowRight', 'e', '+', 'PageUp']) await page.keyboard.press(key);
  const to = await read();
  assert.ok(to.every((v, idx) => v > from[idx]), `${from} ${to}`);
  await page.keyboard.press('n');
  assert.equal(await page.textContent('#name'), 'table.obj');
  await page.focus('#divider');
  await page.keyboard.press('ArrowRight');
  assert.equal(await page.getAttribute('#divider', 'aria-valuenow'), '52');
  assert.equal((await stageValue((s) => s.split.value)).toFixed(2), '0.52');
});

test('each slider has its effect', { skip }, async () => {
  await set('strength', 0.4);
  assert.equal(await stageValue((s) => s.strength), 0.4);
  for (const [id, value] of [['height', 0.5], ['turn', 30], ['scale', 0.5]]) {
    await set(id, value);
    assert.equal(await page.evaluate((name) => stage.objects[1][name], id), value);
  }
  const grid = (read) => page.waitForFunction(`(${read})(stage.objects[1].grid)`);
  await set('resolution', 16);
  await grid((g) => g.resolution[0] === 16);
  await set('epsilon', 0.4);
  await grid((g) => g.bake.epsilon > 0.39 && g.bake.epsilon < 0.41);
  await set('encoding', 'cone');
  await grid((g) => g.encoding === 'cone');
  await set('combine', 'merge');
  await page.waitForFunction(() => document.getElementById('baking').hidden);
  const slice = () => page.evaluate(() => document.getElementById('fraction').toDataURL());
  await set('slice', 2);
  const first = await slice();
  await set('slice', 8);
  assert.notEqual(await slice(), first);
  await set('across', 0);
  assert.match(await page.getAttribute('#slice', 'max'), /^15$/);
});

test('the grid can be downloaded', { skip }, async () => {
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#download')]);
  assert.equal(download.suggestedFilename(), 'table.ao.ktx2');
  const grid = parseGrid(readFileSync(await download.path()));
  assert.deepEqual([grid.resolution[0], grid.encoding], [16, 'cone']);
});

test('broken files show one clear line', { skip }, async () => {
  const text = (content) => [...new TextEncoder().encode(content)];
  const count = await stageValue((s) => s.objects.length);
  const files = [
    ['a.obj', text('v 0 0\nf 1 2 3\n'), 'a\\.obj: .*line 1'],
    ['b.glb', text('glTF\x02\0\0\0'), 'b\\.glb: '],
    ['c.png', text('\x89PNG\r\n\x1a\n'), 'c\\.png: '],
    ['d.obj', text('# nothing\n'), 'd\\.obj: '],
  ];
  for (const [name, bytes, pattern] of files) {
    await drop([[name, bytes]]);
    await waitForStatus(pattern);
    const said = await status();
    console.log(said);
    assert.ok(said.length < 200 && !said.includes('\n'), said);
    assert.equal(await page.getAttribute('#status', 'class'), 'fault');
  }
  assert.equal(await stageValue((s) => s.objects.length), count);
});

test('a bake can be cancelled', { skip }, async () => {
  await set('resolution', 64);
  await page.waitForFunction(() => !document.getElementById('baking').hidden);
  await page.click('#cancel');
  await waitForStatus('^Cancelled');
  assert.equal(await stageValue((s) => s.objects[1].grid.resolution[0]), 16);
});

test('every mode draws, and the truth accumulates', { skip }, async () => {
  for (const mode of ['off', 'gtao', 'truth']) {
    await page.selectOption('#right', mode);
    await page.waitForFunction(() => !stage.needsFrame);
  }
  await page.waitForFunction(() => / ([2-9]|\d\d+) rays a pixel/.test(document.getElementById('stats').textContent));
  const truth = await page.evaluate(() => {
    const { data } = stage.truth.value.image;
    return { least: Math.min(...data), most: Math.max(...data) };
  });
  assert.ok(truth.least < 128 && truth.most === 255, `${truth.least} ${truth.most}`);
});

test('it fits wide and narrow windows', { skip }, async () => {
  for (const [width, height] of [[1280, 800], [400, 800]]) {
    await page.setViewportSize({ width, height });
    await page.waitForFunction((w) => stage.camera.aspect <= w / 200 && !stage.needsFrame, width);
    await page.screenshot({ path: join(SHOTS, `${width}.png`) });
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= width);
  }
});

test('an object can be removed', { skip }, async () => {
  const count = await stageValue((s) => s.objects.length);
  await page.evaluate(() => document.getElementById('remove').click());
  assert.equal(await stageValue((s) => s.objects.length), count - 1);
});

test('without WebGPU the page says what is missing', { skip }, async () => {
  const opened = await open(browser, '/page/index.html?webgl', { viewport: { width: 500, height: 300 } });
  await opened.page.waitForFunction(() => globalThis.stage !== undefined, null, { timeout: PATIENCE });
  assert.match(await opened.page.textContent('#missing'), /uses WebGL 2/);
  assert.equal(await opened.page.isVisible('#missing'), true);
  assert.deepEqual(opened.messages, []);
  await opened.page.close();
});

test('the console of the page is empty', { skip }, () => {
  assert.deepEqual(messages, []);
});
