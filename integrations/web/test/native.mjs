// Makes what tests compare the package with: grids that the native baker bakes, and receivers and a
// picture that the native renderer shades. `node test/native.mjs`

import { spawnSync } from 'node:child_process';
import { existsSync, mkdirSync } from 'node:fs';
import { basename, join } from 'node:path';

import { MODELS, NATIVE, ROOT, SCENE, SHARED } from './files.mjs';

/** Runs a command in the workspace and ends if it fails. */
function run(command, ...args) {
  const result = spawnSync(command, args, { cwd: ROOT, stdio: 'inherit' });
  if (result.status !== 0) {
    console.error(`${command} ${args.join(' ')} failed`);
    process.exit(1);
  }
}

const cargo = (...args) => run('cargo', ...args);
const xtask = (...args) => cargo('run', '-q', '-p', 'xtask', '--', ...args, '--quiet');

mkdirSync(NATIVE, { recursive: true });
for (const model of MODELS) {
  if (!existsSync(model)) {
    console.log(`skipped: ${model} is not there`);
    continue;
  }
  const out = join(NATIVE, `${basename(model)}.ao.ktx2`);
  xtask('bake', model, '-o', out, '--backend', 'cpu', '--force');
}
const robot = join(NATIVE, 'robot.obj.ao.ktx2');
// As all tests are built, so that nothing is compiled twice.
cargo('build', '-q', '--workspace', '--example', 'receivers');
run(join(ROOT, 'target', 'debug', 'examples', 'receivers'), robot, join(NATIVE, 'receivers.f32'));
for (const mode of ['cone', 'merge']) {
  const picture = join(NATIVE, `${mode}.png`);
  xtask('render', SCENE, '--mode', mode, '-o', picture, '--force');
}
console.log(`test/native is up to date${existsSync(SHARED) ? '' : ', without the shared models'}`);
