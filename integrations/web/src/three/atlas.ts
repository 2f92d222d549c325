import {
  Data3DTexture,
  HalfFloatType,
  LinearFilter,
  RGBAFormat,
  UnsignedByteType,
} from 'three/webgpu';

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
  if (format === 'f16') return Uint16Array.from({ length: texels.length / 2 }, (_, idx) => view.getUint16(2 * idx, true));
  const values = format === 'unorm8'
    ? Float32Array.from(texels, (byte) => byte / 255)
    : Float32Array.from({ length: texels.length / 4 }, (_, idx) => view.getFloat32(4 * idx, true));
  return Uint16Array.from(values, toHalf);
}

/** Returns the half float next to a number in −1..1. */
export function toHalf(value: number): number {
  const magnitude = Math.abs(value);
  const exponent = Math.max(Math.floor(Math.log2(magnitude)), -14);
  const step = 2 ** (exponent - 10);
  // Rounding to even, as the fraction of a half float.
  const steps = magnitude / step;
  const floor = Math.floor(steps);
  const rest = steps - floor;
  const up = rest > 0.5 || (rest === 0.5 && floor % 2 === 1);
  const rounded = (floor + (up ? 1 : 0)) * step;
  const sign = value < 0 ? 0x8000 : 0;
  if (rounded < 2 ** -14) return sign | Math.round(rounded / 2 ** -24);
  const found = Math.floor(Math.log2(rounded));
  return sign | ((found + 15) << 10) | (rounded / 2 ** (found - 10) - 1024);
}

