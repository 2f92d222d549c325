import {
  Data3DTexture,
  HalfFloatType,
  LinearFilter,
  RGBAFormat,
  UnsignedByteType,
} from 'three/webgpu';

import { toHalf } from '../half.js';
import type { Grid } from '../grid.js';
import { pack } from './packing.js';

/** Several grids in one 3D texture, and where each is. */
export interface Atlas {
  texture: Data3DTexture;
  size: number[];
  origins: Map<Grid, number[]>;
}

/** The largest side of a 3D texture that WebGPU guarantees. */
const MAX_SIDE = 2048;

/**
 * Returns an atlas of grids. It holds 8 bits a channel if all grids do, else half floats.
 *
 * @throws {Error} A grid has no cones, or they do not fit into one texture.
 */
export function createAtlas(grids: readonly Grid[]): Atlas {
  for (const grid of grids) {
    if (grid.channels !== 4) {
      throw new Error(
        `the grid of ${grid.bake.source} has the encoding \`occlusion\`, without cones: ` +
          'bake it with `moment` or `cone`',
      );
    }
  }
  const packed = pack(grids.map((grid) => grid.resolution), MAX_SIDE);
  if (packed === undefined) {
    throw new Error(`the grids do not fit into one texture of ${MAX_SIDE} texels along each axis`);
  }
  const { size, origins } = packed;
  const isHalf = grids.some((grid) => grid.format !== 'unorm8');
  const length = 4 * size[0] * size[1] * size[2];
  const texels = isHalf ? new Uint16Array(length) : new Uint8Array(length);
  grids.forEach((grid, idx) => copy(grid, texels, size, origins[idx]));
  const texture = new Data3DTexture(texels, size[0], size[1], size[2]);
  texture.name = 'aogrid atlas';
  texture.format = RGBAFormat;
  texture.type = isHalf ? HalfFloatType : UnsignedByteType;
  texture.minFilter = LinearFilter;
  texture.magFilter = LinearFilter;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return { texture, size, origins: new Map(grids.map((grid, idx) => [grid, origins[idx]])) };
}

/** Copies the texels of a grid row by row. */
function copy(
  grid: Grid,
  texels: Uint8Array | Uint16Array,
  size: readonly number[],
  origin: readonly number[],
): void {
  const [nx, ny, nz] = grid.resolution;
  const source = texels instanceof Uint8Array ? grid.texels : halfTexels(grid);
  for (let k = 0; k < nz; k++) {
    for (let j = 0; j < ny; j++) {
      const from = 4 * nx * (k * ny + j);
      const row = size[0] * ((origin[2] + k) * size[1] + origin[1] + j) + origin[0];
      texels.set(source.subarray(from, from + 4 * nx), 4 * row);
    }
  }
}

/** Returns the texels as a shader reads them, in half floats. */
function halfTexels(grid: Grid): Uint16Array {
  const { texels, format } = grid;
  const view = new DataView(texels.buffer, texels.byteOffset, texels.byteLength);
  const read = {
    unorm8: (idx: number) => toHalf(texels[idx] / 255),
    f16: (idx: number) => view.getUint16(2 * idx, true),
    f32: (idx: number) => toHalf(view.getFloat32(4 * idx, true)),
  }[format];
  const [nx, ny, nz] = grid.resolution;
  return Uint16Array.from({ length: 4 * nx * ny * nz }, (_, idx) => read(idx));
}
