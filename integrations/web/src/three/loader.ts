import { FileLoader, Loader } from 'three/webgpu';
import type { LoadingManager } from 'three/webgpu';

import { parseGrid } from '../grid.js';
import type { Grid } from '../grid.js';

/** Loads grid files (`*.ao.ktx2`). */
export class AoGridLoader extends Loader<Grid> {
  constructor(manager?: LoadingManager) {
    super(manager);
  }

  /** Loads a grid from a URL. `onError` gets a `GridError` if the file is broken. */
  override load(
    url: string,
    onLoad: (grid: Grid) => void,
    onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void,
  ): void {
    const loader = new FileLoader(this.manager);
    loader.setPath(this.path);
    loader.setResponseType('arraybuffer');
    loader.setRequestHeader(this.requestHeader);
    loader.setWithCredentials(this.withCredentials);
    const fail = (error: unknown) => {
      if (onError === undefined) console.error(error);
      else onError(error);
      this.manager.itemError(url);
    };
    const done = (bytes: string | ArrayBuffer) => {
      let grid: Grid;
      try {
        grid = this.parse(bytes as ArrayBuffer);
      } catch (error) {
        fail(error);
        return;
      }
      onLoad(grid);
    };
    loader.load(url, done, onProgress, fail);
  }

  /** Reads a grid from the bytes of its file. */
  parse(bytes: ArrayBuffer | Uint8Array): Grid {
    return parseGrid(bytes);
  }
}
