// The page: what people choose, and what the stage shows of it.

import { parseGrid } from 'aogrid';
import { bake } from 'aogrid/bake';

import { dragObjects, moveByKeys, moveDivider } from './hands.js';
import { drawSlice } from './inspector.js';
import { CAPACITY, MODES, Stage } from './stage.js';
import { TruthView } from './truth.js';

const SAMPLES = ['robot', 'table', 'space-ship', 'box'];

/** Milliseconds after which a moved slider begins a bake. */
const PAUSE = 250;

const at = (id) => document.getElementById(id);
let stage;
let chosen;
let baking;
let rays = 0;
let downloads;

/** Says something in one line. */
function say(text, isFault = false) {
  at('status').textContent = text;
  at('status').classList.toggle('fault', isFault);
}

const kilobytes = (bytes) => `${(bytes / 1024).toFixed(bytes < 10240 ? 1 : 0)} KiB`;

/** Reads the settings of a bake. */
function settings() {
  return {
    resolution: Number(at('resolution').value),
    epsilon: Number(at('epsilon').value),
    encoding: at('encoding').value,
  };
}

/** Bakes a file, as a new object or anew. Only one bake runs at a time: a new one ends the last. */
async function bakeFile(file, known) {
  baking?.abort();
  const controller = (baking = new AbortController());
  const chosenSettings = settings();
  let object = known;
  at('baking').hidden = false;
  at('progress').value = 0;
  say(`Baking ${file.name} …`);
  const start = performance.now();
  try {
    const result = await bake(file, chosenSettings, {
      wasm: new URL('./aogrid/aogrid.wasm', import.meta.url),
      signal: controller.signal,
      onProgress: (share) => (at('progress').value = share),
      onLoad: (corners) => {
        if (object !== undefined || controller.signal.aborted) return;
        object = stage.addObject(file.name, corners);
        object.file = file;
        arrange(object);
        choose(object);
      },
    });
    finish(object, result, chosenSettings, (performance.now() - start) / 1000);
  } catch (error) {
    // What has no grid yet is taken away with it.
    if (object !== undefined && object.grid === undefined) removeObject(object);
    if (error.name === 'AbortError') {
      if (baking === controller) say('Cancelled.');
    } else {
      say(error.message, true);
    }
  }
  if (baking === controller) {
    baking = undefined;
    at('baking').hidden = true;
  }
}

function finish(object, { bytes, notes }, chosenSettings, seconds) {
  const parsed = parseGrid(bytes);
  // Corners are relative to the origin of a model far from zero.
  const grid = { ...parsed, origin: [0, 0, 0] };
  for (const other of stage.objects.filter((o) => o.file === object.file)) {
    Object.assign(other, { bytes, settings: chosenSettings });
    stage.setGrid(other, grid);
  }
  const note = notes.length === 0 ? '' : ` Note: ${notes.join('; ')}.`;
  say(`${object.name}: baked in ${seconds.toFixed(2)} s.${note}`);
  showChosen();
}

/** Places a new object beside the others: four before the wall, then four in front of them. */
function arrange(object) {
  const places = [-0.75, 0.75, -2.2, 2.2];
  const idx = stage.objects.indexOf(object);
  object.group.position.x = places[idx % 4];
  object.group.position.z = Math.floor(idx / 4) % 2 === 0 ? -0.4 : 1.1;
  stage.place(object);
}

function choose(object) {
  chosen = object;
  const its = object?.settings;
  if (its !== undefined) {
    for (const id of ['resolution', 'epsilon', 'encoding']) at(id).value = its[id];
  }
  showChosen();
}

function removeObject(object) {
  stage.removeObject(object);
  if (chosen === object) choose(stage.objects.at(-1));
}

