// Compiles the baker to WebAssembly: `node wasm/build.mjs` in the folder above.
//
// With the target `wasm32-unknown-unknown` installed (rustup target add wasm32-unknown-unknown) that is
// all it needs. Without it, a compiler that comes with the source of its standard library compiles that,
// too: on Debian the packages rustc-web, cargo-web, rust-web-src and lld-19.

import { spawnSync } from 'node:child_process';
import { copyFileSync, existsSync, mkdirSync, readFileSync, statSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const TARGET = 'wasm32-unknown-unknown';
const folder = dirname(fileURLToPath(import.meta.url));
const built = join(folder, 'target', TARGET, 'release', 'aogrid_web.wasm');
const out = join(folder, '..', 'dist', 'aogrid.wasm');

/** Returns the standard output of a command, or nothing if it fails or does not exist. */
function output(command, args) {
  const result = spawnSync(command, args, { cwd: folder, encoding: 'utf8' });
  return result.status === 0 ? result.stdout.trim() : undefined;
}

/** Whether the standard library of the target lies in the compiler's folder. */
function hasTarget(rustc) {
  const root = output(rustc, ['--print', 'sysroot']);
  return root !== undefined && existsSync(join(root, 'lib', 'rustlib', TARGET, 'lib'));
}

/** Whether the source of the standard library lies in the compiler's folder. */
function hasSource(rustc) {
  const root = output(rustc, ['--print', 'sysroot']);
  return root !== undefined && existsSync(join(root, 'lib', 'rustlib', 'src', 'rust', 'library'));
}

/** Returns the ways to compile that work on this machine, the best first. */
function ways() {
  const flags = '-C target-feature=+simd128';
  const found = [];
  if (hasTarget('rustc')) found.push({ cargo: 'cargo', args: [], env: { RUSTFLAGS: flags } });
  for (const bin of ['', '/usr/bin/']) {
    if (!hasSource(`${bin}rustc`)) continue;
    const linker = ['wasm-ld', 'wasm-ld-19'].find((name) => output(name, ['--version']));
    const link = linker === undefined ? {} : { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER: linker };
    found.push({
      cargo: `${bin}cargo`,
      args: ['-Zbuild-std=std,panic_abort', '-Zbuild-std-features=optimize_for_size'],
      env: { RUSTFLAGS: flags, RUSTC: `${bin}rustc`, RUSTC_BOOTSTRAP: '1', ...link },
    });
  }
  return found;
}

function build() {
  for (const { cargo, args, env } of ways()) {
    const all = ['build', '--release', '--lib', '--target', TARGET, ...args];
    console.log(`${cargo} ${all.join(' ')}`);
    const result = spawnSync(cargo, all, {
      cwd: folder,
      stdio: 'inherit',
      env: { ...process.env, ...env },
    });
    if (result.status === 0) return true;
  }
  return false;
}

if (!build()) {
  console.error(
    'aogrid.wasm cannot be built: run `rustup target add wasm32-unknown-unknown`, or on Debian ' +
      '`apt-get install rustc-web cargo-web rust-web-src lld-19`',
  );
  process.exit(1);
}
mkdirSync(dirname(out), { recursive: true });
copyFileSync(built, out);
const gzipped = gzipSync(readFileSync(out), { level: 9 }).length;
console.log(`dist/aogrid.wasm: ${statSync(out).size} bytes, ${gzipped} gzipped`);
