import type { BakeReply, BakeRequest } from './bake.js';
import { compileBaker } from './compile.js';
import { Baker } from './wasm.js';

/** The least share of progress between two messages. */
const PROGRESS_STEP = 0.01;

function reply(message: BakeReply): void {
  postMessage(message);
}

async function answer(request: BakeRequest): Promise<void> {
  const { name, bytes, settings, wantsCorners, wasm } = request;
  try {
    const baker = await Baker.start(await compileBaker(wasm));
    let told = 0;
    const model = baker.load(name, bytes);
    if (wantsCorners) reply({ corners: baker.corners(model) });
    const result = baker.bake(model, settings, (share) => {
      if (share >= told + PROGRESS_STEP) {
        told = share;
        reply({ progress: share });
      }
    });
    reply({ result });
  } catch (error) {
    reply({ error: error instanceof Error ? error.message : String(error) });
  }
}

addEventListener('message', ({ data }: MessageEvent<BakeRequest>) => void answer(data));
