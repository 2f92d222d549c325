import { BakeError } from './wasm.js';

/**
 * Fetches and compiles the baker.
 *
 * @throws {BakeError} There is no `aogrid.wasm` at the URL.
 */
export async function compileBaker(url: string): Promise<WebAssembly.Module> {
  const response = await fetch(url);
  if (!response.ok) throw new BakeError(`${url}: ${response.status} ${response.statusText}`);
  // Not streaming: that needs a server that knows the type of the file.
  return WebAssembly.compile(await response.arrayBuffer());
}
