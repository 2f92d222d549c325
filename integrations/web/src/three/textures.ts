import {
  Data3DTexture,
  DataTexture,
  HalfFloatType,
  LinearFilter,
  RGBAFormat,
  RedFormat,
} from 'three/webgpu';

import { clipTable, overlapTable } from '../tables.js';

let clip: DataTexture | undefined;
let overlaps: Data3DTexture | undefined;

/** Returns T_clip with all channels, one texture for everything. */
export function clipTexture(): DataTexture {
  if (clip === undefined) {
    const { size, texels } = clipTable();
    clip = new DataTexture(texels, size[0], size[1], RGBAFormat, HalfFloatType);
    clip.name = 'aogrid T_clip';
    clip.minFilter = LinearFilter;
    clip.magFilter = LinearFilter;
    clip.needsUpdate = true;
  }
  return clip;
}

/** Returns the overlap table of T_merge, one texture for everything. */
export function overlapTexture(): Data3DTexture {
  if (overlaps === undefined) {
    const { size, texels } = overlapTable();
    overlaps = new Data3DTexture(texels, size[0], size[1], size[2]);
    overlaps.name = 'aogrid T_merge';
    overlaps.format = RedFormat;
    overlaps.type = HalfFloatType;
    overlaps.minFilter = LinearFilter;
    overlaps.magFilter = LinearFilter;
    overlaps.needsUpdate = true;
  }
  return overlaps;
}
