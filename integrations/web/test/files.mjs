// Where tests find things.

import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

/** The package. */
export const PACKAGE = fileURLToPath(new URL('..', import.meta.url));

/** The workspace of aogrid. */
export const ROOT = fileURLToPath(new URL('../../..', import.meta.url));

/** What the native programs made, see `native.mjs`. */
export const NATIVE = join(PACKAGE, 'test', 'native');

/** Models that may not be committed. */
export const SHARED = process.env.AOGRID_SHARED ?? join(ROOT, '..', 'shared');

/** The models that both bakers bake. */
export const MODELS = [
  ...['box', 'robot', 'space-ship', 'table'].map((name) => join(ROOT, 'assets', `${name}.obj`)),
  ...['spot_tri.obj', 'Duck_4212.glb'].map((name) => join(SHARED, 'data', 'meshes', name)),
];

/** The scene that both renderers render. */
export const SCENE = join(PACKAGE, 'test', 'fixtures', 'scene.toml');
