// A headless Chromium and a server for it.

import { createReadStream, existsSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { chromium } from 'playwright-core';

import { PACKAGE, ROOT } from '../files.mjs';

/** Makes a missing browser a failure if it is `require`. */
const VARIABLE = 'AOGRID_BROWSER';

/** WebGPU on a machine without a GPU: Chromium's own rasterizer. */
const FLAGS = [
  '--no-sandbox',
  '--enable-unsafe-webgpu',
  '--ignore-gpu-blocklist',
  '--enable-gpu',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--enable-features=Vulkan',
  '--use-vulkan=swiftshader',
];

const TYPES = {
  '.html': 'text/html',
  '.js': 'text/javascript',
  '.mjs': 'text/javascript',
  '.css': 'text/css',
  '.wasm': 'application/wasm',
};

/** The folders that are served, by the first part of the path. */
const FOLDERS = {
  package: PACKAGE,
  // Another version can be tried: its folder is in this variable.
  three: process.env.AOGRID_THREE ?? join(PACKAGE, 'node_modules', 'three'),
  page: join(PACKAGE, 'dist', 'page'),
  assets: join(ROOT, 'assets'),
};

/** Returns the path of an installed Chromium, or nothing. */
export function browserPath() {
  const paths = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
  return process.env.AOGRID_CHROMIUM ?? paths.find(existsSync);
}

/** Returns why browser tests are skipped, or false. Fails if the browser is required. */
export function whySkipped() {
  if (browserPath() !== undefined) return false;
  const why = `no Chromium: install it, or set AOGRID_CHROMIUM to its path (${VARIABLE})`;
  if (process.env[VARIABLE] === 'require') throw new Error(why);
  return why;
}

/** Starts the server and the browser. `close` ends both. */
export async function start() {
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname));
    const [, first, ...rest] = path.split('/');
    const file = FOLDERS[first] && join(FOLDERS[first], ...rest);
    if (!file || !existsSync(file) || !statSync(file).isFile()) {
      response.writeHead(path === '/favicon.ico' ? 204 : 404).end();
      return;
    }
    response.setHeader('Content-Type', TYPES[extname(file)] ?? 'application/octet-stream');
    createReadStream(file).pipe(response);
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  const browser = await chromium.launch({ executablePath: browserPath(), args: FLAGS });
  return {
    url: `http://127.0.0.1:${server.address().port}`,
    browser,
    close: async () => {
      await browser.close();
      server.close();
    },
  };
}

/** Opens a page whose console messages and errors are kept in `messages`. */
export async function open({ browser, url }, path, options = {}) {
  const page = await browser.newPage(options);
  const messages = [];
  page.on('console', (message) => {
    // Chromium says at every start that its rasterizer is slow, and three.js that it uses WebGL 2.
    const text = message.text();
    const isNoise = /swiftshader|software WebGL|GPU stall|WebGPU is not available/i.test(text);
    if (!isNoise) messages.push(`${message.type()}: ${text}`);
  });
  page.on('pageerror', (error) => messages.push(`error: ${error.stack}`));
  await page.goto(url + path);
  return { page, messages };
}
