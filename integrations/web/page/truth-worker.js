// Traces rays until the view changes.

import { compileBaker } from './aogrid/compile.js';
import { Baker } from './aogrid/wasm.js';

/** Rays a pixel at which the image is finished. */
const MAX_RAYS = 1024;

/** Milliseconds between two images, about. */
const BATCH = 200;

const url = String(new URL('./aogrid/aogrid.wasm', import.meta.url));
const started = compileBaker(url).then((module) => Baker.start(module));
let current = 0;

/** Lets messages in. */
const breathe = () => new Promise((done) => setTimeout(done, 0));

async function trace(baker, scene, view) {
  baker.truth(scene);
  let rays = 0;
  let batch = 1;
  while (rays < MAX_RAYS && view === current) {
    const begin = performance.now();
    const transmittance = baker.trace(batch);
    rays += batch;
    const took = performance.now() - begin;
    if (took < BATCH / 2) batch *= 2;
    if (took > 2 * BATCH && batch > 1) batch /= 2;
    const bytes = Uint8Array.from(transmittance, (t) => Math.round(255 * t));
    postMessage({ bytes, width: scene.width, height: scene.height, rays, view });
    await breathe();
  }
}

async function answer({ name, bytes, scene, view }) {
  try {
    const baker = await started;
    if (scene === undefined) baker.load(name, bytes);
    else if (view === current) await trace(baker, scene, view);
  } catch (error) {
    postMessage({ fault: error.message });
  }
}

// Messages wait for each other: models are loaded before the scenes that show them.
let last = started.catch(() => {});
addEventListener('message', ({ data }) => {
  if (data.stop !== undefined) {
    current = data.stop;
    return;
  }
  if (data.view !== undefined) current = data.view;
  last = last.then(() => answer(data));
});
