// Puts the page together in dist/page: its own files, the package, three.js and samples. Copy that folder
// to any web server. `node page/build.mjs`, after `npm run build`.

import { cpSync, existsSync, mkdirSync, readdirSync, readFileSync, rmSync, statSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const page = dirname(fileURLToPath(import.meta.url));
const root = join(page, '..');
const out = join(root, 'dist', 'page');
const three = join(root, 'node_modules', 'three');

/** Everything that the page needs of three.js. */
const THREE = ['three.core.js', 'three.tsl.js', 'three.webgpu.js'];
const ADDONS = ['controls/OrbitControls.js', 'tsl/display/GTAONode.js'];
const SAMPLES = ['box', 'robot', 'space-ship', 'table'];

if (!existsSync(join(root, 'dist', 'aogrid.wasm'))) {
  console.error('dist/aogrid.wasm is not there: run `npm run build` first');
  process.exit(1);
}
rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
for (const file of readdirSync(page).filter((name) => /\.(html|css|js)$/.test(name))) {
  cpSync(join(page, file), join(out, file));
}
const isPage = (path) => path.startsWith(out) || path.endsWith('.d.ts');
for (const name of readdirSync(join(root, 'dist'))) {
  const from = join(root, 'dist', name);
  if (!isPage(from)) cpSync(from, join(out, 'aogrid', name), { recursive: true, filter: (path) => !isPage(path) });
}
for (const name of THREE) cpSync(join(three, 'build', name), join(out, 'three', name));
for (const name of ADDONS) cpSync(join(three, 'examples', 'jsm', name), join(out, 'three', 'addons', name));
for (const name of SAMPLES) {
  cpSync(join(root, '..', '..', 'assets', `${name}.obj`), join(out, 'samples', `${name}.obj`));
}

/** Returns the bytes of all files below a folder, each gzipped. */
function gzipped(folder) {
  const sizes = readdirSync(folder).map((name) => {
    const path = join(folder, name);
    if (statSync(path).isDirectory()) return gzipped(path);
    return gzipSync(readFileSync(path), { level: 9 }).length;
  });
  return sizes.reduce((sum, size) => sum + size, 0);
}

const total = gzipped(out) - gzipped(join(out, 'three'));
console.log(`dist/page: ${total} bytes gzipped, without three.js`);
