// The ray-traced truth of the view, accumulated in a Worker of its own.

import { PLANES } from './stage.js';

/** Pixels along the longer side of the image. */
const SIDE = 320;

/** Milliseconds without a change after which rays are traced. */
const PAUSE = 120;

export class TruthView {
  #worker;
  #ids = new Map();
  #timer;
  #view = 0;

  constructor(stage, onImage, onFault) {
    this.stage = stage;
    this.onImage = onImage;
    this.onFault = onFault;
  }

  /** Begins anew, after a pause, or stops if no half of the view shows the truth. */
  update() {
    clearTimeout(this.#timer);
    this.#view++;
    this.#worker?.postMessage({ stop: this.#view });
    if (!this.stage.modes.includes('truth')) return;
    this.#timer = setTimeout(() => this.#begin(), PAUSE);
  }

  #begin() {
    const worker = (this.#worker ??= this.#start());
    const { camera, renderer, objects } = this.stage;
    for (const object of objects) {
      if (this.#ids.has(object.file)) continue;
      this.#ids.set(object.file, this.#ids.size);
      worker.postMessage({ name: object.file.name, bytes: object.file.bytes });
    }
    const { width, height } = renderer.domElement;
    const shrink = SIDE / Math.max(width, height);
    camera.updateMatrixWorld();
    this.stage.scene.updateMatrixWorld();
    const scene = {
      width: Math.max(Math.round(width * shrink), 1),
      height: Math.max(Math.round(height * shrink), 1),
      eye: camera.position.toArray(),
      worldFromClip: worldFromClip(camera),
      planes: PLANES,
      instances: objects.map(({ file, mesh }) => ({
        model: this.#ids.get(file),
        worldFromObject: mesh.matrixWorld.elements.slice(),
      })),
    };
    worker.postMessage({ scene, view: this.#view });
  }

  #start() {
    const worker = new Worker(new URL('./truth-worker.js', import.meta.url), { type: 'module' });
    worker.onerror = (event) => this.onFault(`rays cannot be traced: ${event.message}`);
    worker.onmessage = ({ data }) => {
      if (data.fault !== undefined) this.onFault(data.fault);
      else if (data.view === this.#view) this.onImage(data);
    };
    return worker;
  }
}

/** Returns the inverse of the projection times the view. */
function worldFromClip(camera) {
  return camera.matrixWorld.clone().multiply(camera.projectionMatrixInverse).elements.slice();
}
