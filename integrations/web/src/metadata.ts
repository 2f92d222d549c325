import { GridError } from './grid-error.js';
import { missingMetadata } from './ktx2.js';
import type { Layout } from './ktx2.js';

/** The meaning of a texel's channels. */
export type Encoding = 'moment' | 'cone' | 'occlusion';

/** The record of a bake, as far as renderers use it; all of it is in `raw`. */
export interface BakeRecord {
  /** The distance along its normal, in cells, at which the object looks up its own grid. */
  selfOffset: number;
  /** How fast the object's occlusion falls beyond the box: see `BakeRecord` of aogrid-grid-format. */
  flatness: [number, number, number, number];
  /** The name of the file that was baked. */
  source: string;
  /** Triangles baked. */
  triangles: number;
  /** ε of RR-5779 eq. 4, if the box was computed from it. */
  epsilon: number | null;
  /** The whole record as the file holds it. */
  raw: Record<string, unknown>;
}

/** What the metadata tell of a grid. */
export interface Metadata {
  resolution: [number, number, number];
  center: [number, number, number];
  halfExtents: [number, number, number];
  origin: [number, number, number];
  encoding: Encoding;
  bake: BakeRecord;
  mean: number;
  largest: number;
  writer: string;
}

type Json = Record<string, unknown>;

const PROFILE_MAJOR = 1;
const CHANNELS: Record<Encoding, 1 | 4> = { moment: 4, cone: 4, occlusion: 1 };
const MAX_SELF_OFFSET = 2;
const FLATNESSES = [-32, 4];
const FACE_SIZES = [8, 128];
const RAY_COUNTS = [1, 100_000];
const BOUNDARY_MODES = ['jgt', 'rr', 'none'];
const INTERIORS = ['signed', 'fill', 'enclosed', 'keep'];
const F32_MIN_POSITIVE = 2 ** -126;

/**
 * Parses the JSON of the profile and checks its ranges.
 *
 * @throws {GridError}
 */
export function parseMetadata(layout: Layout): Metadata {
  const json = layout.pairs.get('aogrid');
  if (json === undefined) throw missingMetadata();
  const metadata = parseJson(json);
  checkVersion(metadata.version);
  const encoding = parseEncoding(metadata.encoding, layout.channels);
  const center = vector(metadata.center, 'center', 3).map(Math.fround);
  const halfExtents = vector(metadata.half_extents, 'half_extents', 3).map(Math.fround);
  const origin = vector(metadata.origin ?? [0, 0, 0], 'origin', 3);
  checkBox(center, halfExtents);
  const mean = number(metadata.mean, 'mean');
  const largest = Math.fround(number(metadata.largest, 'largest'));
  inRange(mean, 0, 1, 'mean');
  inRange(largest, 0, 1, 'largest');
  return {
    resolution: layout.resolution,
    center: triple(center),
    halfExtents: triple(halfExtents),
    origin: triple(origin),
    encoding,
    bake: parseRecord(object(metadata.bake, 'bake')),
    mean,
    largest,
    writer: layout.pairs.get('KTXwriter') ?? '',
  };
}

function unparsable(reason: string): GridError {
  return new GridError('metadata', `the \`aogrid\` metadata cannot be parsed: ${reason}`);
}

function outOfRange(name: string): GridError {
  return new GridError('metadata-range', `metadata \`${name}\` is out of range`);
}

function parseJson(text: string): Json {
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch (error) {
    throw unparsable((error as Error).message);
  }
  return object(value, 'aogrid');
}

function checkVersion(version: unknown): void {
  const match = /^\+?(\d+)\./.exec(string(version, 'version'));
  const major = match === null ? 0 : Number(match[1]);
  if (major > PROFILE_MAJOR) {
    throw new GridError(
      'newer-version',
      `grid profile version ${major} is newer than ${PROFILE_MAJOR}, the newest that this reader ` +
        'supports: update aogrid',
    );
  }
  if (major !== PROFILE_MAJOR) throw outOfRange('version');
}

function parseEncoding(value: unknown, channels: 1 | 4): Encoding {
  const name = string(value, 'encoding');
  if (!Object.hasOwn(CHANNELS, name)) {
    const message = `encoding \`${name}\` is unknown to this reader: update aogrid`;
    throw new GridError('unknown-encoding', message);
  }
  const encoding = name as Encoding;
  if (CHANNELS[encoding] !== channels) {
    const message = `encoding \`${name}\` needs ${CHANNELS[encoding]} channels; the texture has ${channels}`;
    throw new GridError('channels', message);
  }
  return encoding;
}