/** Shows what is known of the chosen object. */
function showChosen() {
  at('name').textContent = chosen?.name ?? 'nothing';
  for (const id of ['resolution', 'epsilon', 'encoding', 'height', 'turn', 'scale', 'tilt', 'copy', 'remove']) {
    at(id).disabled = chosen === undefined;
  }
  at('download').disabled = chosen?.grid === undefined;
  if (chosen !== undefined) for (const id of ['height', 'turn', 'scale']) at(id).value = chosen[id];
  showOutputs();
  const grid = chosen?.grid;
  at('facts').textContent = grid === undefined ? 'No grid yet.' : facts(grid);
  if (grid === undefined) return;
  const across = Number(at('across').value);
  const slice = at('slice');
  slice.max = String(grid.resolution[across] - 1);
  showOutputs();
  drawSlice(grid, across, Number(slice.value), at('fraction'), at('axis'));
}

function facts(grid) {
  const cells = grid.resolution.join(' × ');
  const triangles = grid.bake.triangles.toLocaleString('en');
  return `${cells} cells, ${kilobytes(grid.texels.length)}, ${triangles} triangles, mean ${grid.mean.toFixed(4)}`;
}

/** Writes the values of sliders beside their names. */
function showOutputs() {
  for (const input of document.querySelectorAll('#panel input[type=range]')) {
    const output = input.parentElement.querySelector('output');
    if (output !== null) output.textContent = input.value;
  }
}

async function openFiles(files) {
  for (const file of files) {
    if (stage.objects.length === CAPACITY) {
      say(`${CAPACITY} objects are the most that this page shows: remove one first`, true);
      return;
    }
    await bakeFile({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) });
  }
}

async function openSample(name) {
  const response = await fetch(`samples/${name}.obj`);
  if (!response.ok) return say(`samples/${name}.obj: ${response.statusText}`, true);
  const bytes = new Uint8Array(await response.arrayBuffer());
  const file = new File([bytes], `${name}.obj`);
  return openFiles([file]);
}

function copyChosen() {
  if (chosen?.grid === undefined || stage.objects.length === CAPACITY) return;
  const { name, corners, file, bytes, grid, turn, scale, height } = chosen;
  const copy = stage.addObject(name, corners);
  Object.assign(copy, { file, bytes, settings: chosen.settings, turn, scale, height });
  copy.tilt.quaternion.copy(chosen.tilt.quaternion);
  arrange(copy);
  stage.setGrid(copy, grid);
  choose(copy);
}

function download() {
  if (downloads !== undefined) URL.revokeObjectURL(downloads);
  downloads = URL.createObjectURL(new Blob([chosen.bytes], { type: 'image/ktx2' }));
  const link = document.createElement('a');
  link.href = downloads;
  link.download = `${chosen.name.replace(/\.[^.]*$/, '')}.ao.ktx2`;
  link.click();
}

function connectPanel() {
  const onInput = (id, run) => at(id).addEventListener('input', run);
  const onClick = (id, run) => at(id).addEventListener('click', run);
  onInput('strength', () => {
    stage.setStrength(Number(at('strength').value));
    showOutputs();
  });
  at('combine').addEventListener('change', () => stage.setCombine(at('combine').value));
  let timer;
  for (const id of ['resolution', 'epsilon', 'encoding']) {
    onInput(id, () => {
      showOutputs();
      clearTimeout(timer);
      const object = chosen;
      if (object !== undefined) timer = setTimeout(() => bakeFile(object.file, object), PAUSE);
    });
  }
  for (const id of ['height', 'turn', 'scale']) {
    onInput(id, () => {
      if (chosen === undefined) return;
      chosen[id] = Number(at(id).value);
      stage.place(chosen);
      showOutputs();
    });
  }
  for (const id of ['across', 'slice']) onInput(id, showChosen);
  onClick('tilt', () => stage.tilt(chosen));
  onClick('copy', copyChosen);
  onClick('remove', () => removeObject(chosen));
  onClick('download', download);
  onClick('cancel', () => baking?.abort());
  at('file').addEventListener('change', (event) => {
    void openFiles([...event.target.files]);
    event.target.value = '';
  });
  at('sample').addEventListener('change', (event) => {
    void openSample(event.target.value);
    event.target.value = '';
  });
}

