/** The kinds of faults that a grid file can have. */
export type GridErrorCode =
  | 'not-ktx2'
  | 'truncated'
  | 'trailing-bytes'
  | 'misplaced'
  | 'not-a-grid'
  | 'level-length'
  | 'key-value'
  | 'no-metadata'
  | 'metadata'
  | 'newer-version'
  | 'unknown-encoding'
  | 'channels'
  | 'box'
  | 'metadata-range'
  | 'texel';

/** The reason that bytes are not a grid file. */
export class GridError extends Error {
  override readonly name = 'GridError';

  constructor(
    /** The kind of fault. */
    readonly code: GridErrorCode,
    message: string,
  ) {
    super(message);
  }
}
