// Makes what tests compare the package with: grids that the native baker bakes, and receivers and a
// picture that the native renderer shades. `node test/native.mjs`

import { spawnSync } from 'node:child_process';
import { existsSync, mkdirSync } from 'node:fs';
import { basename, join } from 'node:path';

import { MODELS, NATIVE, ROOT, SCENE, SHARED } from './files.mjs';

/** Runs cargo in the workspace and ends if it fails. */
function cargo(...args) {
  const result = spawnSync('cargo', args, { cwd: ROOT, stdio: 'inherit' });
  if (result.status !== 0) {
    console.error(`cargo ${args.join(' ')} failed`);
    process.exit(1);
  }
}

mkdirSync(NATIVE, { recursive: true });
for (const model of MODELS) {
  if (!existsSync(model)) {
    console.log(`skipped: ${model} is not there`);
    continue;
  }
  const out = join(NATIVE, `${basename(model)}.ao.ktx2`);
  cargo('run', '-q', '-p', 'aogrid', '--', 'bake', model, '-o', out, '--backend', 'cpu', '--force');
}
const robot = join(NATIVE, 'robot.obj.ao.ktx2');
const receivers = ['run', '-q', '-p', 'aogrid-runtime', '--example', 'receivers', '--'];
cargo(...receivers, robot, join(NATIVE, 'receivers.f32'));
for (const mode of ['cone', 'merge']) {
  const picture = join(NATIVE, `${mode}.png`);
  cargo('run', '-q', '-p', 'aogrid', '--', 'render', SCENE, '--mode', mode, '-o', picture, '--force');
}
console.log(`test/native is up to date${existsSync(SHARED) ? '' : ', without the shared models'}`);
