/**
 * The shading library as nodes. Functions have the names and the formulas of the WGSL library
 * (`runtime/src/lookup.wgsl`, `shading.wgsl`), which explains them.
 */

import type { Node } from 'three/webgpu';
import { If, acos, clamp, dot, float, inverseSqrt, max, min, mix, select, sqrt, texture, texture3D, vec2, vec3, vec4 } from 'three/tsl';

import { CLIP_SIZE, MERGE_SIZE } from '../generated/tables.js';
import { clipTexture, overlapTexture } from './textures.js';

type Float = Node<'float'>;
type Vec3 = Node<'vec3'>;
type Vec4 = Node<'vec4'>;

const AXIS_EPSILON = 1e-8;
const SQUARE_EPSILON = 1e-30;
const FRACTION_EPSILON = 1e-6;
const MAX_FLATNESS = 0.97;

/** The rows of an occluder, see `writeRows`, and the texture that its grid is in. */
export interface Occluder {
  row(idx: number): Vec4;
  sample(position: Vec3): Vec4;
}

/** A point that is shaded: world-space position and unit normal, and the id of its object. */
export interface Receiver {
  position: Vec3;
  normal: Vec3;
  id: Float;
}

/** The place at which a receiver looks up a grid. */
interface Lookup {
  position: Vec3;
  outward: Vec3;
  distance: Float;
  remainder: Float;
  flatness: Float;
}

/** A cone of directions, of which a uniform share is occluded. */
interface Cone {
  axis: Vec3;
  fraction: Float;
  density: Float;
}

/**
 * Calls `then` with the contribution of an occluder, (AO/2) d' and 1 − AO, where it has an effect on the
 * receiver.
 */
export function contribution(
  occluder: Occluder,
  receiver: Receiver,
  then: (contribution: Vec4) => void,
): void {
  const isOnItself = receiver.id.equal(occluder.row(11).w);
  const steps = occluder.row(9).xyz.mul(
    vec3(
      dot(occluder.row(0).xyz, receiver.normal),
      dot(occluder.row(1).xyz, receiver.normal),
      dot(occluder.row(2).xyz, receiver.normal),
    ),
  );
  const step = inverseSqrt(max(dot(steps, steps), SQUARE_EPSILON));
  const offset = select(isOnItself, step, float(0));
  const position = receiver.position.add(receiver.normal.mul(offset)).toVar();
  const inGrid = vec4(position, 1);
  const offCenter = vec3(
    dot(occluder.row(0), inGrid),
    dot(occluder.row(1), inGrid),
    dot(occluder.row(2), inGrid),
  )
    .sub(0.5)
    .toVar();
  const share = largest(offCenter.abs().mul(occluder.row(7).xyz)).toVar();
  // An object that does not occlude itself is as if its receivers were out of reach.
  const isShaded = isOnItself.and(occluder.row(12).w.greaterThan(0.5)).not();
  If(share.lessThanEqual(1).and(isShaded), () => {
    const at = lookup(occluder, position, offCenter, share);
    const cone = coneOf(occluder, at);
    then(clipped(occluder, cone, receiver.normal));
  });
}

/** Multiplies an accumulated transmittance with a contribution (statistical independence). */
export function multiply(accumulated: Vec4, added: Vec4): Vec4 {
  return vec4(accumulated.xyz.add(added.xyz), accumulated.w.mul(added.w));
}

/** Merges a contribution into what is accumulated, as cones around their axes. */
export function merge(accumulated: Vec4, added: Vec4): Vec4 {
  const cosine = dot(accumulated.xyz, added.xyz)
    .mul(inverseLength(accumulated.xyz))
    .mul(inverseLength(added.xyz));
  const gamma = acos(clamp(cosine, -1, 1)).div(Math.PI);
  const coordinate = vec3(
    atNodes(float(1).sub(accumulated.w).mul(0.5), MERGE_SIZE[0]),
    atNodes(float(1).sub(added.w).mul(0.5), MERGE_SIZE[1]),
    atNodes(gamma, MERGE_SIZE[2]),
  );
  const overlap = texture3D(overlapTexture(), coordinate).level(float(0)).x;
  const t = overlap.mul(2).add(accumulated.w).add(added.w.sub(1));
  return vec4(accumulated.xyz.add(added.xyz), max(t, 0));
}

function largest(v: Vec3): Float {
  return max(max(v.x, v.y), v.z);
}

