/** The shading library in WGSL. Its functions and structs have the prefix `aogrid`. */

export { ENVIRONMENT, SHADING, SURFACE, VOLUMES } from './generated/wgsl.js';
