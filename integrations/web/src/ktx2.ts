import { GridError } from './grid-error.js';

/** The storage format of a channel. */
export type TexelFormat = 'unorm8' | 'f16' | 'f32';

/** The parts of a KTX2 file with one level of one 3D texture, each where it must be. */
export interface Layout {
  resolution: [number, number, number];
  channels: 1 | 4;
  format: TexelFormat;
  /** The key/value pairs whose values are text. */
  pairs: Map<string, string>;
  levelStart: number;
  levelLength: number;
}

const IDENTIFIER = [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];

/** Bytes of the header, of the index of the one level, and thus of all before the descriptor. */
const HEADER_LENGTH = 80;
const LEVEL_INDEX_LENGTH = 24;
const DFD_START = HEADER_LENGTH + LEVEL_INDEX_LENGTH;

/** The formats of the profile by their number in Vulkan. */
const FORMATS = new Map<number, [1 | 4, TexelFormat]>([
  [9, [1, 'unorm8']],
  [37, [4, 'unorm8']],
  [76, [1, 'f16']],
  [97, [4, 'f16']],
  [100, [1, 'f32']],
  [109, [4, 'f32']],
]);

const CHANNEL_BYTES = { unorm8: 1, f16: 2, f32: 4 };

/** The bounds of a grid: cells along an axis, and in all. */
const RESOLUTIONS = [8, 2048];
const MAX_CELLS = 2 ** 27;

/**
 * Checks the header, the descriptor and the offsets, in the order of the file.
 *
 * @throws {GridError}
 */
export function readLayout(bytes: Uint8Array): Layout {
  if (bytes.length >= 12 && IDENTIFIER.some((byte, idx) => bytes[idx] !== byte)) {
    const message = 'not a KTX2 file: the first 12 bytes are not the KTX2 identifier';
    throw new GridError('not-ktx2', message);
  }
  need(bytes, HEADER_LENGTH, 'the header');
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const [channels, format] = readKind(view);
  const texelBytes = channels * CHANNEL_BYTES[format];
  const dfdEnd = checkDescriptor(bytes, view, channels, format);
  const [pairs, kvdEnd] = readKeyValues(bytes, view, dfdEnd);
  const resolution = readResolution(view);
  const cells = resolution[0] * resolution[1] * resolution[2];
  const levelLength = cells * texelBytes;
  const levelStart = checkLevel(bytes, view, kvdEnd, texelBytes, levelLength);
  return { resolution, channels, format, pairs, levelStart, levelLength };
}

function need(bytes: Uint8Array, end: number, what: string): void {
  if (end > bytes.length) {
    const message = `the file ends at byte ${bytes.length}, before the end of ${what} at byte ${end}`;
    throw new GridError('truncated', message);
  }
}

function notAGrid(reason: string): GridError {
  return new GridError('not-a-grid', `a KTX2 file, but not an ambient-occlusion grid: ${reason}`);
}

function readKind(view: DataView): [1 | 4, TexelFormat] {
  const scheme = view.getUint32(44, true);
  if (scheme !== 0) {
    throw notAGrid(`it is supercompressed (scheme ${scheme}): unpack it before, or bake it anew`);
  }
  const number = view.getUint32(12, true);
  const kind = FORMATS.get(number);
  if (kind === undefined) throw notAGrid(`its Vulkan format ${number} is not of the profile`);
  if (view.getUint32(24, true) === 0 || view.getUint32(28, true) === 0) {
    throw notAGrid('it is not a 3D texture');
  }
  const counts = [32, 36, 40].map((offset) => view.getUint32(offset, true));
  if (counts[0] !== 0 || counts[1] !== 1 || counts[2] !== 1) {
    const found = counts.join(', ');
    throw notAGrid(`layerCount, faceCount and levelCount are ${found}, not 0, 1, 1`);
  }
  return kind;
}

/** Compares the descriptor with the one that the format requires, and returns its end. */
function checkDescriptor(
  bytes: Uint8Array,
  view: DataView,
  channels: 1 | 4,
  format: TexelFormat,
): number {
  const what = 'the data format descriptor';
  checkOffset(what, DFD_START, view.getUint32(48, true));
  const expected = descriptor(channels, format);
  const end = DFD_START + expected.length;
  need(bytes, end, what);
  const isSame = expected.every((byte, idx) => bytes[DFD_START + idx] === byte);
  const length = view.getUint32(52, true);
  const typeSize = view.getUint32(16, true);
  if (!isSame || length !== expected.length || typeSize !== CHANNEL_BYTES[format]) {
    throw notAGrid('its data format descriptor does not describe its format');
  }
  return end;
}

