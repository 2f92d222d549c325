import { CLIP, CLIP_SIZE, MERGE_SIZE, OVERLAPS, TRANSMITTANCE } from './generated/tables.js';

/** A texture of half floats, to sample with a linear, clamped sampler. */
export interface Table {
  /** Texels along x, y and z; z is 1 for a 2D texture. */
  size: [number, number, number];
  /** Channels of a texel. */
  channels: 1 | 4;
  /** The bits of half floats, x fastest, without padding. */
  texels: Uint16Array<ArrayBuffer>;
}

/** Returns T_clip with all channels: AO, a', f and 1. For merging; a 2D texture, rgba16float. */
export function clipTable(): Table {
  return {
    size: [CLIP_SIZE[0], CLIP_SIZE[1], 1],
    channels: 4,
    texels: decode(CLIP, 4 * CLIP_SIZE[0]),
  };
}

/** Returns T_clip as 1 − AO. For `aogrid_cone`; a 2D texture, r16float. */
export function transmittanceTable(): Table {
  return {
    size: [CLIP_SIZE[0], CLIP_SIZE[1], 1],
    channels: 1,
    texels: decode(TRANSMITTANCE, CLIP_SIZE[0]),
  };
}

/** Returns the overlap table of T_merge. For merging; a 3D texture, r16float. */
export function overlapTable(): Table {
  const [width, height, depth] = MERGE_SIZE;
  return { size: [width, height, depth], channels: 1, texels: decode(OVERLAPS, width) };
}

/**
 * Decodes half floats from the form that compresses best: each less the one a row before it, all lower
 * bytes, then all upper ones.
 */
function decode(base64: string, row: number): Uint16Array<ArrayBuffer> {
  const text = atob(base64);
  const count = text.length / 2;
  const texels = new Uint16Array(count);
  for (let idx = 0; idx < count; idx++) {
    const delta = text.charCodeAt(idx) | (text.charCodeAt(count + idx) << 8);
    // The array wraps sums to 16 bits.
    texels[idx] = delta + (idx < row ? 0 : texels[idx - row]);
  }
  return texels;
}
