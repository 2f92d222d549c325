/** Soft contact shadows for three.js, with `WebGPURenderer` on WebGPU and WebGL 2. */

export { AoGridLoader } from './loader.js';
export { aogrid } from './node.js';
export { AoGridShadows } from './shadows.js';
export type { AoGridShadowsOptions } from './shadows.js';
export type { OccluderOptions } from './rows.js';
