import type { Node, Object3D } from 'three/webgpu';
import { normalWorld, positionWorld, uniform } from 'three/tsl';

import { NO_ID } from './rows.js';
import type { Receiver } from './shading.js';

/** Returns the point that a material shades. `idOf` returns the id of the object that is drawn. */
export function receiver(idOf: (object: Object3D) => number): Receiver {
  const id = uniform(NO_ID).onObjectUpdate(({ object }) => (object ? idOf(object) : NO_ID));
  return {
    position: positionWorld as Node<'vec3'>,
    normal: normalWorld.normalize(),
    id: id as unknown as Node<'float'>,
  };
}

/** Returns the id of the first of an object and its ancestors that has one. */
export function idOfAncestor(object: Object3D, ids: ReadonlyMap<Object3D, number>): number {
  for (let at: Object3D | null = object; at !== null; at = at.parent) {
    const id = ids.get(at);
    if (id !== undefined) return id;
  }
  return NO_ID;
}
