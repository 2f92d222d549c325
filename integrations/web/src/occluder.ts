import { fraction } from './grid.js';
import type { Grid } from './grid.js';
import * as mat4 from './mat4.js';
import type { Mat4 } from './mat4.js';

/** The id that stands for no object. */
export const NO_OBJECT = 0xffffffff;

/** Bytes of the struct `AogridOccluder` in WGSL. */
export const OCCLUDER_BYTES = 208;

/** How an object occludes, besides its transform. All have defaults. */
export interface Instance {
  /** 0 for none, 1 as baked. */
  strength?: number;
  /** A mask: the object shades receivers that share a bit with it. */
  layers?: number;
  /** The id of its own receivers. */
  objectId?: number;
  /** The ids of up to four receivers that it does not shade. */
  excluded?: readonly number[];
  /** Whether cones of the encoding `cone` widen where neighboring axes disagree. */
  softCones?: boolean;
  /**
   * The AO at which the far field ends, 0..1; 0 ends the occlusion at the grid's box. The default is
   * 0.035 for the encoding `moment` and 0 for others.
   */
  farField?: number;
}

/** The kinds of faults that an instance can have. */
export type InstanceErrorCode =
  | 'not-finite'
  | 'not-affine'
  | 'singular'
  | 'strength'
  | 'far-field'
  | 'excluded';

/** The reason that an instance cannot be shaded. */
export class InstanceError extends Error {
  override readonly name = 'InstanceError';

  constructor(
    /** The kind of fault. */
    readonly code: InstanceErrorCode,
    message: string,
  ) {
    super(message);
  }
}

/** The threshold of the far field for grids that have one by default. */
const FAR_FIELD = Math.fround(0.035);

/** The shortest reach: the far field fades over its last quarter, which must not begin in the hull. */
const MIN_REACH = 4 / 3;

/** The shortest self offset in cells, in place of none. */
const MIN_SELF_OFFSET = Math.fround(1e-12);

/** The upper bound of a flatness times the hull's squared sine. */
const MAX_FLATNESS = Math.fround(0.97);

/**
 * Returns the shader data of an occluder: the struct `AogridOccluder` of the WGSL library, for a uniform
 * or storage buffer. It is the twin of `AogridOccluder::new` in Rust, bit for bit.
 *
 * `matrixWorld` maps object space to world space, in columns, as the elements of a matrix of three.js.
 * Rotation, uniform scale, reflection and translation are exact; a non-uniform scale changes solid
 * angles, so that the baked values are an approximation.
 *
 * @throws {InstanceError} The transform is not affine, finite and invertible, or a number is out of range.
 */
export function occluderUniform(
  grid: Grid,
  matrixWorld: ArrayLike<number>,
  instance: Instance = {},
): ArrayBuffer {
  const worldFromObject = checkTransform(matrixWorld);
  const { strength = 1, layers = NO_OBJECT, objectId = NO_OBJECT, excluded = [] } = instance;
  checkRanges(strength, instance.farField, excluded);
  const center = mat4.transformPoint(worldFromObject, boxCenter(grid)).map(Math.fround);
  if (!center.every(Number.isFinite)) throw notFinite();
  const reach = reachOf(grid, instance.farField);
  const growth = growthOf(grid, instance.farField);
  const gridFromWorld = mat4.inverse(mat4.multiply(worldFromObject, objectFromGrid(grid)));
  const isMoment = grid.encoding === 'moment';
  const isSoft = isMoment || instance.softCones === true;
  const floats = new Float32Array(OCCLUDER_BYTES / 4);
  const words = new Uint32Array(floats.buffer);
  floats.set(rows(gridFromWorld), 0);
  floats.set(rows(axisFromTexel(worldFromObject, grid)), 12);
  words.set([0, 1, 2, 3].map((slot) => excluded[slot] ?? NO_OBJECT), 24);
  words.set([objectId, layers], 28);
  floats.set([strength, isSoft ? 0 : 1], 30);
  floats.set(growth.map((g, axis) => (2 * (reach?.[axis] ?? 1)) / g), 32);
  floats[35] = reach === undefined ? 0 : 4;
  floats.set(growth.map((g) => 2 / g), 36);
  floats[39] = isMoment ? 0 : 1;
  floats.set(center, 40);
  const offset = Math.max(grid.bake.selfOffset, MIN_SELF_OFFSET);
  floats.set(grid.resolution.map((n) => n / offset), 44);
  floats.set(grid.bake.flatness, 48);
  return floats.buffer;
}

/**
 * Returns the size of the box in which an object has an effect, relative to its grid's box, along each
 * axis.
 */
export function growthOf(grid: Grid, farField?: number): number[] {
  const reach = reachOf(grid, farField);
  if (reach === undefined) return [1, 1, 1];
  return reach.map((r, axis) => (r * (grid.resolution[axis] - 1)) / grid.resolution[axis]);
}

