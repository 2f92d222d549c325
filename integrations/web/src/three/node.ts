import type { Node, Object3D } from 'three/webgpu';
import { Fn, buffer, float, int, texture3D, vec4 } from 'three/tsl';

import type { Grid } from '../grid.js';
import { createAtlas } from './atlas.js';
import { idOfAncestor, receiver } from './receiver.js';
import { ROWS, rowOf, writeRows } from './rows.js';
import type { OccluderOptions } from './rows.js';
import { contribution } from './shading.js';

/**
 * Returns a node with 1 − AO that `object`, with its grid, gives the fragment that is shaded: 1 where it
 * has no effect. It follows the object. Give it to `material.aoNode`, or multiply several:
 *
 *     floor.material.aoNode = aogrid(grid, robot);
 *
 * For many objects, or for all materials at once, use `AoGridShadows`.
 *
 * @throws {Error} The grid has no cones.
 */
export function aogrid(grid: Grid, object: Object3D, options: OccluderOptions = {}): Node<'float'> {
  const { texture, size, origins } = createAtlas([grid]);
  const placed = { grid, object, options, id: 0, origin: origins.get(grid)!, atlasSize: size };
  const values = new Float32Array(4 * ROWS);
  const rows = buffer(values, 'vec4', ROWS).onRenderUpdate(() => {
    // No reach is no effect: the share of a position in rows of infinity is beyond 1.
    if (!writeRows(placed, values, 0)) values.fill(0).fill(Infinity, 28, 31);
  });
  const ids = new Map([[object, 0]]);
  const point = receiver((drawn) => idOfAncestor(drawn, ids));
  return Fn(() => {
    const accumulated = vec4(0, 0, 0, 1).toVar();
    const occluder = {
      row: (idx: number) => rowOf(rows, int(idx)),
      sample: (position: Node<'vec3'>) => texture3D(texture, position).level(float(0)),
    };
    contribution(occluder, point, (added) => accumulated.assign(added));
    return accumulated.w;
  })();
}
