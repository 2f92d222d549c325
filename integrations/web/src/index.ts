/** Grids, occluders and tables, for any renderer. `aogrid/three` has all that three.js needs. */

export { GridError, parseGrid } from './grid.js';
export type { BakeRecord, Encoding, Grid, GridErrorCode, TexelFormat } from './grid.js';
export { InstanceError, NO_OBJECT, OCCLUDER_BYTES, occluderUniform } from './occluder.js';
export type { Instance, InstanceErrorCode } from './occluder.js';
export { clipTable, overlapTable, transmittanceTable } from './tables.js';
export type { Table } from './tables.js';