/** Returns where the far field ends, in half-extents of the hull; nothing without a far field. */
function reachOf(grid: Grid, farField?: number): number[] | undefined {
  const threshold = Math.fround(farField ?? (grid.encoding === 'moment' ? FAR_FIELD : 0));
  const distant = distantOcclusion(grid);
  if (!(threshold > 0) || distant.every((d) => d === 0)) return undefined;
  return distant.map((d) => Math.max(Math.sqrt(d / threshold), MIN_REACH));
}

const DISTANT = new WeakMap<Grid, number[]>();

/**
 * Returns the largest AO of facing receivers far beyond the two faces of each axis, times their squared
 * distance in half-extents of the hull, from the grid's outer cells.
 */
function distantOcclusion(grid: Grid): number[] {
  const known = DISTANT.get(grid);
  if (known !== undefined) return known;
  const [nx, ny, nz] = grid.resolution;
  const last = [nx - 1, ny - 1, nz - 1];
  const largest = [0, 0, 0];
  for (let k = 0; k < nz; k++) {
    for (let j = 0; j < ny; j++) {
      const isWhole = j === 0 || k === 0 || j === last[1] || k === last[2];
      for (let i = 0; i < nx; i += isWhole ? 1 : last[0]) {
        const cell = [i, j, k];
        const squares = cell.map((c, x) => ((2 * c) / last[x] - 1) ** 2);
        const [fx, fy, fz, f0] = grid.bake.flatness;
        const flat = squares[0] * fx + squares[1] * fy + squares[2] * fz + f0;
        const occlusion = continued(fraction(grid, (k * ny + j) * nx + i), flat);
        for (let x = 0; x < 3; x++) {
          if (cell[x] === 0 || cell[x] === last[x]) largest[x] = Math.max(largest[x], occlusion);
        }
      }
    }
  }
  DISTANT.set(grid, largest);
  return largest;
}

/** Returns the limit of the squared sine of α times the squared distance. */
function continued(a: number, flatness: number): number {
  const least = Math.min(a, 0.5);
  const atHull = 4 * least * (1 - least);
  return atHull / (1 - Math.min(flatness * atHull, MAX_FLATNESS));
}

function boxCenter(grid: Grid): number[] {
  return grid.center.map((c, axis) => grid.origin[axis] + c);
}

function objectFromGrid(grid: Grid): Mat4 {
  const corner = boxCenter(grid).map((c, axis) => c - grid.halfExtents[axis]);
  const size = grid.halfExtents.map((e) => 2 * e);
  return mat4.multiply(mat4.translation(corner), mat4.scale(size));
}

/**
 * Returns the map from a texel's rgb to the axis: the decoding, then the linear part without its scale,
 * so that axes about keep their stored length.
 */
function axisFromTexel(worldFromObject: Mat4, grid: Grid): Mat4 {
  const isUnorm = grid.format === 'unorm8';
  const [scale, offset] = isUnorm ? [255 / 127, -128 / 127] : [1, 0];
  const size = Math.cbrt(Math.abs(mat4.determinant(worldFromObject)));
  const linear = worldFromObject.map((v) => v * (1 / size));
  linear.splice(12, 4, 0, 0, 0, 1);
  const moved = mat4.multiply(linear, mat4.translation([offset, offset, offset]));
  return mat4.multiply(moved, mat4.scale([scale, scale, scale]));
}

function checkTransform(matrixWorld: ArrayLike<number>): Mat4 {
  const m = Array.from({ length: 16 }, (_, idx) => matrixWorld[idx]);
  if (!isFinite(m)) throw notFinite();
  const last = [m[3], m[7], m[11], m[15]];
  if (last.some((v, idx) => v !== (idx === 3 ? 1 : 0))) {
    const message = `the transform's last row is [${last}] instead of [0, 0, 0, 1]: it is not affine`;
    throw new InstanceError('not-affine', message);
  }
  if (mat4.determinant(m) === 0) {
    const message = 'the transform cannot be inverted: it scales some direction to zero';
    throw new InstanceError('singular', message);
  }
  return m;
}

function checkRanges(
  strength: number,
  farField: number | undefined,
  excluded: readonly number[],
): void {
  if (!(strength >= 0 && strength <= 1)) {
    throw new InstanceError('strength', `strength ${strength} is not in 0..1`);
  }
  if (farField !== undefined && !(farField >= 0 && farField <= 1)) {
    const message = `the far field's threshold ${farField} is not in 0..1`;
    throw new InstanceError('far-field', message);
  }
  if (excluded.length > 4) {
    const message = `${excluded.length} receivers are excluded, at most 4 can be`;
    throw new InstanceError('excluded', message);
  }
}

/** Returns the upper three rows. */
function rows(m: Mat4): number[] {
  if (!isFinite(m)) throw notFinite();
  return [0, 1, 2].flatMap((row) => [m[row], m[4 + row], m[8 + row], m[12 + row]]);
}

/** Whether all numbers are finite in single precision, too. */
function isFinite(m: Mat4): boolean {
  return m.every((v) => Number.isFinite(Math.fround(v)));
}

function notFinite(): InstanceError {
  const message = 'the transform has numbers that are not finite, or too large or too small to invert';
  return new InstanceError('not-finite', message);
}
