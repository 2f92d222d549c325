/** Baking in a Worker, so that a page stays responsive. */

import { BakeError } from './wasm.js';
import type { BakeResult, BakeSettings } from './wasm.js';

export { BakeError, PRESETS } from './wasm.js';
export type { BakeResult, BakeSettings } from './wasm.js';

/** A model file. */
export interface ModelFile {
  /** The file's name, which tells the format where the content does not. */
  name: string;
  /** The content: .obj, .glb, .stl, .ply, or .gltf with its buffers inside. */
  bytes: ArrayBuffer | Uint8Array;
}

/** How to run a bake. */
export interface BakeRun {
  /** It is called with the finished share, 0..1. */
  onProgress?: (share: number) => void;
  /**
   * It is called before the bake with the model for display, relative to its origin: three corners a
   * triangle, each a position and a normal, six floats.
   */
  onLoad?: (corners: Float32Array<ArrayBuffer>) => void;
  /** It cancels the bake at once; the promise is then rejected with its reason. */
  signal?: AbortSignal;
  /** The URL of `aogrid.wasm`; the default is beside this module. */
  wasm?: string | URL;
}

/** What a Worker is told. */
export interface BakeRequest {
  name: string;
  bytes: Uint8Array;
  settings: BakeSettings;
  wantsCorners: boolean;
  wasm: string;
}

/** What a Worker answers. */
export type BakeReply =
  | { progress: number }
  | { corners: Float32Array<ArrayBuffer> }
  | { result: BakeResult }
  | { error: string };

/**
 * Bakes the grid of a model in a Worker of its own.
 *
 * @throws {BakeError} One line that says what is wrong with the model.
 */
export function bake(
  model: ModelFile,
  settings: BakeSettings = {},
  run: BakeRun = {},
): Promise<BakeResult> {
  const { onProgress, onLoad, signal } = run;
  const wasm = String(run.wasm ?? new URL('./aogrid.wasm', import.meta.url));
  return new Promise((resolve, reject) => {
    if (signal?.aborted) return reject(signal.reason);
    const worker = new Worker(new URL('./bake-worker.js', import.meta.url), { type: 'module' });
    const finish = (settle: () => void) => {
      worker.terminate();
      signal?.removeEventListener('abort', cancel);
      settle();
    };
    const cancel = () => finish(() => reject(signal?.reason));
    signal?.addEventListener('abort', cancel);
    worker.onerror = (event) => {
      event.preventDefault();
      const message = `the baker cannot be started: ${event.message || 'its Worker does not load'}`;
      finish(() => reject(new BakeError(message)));
    };
    worker.onmessage = ({ data }: MessageEvent<BakeReply>) => {
      if ('progress' in data) onProgress?.(data.progress);
      else if ('corners' in data) onLoad?.(data.corners);
      else if ('result' in data) finish(() => resolve(data.result));
      else finish(() => reject(new BakeError(data.error)));
    };
    const bytes = new Uint8Array(model.bytes);
    const wantsCorners = onLoad !== undefined;
    const request: BakeRequest = { name: model.name, bytes, settings, wantsCorners, wasm };
    worker.postMessage(request);
  });
}