function checkBox(center: number[], halfExtents: number[]): void {
  ['x', 'y', 'z'].forEach((axis, idx) => {
    const [c, e] = [center[idx], halfExtents[idx]];
    const ends = [Math.fround(c - e), Math.fround(c + e)];
    if (!ends.every(Number.isFinite)) {
      throw new GridError('box', `the grid's box is invalid: it is not finite along ${axis}`);
    }
    if (!(e >= F32_MIN_POSITIVE)) {
      const message = `half-extent ${e} along ${axis} must be greater than zero`;
      throw new GridError('box', `the grid's box is invalid: ${message}`);
    }
  });
}

function parseRecord(record: Json): BakeRecord {
  const optional = (name: string) =>
    record[name] === null || record[name] === undefined ? null : number(record[name], name);
  const positive = (value: number | null, name: string) => {
    if (value !== null && !(value > 0 && Number.isFinite(Math.fround(value)))) throw outOfRange(name);
    return value;
  };
  const epsilon = positive(optional('epsilon'), 'epsilon');
  positive(optional('max_distance'), 'max_distance');
  const offset = vector(record.sample_offset, 'sample_offset', 3);
  offset.forEach((v) => inRange(v, -0.5, 0.5, 'sample_offset'));
  checkSampling(object(record.method, 'method'));
  checkTreatment(record);
  const selfOffset = Math.fround(optional('self_offset') ?? 0);
  inRange(selfOffset, 0, MAX_SELF_OFFSET, 'self_offset');
  const flatness = vector(record.flatness ?? [0, 0, 0, 0], 'flatness', 4).map(Math.fround);
  flatness.forEach((v) => inRange(v, FLATNESSES[0], FLATNESSES[1], 'flatness'));
  const source = object(record.source, 'source');
  return {
    selfOffset,
    flatness: [flatness[0], flatness[1], flatness[2], flatness[3]],
    source: string(source.name, 'source.name'),
    triangles: count(source.triangles, 'source.triangles'),
    epsilon,
    raw: record,
  };
}

function checkSampling(method: Json): void {
  if (method.faces !== undefined) {
    const size = count(object(method.faces, 'method').size, 'method');
    return inRange(size, FACE_SIZES[0], FACE_SIZES[1], 'method');
  }
  if (method.rays === undefined) throw unparsable('`method` is neither faces nor rays');
  const rays = object(method.rays, 'method');
  inRange(count(rays.count, 'method'), RAY_COUNTS[0], RAY_COUNTS[1], 'method');
  count(rays.seed, 'method');
}

function checkTreatment(record: Json): void {
  oneOf(record.interior, INTERIORS, 'interior');
  count(record.interior_cells, 'interior_cells');
  const boundary = object(record.boundary, 'boundary');
  oneOf(boundary.requested, BOUNDARY_MODES, 'boundary.requested');
  oneOf(boundary.applied, BOUNDARY_MODES, 'boundary.applied');
  inRange(number(boundary.v_m, 'boundary.v_m'), 0, 1, 'boundary');
  if (record.inside !== undefined && record.inside !== null) {
    inRange(number(object(record.inside, 'inside').doubt, 'inside.doubt'), 0, 1, 'inside');
  }
}

function object(value: unknown, name: string): Json {
  if (typeof value !== 'object' || value === null || Array.isArray(value)) {
    throw unparsable(`\`${name}\` is not an object`);
  }
  return value as Json;
}

function string(value: unknown, name: string): string {
  if (typeof value !== 'string') throw unparsable(`\`${name}\` is not a string`);
  return value;
}

function number(value: unknown, name: string): number {
  if (typeof value !== 'number') throw unparsable(`\`${name}\` is not a number`);
  return value;
}

function count(value: unknown, name: string): number {
  const found = number(value, name);
  if (!Number.isInteger(found) || found < 0) throw unparsable(`\`${name}\` is not a count`);
  return found;
}

function vector(value: unknown, name: string, length: number): number[] {
  if (!Array.isArray(value) || value.length !== length) {
    throw unparsable(`\`${name}\` is not ${length} numbers`);
  }
  return value.map((v) => number(v, name));
}

function oneOf(value: unknown, names: string[], name: string): void {
  if (!names.includes(string(value, name))) throw unparsable(`\`${name}\` is none of ${names}`);
}

function inRange(value: number, least: number, most: number, name: string): void {
  if (!(value >= least && value <= most)) throw outOfRange(name);
}

function triple([x, y, z]: number[]): [number, number, number] {
  return [x, y, z];
}
