import type { Node, Object3D } from 'three/webgpu';

import type { Grid } from '../grid.js';
import { InstanceError, occluderUniform } from '../occluder.js';

/** How an object occludes. */
export interface OccluderOptions {
  /** 0 for none, 1 as baked. */
  strength?: number;
  /** Whether the object occludes itself, too. The default is true. */
  self?: boolean;
  /** Whether cones of the encoding `cone` widen where neighboring axes disagree. */
  softCones?: boolean;
  /** The AO at which the far field ends, 0..1; see `Instance`. */
  farField?: number;
}

/** An object with its grid, and where the grid lies in an atlas. */
export interface Placed {
  grid: Grid;
  object: Object3D;
  options: OccluderOptions;
  /** The id of receivers that belong to the object. */
  id: number;
  /** The first texel of the grid, and the size of the atlas in texels. */
  origin: readonly number[];
  atlasSize: readonly number[];
}

/** Rows of four floats for each occluder. */
export const ROWS = 14;

/** The id of receivers that belong to no occluder. */
export const NO_ID = -1;

/**
 * Writes the rows of an occluder. Returns false without writing if it has no effect: it is hidden, or
 * scaled to zero.
 *
 * They are: grid-from-world (3), axis-from-texel (3), then per hull and fade scale, per reach and least
 * factor, center and strength, per step and least axis length, flatness, half a cell and id, scale and
 * offset in the atlas, with 1 in the scale's last component if the object does not occlude itself.
 */
export function writeRows(placed: Placed, rows: Float32Array, at: number): boolean {
  const { grid, object, options } = placed;
  if (!object.visible) return false;
  let occluder: Float32Array;
  try {
    occluder = new Float32Array(occluderUniform(grid, object.matrixWorld.elements, options));
  } catch (error) {
    if (error instanceof InstanceError && error.code === 'singular') return false;
    throw error;
  }
  const out = rows.subarray(at, at + 4 * ROWS);
  out.set(occluder.subarray(0, 24));
  out.set(occluder.subarray(32, 40), 24);
  out.set(occluder.subarray(40, 43), 32);
  out[35] = occluder[30];
  out.set(occluder.subarray(44, 47), 36);
  out[39] = occluder[31];
  out.set(occluder.subarray(48, 52), 40);
  for (let axis = 0; axis < 3; axis++) {
    const n = grid.resolution[axis];
    out[44 + axis] = 0.5 / n;
    out[48 + axis] = n / placed.atlasSize[axis];
    out[52 + axis] = placed.origin[axis] / placed.atlasSize[axis];
  }
  out[47] = placed.id;
  out[51] = options.self === false ? 1 : 0;
  return true;
}

/** Returns the node of a row of a buffer of rows. */
export function rowOf(rows: unknown, idx: Node<'int'>): Node<'vec4'> {
  // All nodes have the method; the types of three.js give it to arrays alone.
  return (rows as { element(idx: Node<'int'>): Node<'vec4'> }).element(idx);
}
