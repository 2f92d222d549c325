/** The baker as it runs on the calling thread; pages use `aogrid/bake`, which runs it in a Worker. */

import type { Encoding } from './metadata.js';

/** The presets of the baker, in its order. */
export const PRESETS = ['default', 'economy', 'fine', 'paper'] as const;

/** The encodings of the baker, in its order. */
const ENCODINGS: readonly Encoding[] = ['moment', 'cone', 'occlusion'];

/** What a bake may choose; what is left out is the preset's. */
export interface BakeSettings {
  /** `default` has 32³ cells, `economy` 16³, `fine` 48³; `paper` is the method as printed. */
  preset?: (typeof PRESETS)[number];
  /** Cells along each axis, 8 or more. */
  resolution?: number;
  /** ε of RR-5779 eq. 4: the occlusion at which the box ends. */
  epsilon?: number;
  encoding?: Encoding;
}

/** A baked grid. */
export interface BakeResult {
  /** The grid file, for `parseGrid` or to save as `*.ao.ktx2`. */
  bytes: Uint8Array<ArrayBuffer>;
  /** Remarks about the model, a sentence each. */
  notes: string[];
}

/** The reason that a model cannot be loaded or baked. */
export class BakeError extends Error {
  override readonly name = 'BakeError';
}

/** A parallelogram: its center and the vectors to the middles of two edges. */
export interface Plane {
  center: ArrayLike<number>;
  halfEdges: [ArrayLike<number>, ArrayLike<number>];
}

/** A scene for ray tracing. */
export interface TruthScene {
  width: number;
  height: number;
  eye: ArrayLike<number>;
  /** The inverse of the projection times the view, in columns. */
  worldFromClip: ArrayLike<number>;
  planes: Plane[];
  instances: { model: number; worldFromObject: ArrayLike<number> }[];
}

interface Exports {
  memory: WebAssembly.Memory;
  aogrid_alloc(length: number): number;
  aogrid_output(): number;
  aogrid_output_length(): number;
  aogrid_load(bytes: number, length: number, name: number, nameLength: number): number;
  aogrid_corners(model: number): void;
  aogrid_bake(
    model: number,
    preset: number,
    resolution: number,
    epsilon: number,
    encoding: number,
  ): number;
  aogrid_notes(): void;
  aogrid_truth(numbers: number, count: number): void;
  aogrid_trace(passes: number): void;
}

/** What the functions that the baker calls share with its instance. */
interface State {
  panic?: string;
  onProgress?: (share: number) => void;
}

/** An instance of the compiled baker. */
export class Baker {
  readonly #exports: Exports;
  readonly #state: State;

  private constructor(exports: Exports, state: State) {
    this.#exports = exports;
    this.#state = state;
  }

  /** Starts the baker from the module `aogrid.wasm`. */
  static async start(module: WebAssembly.Module): Promise<Baker> {
    const state: State = {};
    let memory: WebAssembly.Memory | undefined;
    const instance = await WebAssembly.instantiate(module, {
      aogrid: {
        progress: (share: number) => state.onProgress?.(share),
        panicked: (at: number, length: number) => {
          const text = new TextDecoder().decode(new Uint8Array(memory!.buffer, at, length));
          state.panic = text.replace(/\s*\n\s*/g, ' ');
        },
      },
    });
    const exports = instance.exports as unknown as Exports;
    memory = exports.memory;
    return new Baker(exports, state);
  }

  /**
   * Loads a model: .obj, .glb, .stl, .ply, or .gltf with its buffers inside. Returns its number.
   *
   * @throws {BakeError} One line that says what is wrong with the file.
   */
  load(name: string, bytes: Uint8Array): number {
    const text = new TextEncoder().encode(name);
    const [at, nameAt] = [this.#put(bytes), this.#put(text)];
    return this.#checked((e) => e.aogrid_load(at, bytes.length, nameAt, text.length));
  }

  /**
   * Returns the corners of a model, three a triangle, relative to its origin: positions and normals, each
   * x, y and z, in turn.
   */
  corners(model: number): Float32Array<ArrayBuffer> {
    this.#call((e) => e.aogrid_corners(model));
    return new Float32Array(this.#output().buffer);
  }

  /**
   * Bakes a loaded model.
   *
   * @throws {BakeError} One line that says why it cannot be baked.
   */
  bake(model: number, settings: BakeSettings, onProgress?: (share: number) => void): BakeResult {
    const { preset = 'default', resolution = 0, epsilon = 0, encoding } = settings;
    this.#state.onProgress = onProgress;
    const presetIdx = PRESETS.indexOf(preset);
    const encodingIdx = encoding === undefined ? -1 : ENCODINGS.indexOf(encoding);
    if (presetIdx < 0) throw new BakeError(`preset \`${preset}\` is none of ${PRESETS.join(', ')}`);
    this.#checked((e) => e.aogrid_bake(model, presetIdx, resolution, epsilon, encodingIdx));
    const bytes = this.#output();
    this.#call((e) => e.aogrid_notes());
    const notes = new TextDecoder().decode(this.#output());
    return { bytes, notes: notes === '' ? [] : notes.split('\n') };
  }

  /** Begins the ray-traced image of a scene of loaded models. */
  truth(scene: TruthScene): void {
    const numbers = [
      scene.width,
      scene.height,
      ...Array.from(scene.eye),
      ...Array.from(scene.worldFromClip),
      scene.planes.length,
      ...scene.planes.flatMap(({ center, halfEdges }) =>
        [center, ...halfEdges].flatMap((vector) => Array.from(vector)),
      ),
      scene.instances.length,
      ...scene.instances.flatMap((instance) => [
        instance.model,
        ...Array.from(instance.worldFromObject),
      ]),
    ];
    const at = this.#put(new Uint8Array(new Float64Array(numbers).buffer));
    this.#call((e) => e.aogrid_truth(at, numbers.length));
  }

  /** Traces more rays a pixel, and returns 1 − AO of each pixel, rows from top to bottom. */
  trace(passes: number): Float32Array<ArrayBuffer> {
    this.#call((e) => e.aogrid_trace(passes));
    return new Float32Array(this.#output().buffer);
  }

  /** Copies bytes into the memory of the baker, which frees them. */
  #put(bytes: Uint8Array): number {
    const at = this.#call((e) => e.aogrid_alloc(bytes.length));
    new Uint8Array(this.#exports.memory.buffer, at, bytes.length).set(bytes);
    return at;
  }

  #output(): Uint8Array<ArrayBuffer> {
    const at = this.#exports.aogrid_output();
    const length = this.#exports.aogrid_output_length();
    return new Uint8Array(this.#exports.memory.buffer, at, length).slice();
  }

  #checked(call: (exports: Exports) => number): number {
    const result = this.#call(call);
    if (result < 0) throw new BakeError(new TextDecoder().decode(this.#output()));
    return result;
  }

  #call<R>(call: (exports: Exports) => R): R {
    try {
      return call(this.#exports);
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError || error instanceof RangeError)) throw error;
      const reason = this.#state.panic ?? 'the memory of the browser is too small for it';
      throw new BakeError(`the baker stopped: ${reason}`, { cause: error });
    }
  }
}
