// Reads each grid file named on the command line with ktx-parse, which must write the same
// bytes again, and with three.js' KTX2Loader, which must make a 3D texture of the same texels.
// Prints one JSON object a file.
import { readFileSync } from 'node:fs';
import { read, write } from 'ktx-parse';
import { Data3DTexture, FloatType, HalfFloatType, RedFormat, RGBAFormat, UnsignedByteType } from 'three';
import { KTX2Loader } from 'three/addons/loaders/KTX2Loader.js';

const types = { [UnsignedByteType]: 'unorm8', [HalfFloatType]: 'f16', [FloatType]: 'f32' };
const formats = { [RedFormat]: 1, [RGBAFormat]: 4 };

// What detectSupport() finds on a GPU without compressed formats, which we do not use.
const loader = new KTX2Loader();
loader.workerConfig = {};

for (const path of process.argv.slice(2)) {
  const bytes = readFileSync(path);
  const container = read(bytes);
  const rewritten = Buffer.from(write(container, { keepWriter: true }));
  // Text under keys that are not Khronos' own comes as bytes with its terminating NUL.
  const json = new TextDecoder().decode(container.keyValue.aogrid).replace(/\0$/, '');
  const metadata = JSON.parse(json);

  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const texture = await new Promise((resolve, reject) => loader.parse(buffer, resolve, reject));
  const { data, width, height, depth } = texture.image;
  const texels = Buffer.from(data.buffer, data.byteOffset, data.byteLength);
  const level = container.levels[0].levelData;

  console.log(JSON.stringify({
    rewrittenEqual: rewritten.equals(bytes),
    orientation: container.keyValue.KTXorientation,
    encoding: metadata.encoding,
    is3d: texture instanceof Data3DTexture,
    size: [width, height, depth],
    type: types[texture.type],
    channels: formats[texture.format],
    texelsEqual: texels.equals(Buffer.from(level.buffer, level.byteOffset, level.byteLength)),
    colorSpace: texture.colorSpace,
  }));
}
