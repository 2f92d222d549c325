// Reads each GLB file named on the command line with Khronos' validator, three.js' GLTFLoader and
// glTF-Transform, which writes it again. Prints one JSON object a file.
import { readFileSync } from 'node:fs';
import { NodeIO } from '@gltf-transform/core';
import validator from 'gltf-validator';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

// What the loader looks for in a browser; there are no images here.
globalThis.self = globalThis;

const io = new NodeIO();
io.setLogger({ debug() {}, info() {}, warn() {}, error() {} });

for (const path of process.argv.slice(2)) {
  const bytes = new Uint8Array(readFileSync(path));
  const report = await validator.validateBytes(bytes);
  const { numErrors, numWarnings, messages } = report.issues;

  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const gltf = await new GLTFLoader().parseAsync(buffer, '');
  const grids = {};
  for (const [index, node] of gltf.parser.json.nodes.entries()) {
    const extension = node.extensions?.AOGRID_occluder;
    if (!extension) continue;
    const grid = new Uint8Array(await gltf.parser.getDependency('bufferView', extension.bufferView));
    grids[index] = { hex: Buffer.from(grid).toString('hex'), matrix: extension.matrix ?? null };
  }
  const userData = {};
  gltf.scene.traverse((object) => {
    if (object.userData.aogrid) userData[object.name] = object.userData.aogrid.uri;
  });

  const document = await io.readBinary(bytes);
  const rewritten = await io.writeJSON(await io.readBinary(await io.writeBinary(document)));
  const kept = rewritten.json.nodes.map((node) => node.extras?.aogrid?.blake3 ?? null);

  console.log(JSON.stringify({
    numErrors,
    numWarnings,
    codes: [...new Set(messages.map((message) => message.code))].sort(),
    grids,
    userData,
    kept,
    dropped: rewritten.json.extensionsUsed ?? null,
  }));
}
