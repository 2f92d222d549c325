import type { ContextNode, Node, NodeBuilder, Object3D } from 'three/webgpu';
import { Fn, Loop, buffer, context, float, int, renderGroup, texture3D, uniform, vec4 } from 'three/tsl';

import type { Grid } from '../grid.js';
import { createAtlas } from './atlas.js';
import type { Atlas } from './atlas.js';
import { idOfAncestor, receiver } from './receiver.js';
import { ROWS, rowOf, writeRows } from './rows.js';
import type { OccluderOptions, Placed } from './rows.js';
import { contribution, merge, multiply } from './shading.js';

/** How several objects are shaded together. */
export interface AoGridShadowsOptions {
  /** The largest number of objects: at most 73, what WebGL 2 guarantees. The default is 16. */
  capacity?: number;
  /**
   * `multiply` takes objects as independent, `merge` as cones, which is more accurate where they overlap
   * as seen from a receiver, and depends on the order in which they were added. The default is `multiply`.
   */
  combine?: 'multiply' | 'merge';
}

/** Floats of a uniform block that WebGL 2 guarantees, over those of an occluder. */
const MAX_CAPACITY = Math.floor(4096 / (4 * ROWS));

/**
 * Contact shadows of many objects on everything, by their grids:
 *
 *     const shadows = new AoGridShadows();
 *     renderer.contextNode = shadows.contextNode;
 *     shadows.add(grid, robot);
 *
 * Every material with indirect light is darkened, transparent ones included, and only its indirect light.
 * The objects may move each frame. All grids are in one texture, so that a material needs two or, with
 * `merge`, three.
 */
export class AoGridShadows {
  /** The context for `renderer.contextNode`. */
  readonly contextNode: ContextNode<unknown>;
  /** The node of 1 − AO of all objects, for your own materials. */
  readonly node: Node<'float'>;

  readonly #capacity: number;
  readonly #occluders = new Map<Object3D, Placed>();
  readonly #ids = new Map<Object3D, number>();
  readonly #rows: Float32Array;
  readonly #count = uniform(0, 'int').setGroup(renderGroup);
  readonly #grids = texture3D(createAtlas([]).texture);
  #atlas: Atlas = createAtlas([]);
  #nextId = 0;

  constructor(options: AoGridShadowsOptions = {}) {
    const { capacity = 16, combine = 'multiply' } = options;
    if (!(Number.isInteger(capacity) && capacity >= 1 && capacity <= MAX_CAPACITY)) {
      throw new Error(`the capacity ${capacity} is not in 1..${MAX_CAPACITY}`);
    }
    this.#capacity = capacity;
    this.#rows = new Float32Array(4 * ROWS * capacity);
    this.node = this.#createNode(combine === 'merge' ? merge : multiply);
    this.contextNode = context(null as unknown as Node, {
      getAO: (input: Node<'float'> | null, { material }: NodeBuilder) => {
        // Basic materials have no indirect light.
        if ('isMeshBasicNodeMaterial' in material || 'isMeshBasicMaterial' in material) return input;
        return input === null ? this.node : input.mul(this.node);
      },
    }) as unknown as ContextNode<unknown>;
  }

  /**
   * Adds an object, or replaces its grid and options. Receivers below it in the scene are its own. The
   * grid of several objects should be one and the same, which is then stored once.
   *
   * @throws {Error} There are too many objects, or the grid has no cones.
   */
  add(grid: Grid, object: Object3D, options: OccluderOptions = {}): this {
    const known = this.#occluders.get(object);
    if (known === undefined && this.#occluders.size === this.#capacity) {
      const more = `new AoGridShadows({ capacity: ${2 * this.#capacity} })`;
      throw new Error(`${this.#capacity} objects are the capacity: create it as ${more}`);
    }
    this.#loadGrids([grid, ...this.#gridsBut(object)]);
    const id = known?.id ?? this.#nextId++;
    this.#occluders.set(object, { grid, object, options, id, origin: [], atlasSize: [] });
    this.#ids.set(object, id);
    return this;
  }

  /** Removes an object; without effect if it was not added. */
  remove(object: Object3D): this {
    this.#occluders.delete(object);
    this.#ids.delete(object);
    this.#loadGrids(this.#gridsBut(object));
    return this;
  }

  /** Frees the texture of the grids. */
  dispose(): void {
    this.#occluders.clear();
    this.#ids.clear();
    this.#atlas.texture.dispose();
  }

  #gridsBut(object: Object3D): Grid[] {
    return [...this.#occluders.values()].filter((p) => p.object !== object).map((p) => p.grid);
  }

  /** Makes the atlas that of exactly these grids, if it is not. */
  #loadGrids(grids: Grid[]): void {
    const distinct = [...new Set(grids)];
    const { origins, texture } = this.#atlas;
    if (distinct.length === origins.size && distinct.every((grid) => origins.has(grid))) return;
    this.#atlas = createAtlas(distinct);
    this.#grids.value = this.#atlas.texture;
    texture.dispose();
  }

  /** Writes the rows of all objects that have an effect, and their number. */
  #update(): void {
    let count = 0;
    for (const placed of this.#occluders.values()) {
      placed.origin = this.#atlas.origins.get(placed.grid)!;
      placed.atlasSize = this.#atlas.size;
      if (writeRows(placed, this.#rows, 4 * ROWS * count)) count++;
    }
    this.#count.value = count;
  }

  #createNode(combine: typeof merge): Node<'float'> {
    const length = ROWS * this.#capacity;
    const rows = buffer(this.#rows, 'vec4', length)
      .setGroup(renderGroup)
      .onRenderUpdate(() => this.#update());
    const point = receiver((drawn) => idOfAncestor(drawn, this.#ids));
    const grids = this.#grids;
    return Fn(() => {
      const accumulated = vec4(0, 0, 0, 1).toVar();
      Loop({ start: int(0), end: this.#count, type: 'int' }, ({ i }) => {
        const first = i.mul(ROWS);
        const occluder = {
          row: (idx: number) => rowOf(rows, first.add(idx)),
          sample: (position: Node<'vec3'>) => grids.sample(position).level(float(0)),
        };
        contribution(occluder, point, (added) => accumulated.assign(combine(accumulated, added)));
      });
      return accumulated.w;
    })();
  }
}