function connectDrop() {
  let inside = 0;
  const show = (change) => {
    inside = Math.max(inside + change, 0);
    at('drop').hidden = inside === 0;
  };
  addEventListener('dragenter', () => show(1));
  addEventListener('dragleave', () => show(-1));
  addEventListener('dragover', (event) => event.preventDefault());
  addEventListener('drop', (event) => {
    event.preventDefault();
    inside = 0;
    show(0);
    void openFiles([...(event.dataTransfer?.files ?? [])]);
  });
}

function connectModes() {
  for (const [id, chosenMode] of [['left', 'grids'], ['right', 'off']]) {
    at(id).append(...Object.entries(MODES).map(([mode, text]) => new Option(text, mode)));
    at(id).value = chosenMode;
    at(id).addEventListener('change', () => {
      rays = 0;
      stage.setModes(at('left').value, at('right').value);
    });
  }
}

/** Says what the browser lacks. */
function showMissing() {
  const reason =
    'gpu' in navigator ? 'This browser has WebGPU but no adapter for it' : 'This browser has no WebGPU';
  at('missing').hidden = stage.isWebGPU;
  at('missing').textContent =
    `${reason}: the page uses WebGL 2. The picture is the same; the time of a frame is then that of the ` +
    'processor alone, without the GPU.';
}

function connectStage() {
  const canvas = at('canvas');
  const truth = new TruthView(
    stage,
    ({ bytes, width, height, rays: traced }) => {
      rays = traced;
      stage.setTruth(bytes, width, height);
    },
    (message) => say(message, true),
  );
  stage.onChange = () => {
    rays = 0;
    truth.update();
  };
  dragObjects(stage, canvas, choose);
  moveByKeys(stage, canvas, {
    get: () => chosen,
    changed: showChosen,
    next: () => choose(stage.objects[(stage.objects.indexOf(chosen) + 1) % stage.objects.length]),
    remove: () => removeObject(chosen),
  });
  moveDivider(at('divider'), (place) => {
    stage.split.value = place;
    stage.needsFrame = true;
  });
  const view = at('view');
  const fit = () => stage.resize(view.clientWidth, view.clientHeight);
  new ResizeObserver(fit).observe(view);
  fit();
}

/** Frames of which the middle time is shown. */
const FRAMES = 9;

/** Draws a frame whenever something has changed, and shows the middle time of the last ones. */
async function draw() {
  let times = [];
  let modes = stage.modes;
  for (;;) {
    await new Promise(requestAnimationFrame);
    if (!stage.needsFrame) continue;
    const time = await stage.frame();
    // The first frame of other modes compiles them.
    if (modes === stage.modes) times = [...times, time].slice(-FRAMES);
    else [times, modes] = [[], stage.modes];
    const middle = times.toSorted((a, b) => a - b)[Math.floor(times.length / 2)];
    const grids = new Set(stage.objects.map((object) => object.grid).filter(Boolean));
    const bytes = [...grids].reduce((sum, grid) => sum + grid.texels.length, 0);
    const traced = stage.modes.includes('truth') ? ` · ${rays} rays a pixel` : '';
    const frame = middle === undefined ? 'compiling' : `${middle.toFixed(1)} ms a frame`;
    at('stats').textContent = `${frame} · ${kilobytes(bytes)} of grids${traced}`;
  }
}

async function main() {
  const options = new URLSearchParams(location.search);
  try {
    stage = await Stage.create(at('canvas'), { forceWebGL: options.has('webgl') });
  } catch {
    say('This browser has neither WebGPU nor WebGL 2: the page cannot draw. Try a current one.', true);
    return;
  }
  at('sample').append(new Option('Add a sample …', ''), ...SAMPLES.map((name) => new Option(name, name)));
  connectModes();
  connectPanel();
  connectDrop();
  showMissing();
  connectStage();
  showChosen();
  void draw();
  for (const name of SAMPLES.slice(0, 2)) await openSample(name);
  document.documentElement.dataset.ready = 'true';
  // For curious people at the console, and for tests.
  globalThis.stage = stage;
}

void main();