/** Returns the descriptor section of a format: the basic block of KTX2, with a sample a channel. */
function descriptor(channels: 1 | 4, format: TexelFormat): Uint8Array {
  const length = 28 + 16 * channels;
  const view = new DataView(new ArrayBuffer(length));
  const size = CHANNEL_BYTES[format];
  const isFloat = format !== 'unorm8';
  view.setUint32(0, length, true);
  // Version 2 of the basic block, and its length without that of the section.
  view.setUint32(8, 2 | ((length - 4) << 16), true);
  // The color model RGBSDA, the primaries of BT.709, linear.
  view.setUint32(12, 0x010101, true);
  view.setUint32(20, channels * size, true);
  for (let channel = 0; channel < channels; channel++) {
    const at = 28 + 16 * channel;
    view.setUint16(at, 8 * size * channel, true);
    view.setUint8(at + 2, 8 * size - 1);
    // Alpha is channel 15; floats are signed.
    view.setUint8(at + 3, (channel === 3 ? 15 : channel) | (isFloat ? 0xc0 : 0));
    view.setUint32(at + 8, isFloat ? 0xbf800000 : 0, true);
    view.setUint32(at + 12, isFloat ? 0x3f800000 : 255, true);
  }
  return new Uint8Array(view.buffer);
}

function checkOffset(what: string, expected: number, found: number): void {
  if (expected !== found) {
    throw new GridError('misplaced', `${what} should start at byte ${expected}, not ${found}`);
  }
}

/** Returns the pairs whose values are text, and the end of the section. */
function readKeyValues(
  bytes: Uint8Array,
  view: DataView,
  start: number,
): [Map<string, string>, number] {
  const length = view.getUint32(60, true);
  if (length === 0) throw missingMetadata();
  checkOffset('the key/value data', start, view.getUint32(56, true));
  const end = start + length;
  need(bytes, end, 'the key/value data');
  checkOffset('supercompression global data', 0, number64(view, 64));
  if (number64(view, 72) !== 0) throw notAGrid('it has supercompression global data');
  return [parsePairs(bytes, view, start, end), end];
}

/** Returns the error of a file without the key of the profile. */
export function missingMetadata(): GridError {
  return new GridError(
    'no-metadata',
    'a 3D texture without `aogrid` metadata: not baked by aogrid, or stripped by another tool',
  );
}

function parsePairs(
  bytes: Uint8Array,
  view: DataView,
  start: number,
  end: number,
): Map<string, string> {
  const malformed = (reason: string) =>
    new GridError('key-value', `the key/value data is malformed: ${reason}`);
  const decoder = new TextDecoder('utf-8', { fatal: true, ignoreBOM: true });
  const pairs = new Map<string, string>();
  for (let at = start; at < end; ) {
    if (at + 4 > end) throw malformed('the length of a pair is truncated');
    const length = view.getUint32(at, true);
    const pairEnd = at + 4 + length;
    if (pairEnd > end) throw malformed('a pair is longer than the section');
    const pair = bytes.subarray(at + 4, pairEnd);
    const nul = pair.indexOf(0);
    if (nul < 0) throw malformed('a key is not NUL-terminated');
    let key: string;
    try {
      key = decoder.decode(pair.subarray(0, nul));
    } catch {
      throw malformed('a key is not UTF-8');
    }
    const value = text(decoder, pair.subarray(nul + 1));
    // The first of several is the one that counts.
    if (value !== undefined && !pairs.has(key)) pairs.set(key, value);
    at += 4 + Math.ceil(length / 4) * 4;
    if (at > end) throw malformed('the padding of a pair is truncated');
  }
  return pairs;
}

/** Returns a value that is text and ends with NUL. */
function text(decoder: TextDecoder, value: Uint8Array): string | undefined {
  if (value.at(-1) !== 0) return undefined;
  try {
    return decoder.decode(value.subarray(0, -1));
  } catch {
    return undefined;
  }
}

function readResolution(view: DataView): [number, number, number] {
  const [x, y, z] = [20, 24, 28].map((offset) => view.getUint32(offset, true));
  const outside = [x, y, z].find((n) => n < RESOLUTIONS[0] || n > RESOLUTIONS[1]);
  if (outside !== undefined) {
    const bounds = `${RESOLUTIONS[0]}..${RESOLUTIONS[1]}`;
    throw new GridError('box', `resolution ${outside} is outside ${bounds} cells per axis`);
  }
  if (x * y * z > MAX_CELLS) {
    const message = `${x} × ${y} × ${z} cells exceed the maximum of ${MAX_CELLS} per grid`;
    throw new GridError('box', message);
  }
  return [x, y, z];
}

function checkLevel(
  bytes: Uint8Array,
  view: DataView,
  kvdEnd: number,
  texelBytes: number,
  length: number,
): number {
  const alignment = Math.max(texelBytes, 4);
  const start = Math.ceil(kvdEnd / alignment) * alignment;
  checkOffset('the level', start, number64(view, 80));
  for (const found of [number64(view, 96), number64(view, 88)]) {
    if (found !== length) {
      const message = `the level holds ${found} bytes, but its size and format require ${length}`;
      throw new GridError('level-length', message);
    }
  }
  need(bytes, start + length, 'the level');
  const extra = bytes.length - (start + length);
  if (extra !== 0) {
    throw new GridError('trailing-bytes', `${extra} bytes follow the end of the texture`);
  }
  return start;
}

/** Returns a number of 64 bits, exact up to 2^53; larger ones are no length of a file. */
function number64(view: DataView, offset: number): number {
  return Number(view.getBigUint64(offset, true));
}