/** Returns 1/|v|, bounded for what counts as no axis. */
function inverseLength(v: Vec3): Float {
  return inverseSqrt(max(dot(v, v), AXIS_EPSILON));
}

/** Returns the coordinate of an argument in 0..1 of a table with nodes at both ends of its axis. */
function atNodes(x: Float, size: number): Float {
  return x.mul((size - 1) / size).add(0.5 / size);
}

function lookup(occluder: Occluder, position: Vec3, offCenter: Vec3, share: Float): Lookup {
  const scaled = offCenter.abs().mul(occluder.row(6).xyz).toVar();
  const distance = max(largest(scaled), 1).toVar();
  const perDistance = float(1).div(distance).toVar();
  const own = offCenter.mul(perDistance).add(0.5);
  const halfCell = occluder.row(11).xyz;
  const inside = clamp(own, halfCell, vec3(1).sub(halfCell));
  const fade = share.mul(occluder.row(6).w).sub(3).saturate().toVar();
  const square = perDistance.mul(perDistance).toVar();
  const remainder = fade.mul(fade).mul(fade.mul(2).sub(3)).add(1).mul(square);
  const flat = occluder.row(10);
  return {
    position: inside.mul(occluder.row(12).xyz).add(occluder.row(13).xyz),
    outward: position.sub(occluder.row(8).xyz),
    distance,
    remainder: remainder.toVar(),
    flatness: dot(scaled.mul(scaled), flat.xyz).mul(square).add(flat.w),
  };
}

function coneOf(occluder: Occluder, at: Lookup): Cone {
  const texel = occluder.sample(at.position).toVar();
  const rgb = vec4(texel.xyz, 1);
  const stored = vec3(
    dot(occluder.row(3), rgb),
    dot(occluder.row(4), rgb),
    dot(occluder.row(5), rgb),
  ).toVar();
  const perLength = inverseLength(stored).toVar();
  const length = clamp(dot(stored, stored).mul(perLength), occluder.row(9).w, 1);
  const isFar = at.distance.greaterThan(1);
  const near = stored.mul(perLength).toVar();
  const axis = select(isFar, distantAxis(near, at), near);
  const a0 = texel.w.mul(max(texel.w, occluder.row(7).w)).toVar();
  const a = select(isFar, distantFraction(a0, at), a0).toVar();
  const widened = a.sub(1).mul(length).add(1).toVar();
  return { axis, fraction: widened, density: a.div(max(widened, FRACTION_EPSILON)) };
}

/** Returns the fraction that an object occludes farther away. */
function distantFraction(a: Float, at: Lookup): Float {
  const inFront = float(1).sub(a.mul(2)).saturate();
  const behind = a.mul(2).sub(1).saturate();
  const atHull = float(1).sub(inFront.mul(inFront)).toVar();
  const flat = min(at.flatness.mul(atHull), MAX_FLATNESS).toVar();
  const k = atHull.mul(at.remainder).div(at.remainder.mul(flat).add(float(1).sub(flat)));
  const cosine = sqrt(float(1).sub(k).saturate()).sub(behind.mul(at.remainder));
  return float(0.5).sub(cosine.mul(0.5));
}

function distantAxis(axis: Vec3, at: Lookup): Vec3 {
  const scale = float(1).sub(at.distance).mul(inverseSqrt(max(dot(at.outward, at.outward), SQUARE_EPSILON)));
  const towards = axis.add(at.outward.mul(scale)).toVar();
  return towards.mul(inverseLength(towards));
}

/** Returns (AO/2) d' and 1 − AO of a cone that the receiver's plane clips. */
function clipped(occluder: Occluder, cone: Cone, normal: Vec3): Vec4 {
  const axis = cone.axis.toVar();
  const cosBeta = dot(axis, normal).mul(0.5).add(0.5);
  const uv = vec2(atNodes(cone.fraction, CLIP_SIZE[0]), atNodes(cosBeta, CLIP_SIZE[1]));
  const clip = texture(clipTexture(), uv).level(float(0)).toVar();
  const occlusion = clip.x.mul(cone.density).mul(occluder.row(8).w).toVar();
  const sum = mix(normal, axis, clip.z).toVar();
  const towards = sum.mul(inverseLength(sum));
  return vec4(towards.mul(occlusion.mul(0.5)), float(1).sub(occlusion));
}
