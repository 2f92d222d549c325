/** The origin of each box of texels, and the size of the box around all. */
export interface Packed {
  origins: number[][];
  size: number[];
}

type Size = readonly [number, number, number];

/** The sides of layers to try. */
const CANDIDATES = 32;

/**
 * Packs boxes of texels into one box: shelves along x are stacked along y into layers, and layers along
 * z. Returns the smallest of several packings, or nothing if all are larger than `limit` along an axis.
 */
export function pack(sizes: readonly Size[], limit: number): Packed | undefined {
  let best: Packed | undefined;
  for (const side of candidates(sizes, limit)) {
    const packed = packShelves(sizes, side);
    const fits = packed.size.every((n) => n <= limit);
    if (fits && (best === undefined || volume(packed.size) < volume(best.size))) best = packed;
  }
  return best;
}

function volume(size: readonly number[]): number {
  return size[0] * size[1] * size[2];
}

/** Returns sides of layers, from that of a cube of the total volume upwards. */
function candidates(sizes: readonly Size[], limit: number): number[] {
  const total = sizes.reduce((sum, size) => sum + volume(size), 0);
  const widest = Math.max(1, ...sizes.flatMap(([x, y]) => [x, y]));
  const least = Math.max(Math.ceil(Math.cbrt(total)), widest);
  const step = Math.ceil(least / 16);
  const sides = Array.from({ length: CANDIDATES }, (_, idx) => least + idx * step);
  return [...sides, limit].filter((side) => side <= limit);
}

/** Packs the boxes from large to small, so that those in one layer or shelf have similar sizes. */
function packShelves(sizes: readonly Size[], side: number): Packed {
  const order = sizes.map((_, idx) => idx).sort((a, b) => {
    const [first, second] = [sizes[a], sizes[b]];
    return second[2] - first[2] || second[1] - first[1] || second[0] - first[0];
  });
  const origins = sizes.map(() => [0, 0, 0]);
  const size = [1, 1, 1];
  let cursor = [0, 0, 0];
  let shelfHeight = 0;
  let layerDepth = 0;
  for (const idx of order) {
    const [x, y, z] = sizes[idx];
    if (cursor[0] + x > side) {
      cursor = [0, cursor[1] + shelfHeight, cursor[2]];
      shelfHeight = 0;
    }
    if (cursor[1] + y > side) {
      cursor = [0, 0, cursor[2] + layerDepth];
      shelfHeight = 0;
      layerDepth = 0;
    }
    origins[idx] = [...cursor];
    for (let axis = 0; axis < 3; axis++) {
      size[axis] = Math.max(size[axis], cursor[axis] + sizes[idx][axis]);
    }
    cursor[0] += x;
    shelfHeight = Math.max(shelfHeight, y);
    layerDepth = Math.max(layerDepth, z);
  }
  return { origins, size };
}
