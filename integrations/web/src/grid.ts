import { readLayout } from './ktx2.js';
import { halfToNumber } from './half.js';
import { parseMetadata } from './metadata.js';
import type { BakeRecord, Encoding } from './metadata.js';
import { GridError } from './grid-error.js';
import type { Layout, TexelFormat } from './ktx2.js';

export { GridError } from './grid-error.js';
export type { GridErrorCode } from './grid-error.js';
export type { BakeRecord, Encoding } from './metadata.js';
export type { TexelFormat } from './ktx2.js';

/** A grid: texels ready for upload, their box in object space and the record of the bake. */
export interface Grid {
  /** Cells along x, y and z. */
  readonly resolution: readonly [number, number, number];
  /** The box's center in object units, relative to the origin. */
  readonly center: readonly [number, number, number];
  /** Half the box's size along each axis, in object units. */
  readonly halfExtents: readonly [number, number, number];
  /** The point in object space that the center is relative to: zero but for models far from zero. */
  readonly origin: readonly [number, number, number];
  /** The meaning of a texel's channels. */
  readonly encoding: Encoding;
  /** The storage format of a channel. */
  readonly format: TexelFormat;
  /** Channels of a texel: 1 for `occlusion`, else 4. */
  readonly channels: 1 | 4;
  /** The texels as they are uploaded: x fastest, no padding, little-endian. */
  readonly texels: Uint8Array<ArrayBuffer>;
  /** The record of the bake. */
  readonly bake: BakeRecord;
  /** The mean of the stored a over all cells. */
  readonly mean: number;
  /** The largest stored a. */
  readonly largest: number;
  /** The program that wrote the file. */
  readonly writer: string;
}

/**
 * Reads a grid file (`*.ao.ktx2`) and checks all of it: what is returned is valid.
 *
 * The profile of the file is in the documentation of the crate `aogrid-grid-format`. Files that another
 * tool has supercompressed are refused.
 *
 * @throws {GridError} The bytes are not a grid file.
 */
export function parseGrid(bytes: ArrayBuffer | Uint8Array): Grid {
  const view = bytes instanceof Uint8Array ? bytes : new Uint8Array(bytes);
  const layout = readLayout(view);
  const metadata = parseMetadata(layout);
  const texels = view.slice(layout.levelStart, layout.levelStart + layout.levelLength);
  const grid: Grid = { ...metadata, format: layout.format, channels: layout.channels, texels };
  checkTexels(grid, layout);
  return grid;
}

/** Decodes the channel `channel` of the cell `idx` to the value in its range. */
export function channelValue(grid: Grid, idx: number, channel: number): number {
  const at = idx * grid.channels + channel;
  const isSigned = grid.channels === 4 && channel < 3;
  if (grid.format === 'unorm8') {
    const byte = grid.texels[at];
    return Math.fround(isSigned ? Math.fround(byte - 128) / 127 : byte / 255);
  }
  const view = new DataView(grid.texels.buffer, grid.texels.byteOffset);
  return grid.format === 'f16'
    ? halfToNumber(view.getUint16(2 * at, true))
    : view.getFloat32(4 * at, true);
}

/** Returns the occluded fraction of the sphere of the cell `idx`. */
export function fraction(grid: Grid, idx: number): number {
  const stored = channelValue(grid, idx, grid.channels - 1);
  return grid.encoding === 'moment' ? Math.fround(stored * stored) : stored;
}

function checkTexels(grid: Grid, layout: Layout): void {
  const [nx, ny, nz] = grid.resolution;
  for (let idx = 0; idx < nx * ny * nz; idx++) {
    for (let channel = 0; channel < layout.channels; channel++) {
      const least = layout.channels === 4 && channel < 3 ? -1 : 0;
      const value = channelValue(grid, idx, channel);
      if (!(value >= least && value <= 1)) {
        const cell = [idx % nx, Math.floor(idx / nx) % ny, Math.floor(idx / (nx * ny))];
        throw new GridError(
          'texel',
          `the texel of cell [${cell}] is out of range: the axis must be in -1..1 and the occlusion in 0..1`,
        );
      }
    }
  }
}
