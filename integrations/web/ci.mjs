// Checks the package: `node ci.mjs`, or `node ci.mjs --quick` for what needs neither a browser nor the
// compiled baker. It ends with 3 if the packages that it needs cannot be installed.

import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync } from 'node:fs';
import { dirname } from 'node:path';
import { fileURLToPath } from 'node:url';

const folder = dirname(fileURLToPath(import.meta.url));

/** Runs a command, and ends with its status or the given one if it fails. */
function run(command, args, status) {
  const shell = process.platform === 'win32';
  const result = spawnSync(command, args, { cwd: folder, stdio: 'inherit', shell });
  if (result.status !== 0) {
    console.error(`${command} ${args.join(' ')} failed`);
    process.exit(status ?? result.status ?? 1);
  }
}

if (!existsSync(`${folder}/node_modules`)) {
  run('npm', ['ci', '--no-audit', '--no-fund', '--silent'], 3);
}
run('npm', ['test', '--silent']);
if (!process.argv.includes('--quick')) {
  run('node', ['wasm/build.mjs']);
  run('node', ['page/build.mjs']);
  run('node', ['test/native.mjs']);
  // Node.js expands patterns itself from version 21 on only.
  const tests = readdirSync(`${folder}/test/wasm`).filter((name) => name.endsWith('.test.mjs'));
  run('node', ['--test', ...tests.map((name) => `test/wasm/${name}`)]);
  run('npm', ['run', 'test:browser', '--silent']);
}
