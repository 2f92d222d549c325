// Scenes that tests render: a floor, a wall and a pane around an object with a grid.

import * as THREE from 'three/webgpu';
import { float, vec3, vec4 } from 'three/tsl';
import { parseGrid } from 'aogrid';
import { AoGridLoader, AoGridShadows, aogrid } from 'aogrid/three';

const SIZE = 128;

/** Returns the grid of base64 text. */
export function gridOf(base64) {
  return parseGrid(Uint8Array.from(atob(base64), (c) => c.charCodeAt(0)));
}

/** Returns a renderer without a canvas on the page. */
async function renderer(isWebGL, size = SIZE) {
  const made = new THREE.WebGPURenderer({ forceWebGL: isWebGL, antialias: false });
  made.setSize(size, size, false);
  made.toneMapping = THREE.NoToneMapping;
  await made.init();
  // three.js would fall back to WebGL 2 without a word.
  if ((made.backend.isWebGLBackend === true) !== isWebGL) throw new Error('it is the wrong backend');
  return made;
}

/** Renders into a target of single floats and returns its pixels, rows from the top. */
async function pixels(made, scene, camera, size = SIZE) {
  const target = new THREE.RenderTarget(size, size, { type: THREE.FloatType });
  made.setRenderTarget(target);
  made.render(scene, camera);
  const read = await made.readRenderTargetPixelsAsync(target, 0, 0, size, size);
  // Rows are padded to 256 bytes on WebGPU; these have a multiple of that.
  const rows = Array.from({ length: size }, (_, y) => read.slice(4 * size * y, 4 * size * (y + 1)));
  if (made.backend.isWebGLBackend) rows.reverse();
  made.dispose();
  return rows.flatMap((row) => [...row]);
}

function camera() {
  const made = new THREE.PerspectiveCamera(45, 1, 0.1, 100);
  made.position.set(2.5, 2.5, 4);
  made.lookAt(0, 0.5, 0);
  return made;
}

function plane(material, scene, place) {
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(8, 8), material);
  place(mesh);
  scene.add(mesh);
  return mesh;
}

const floor = (mesh) => mesh.rotateX(-Math.PI / 2);
const wall = (mesh) => void mesh.position.set(0, 0, -0.8);

/**
 * Renders a floor and a wall, lit by `light`: `ambient`, `sun` or `both`, with `count` objects of the grid
 * in a row. `pane` adds a transparent pane.
 */
export async function render({ grid, isWebGL, light, combine, count = 1, pane = false, add = true }) {
  const made = await renderer(isWebGL);
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0);
  if (light !== 'sun') scene.add(new THREE.AmbientLight(0xffffff, 2));
  if (light !== 'ambient') {
    const sun = new THREE.DirectionalLight(0xffffff, 2);
    sun.position.set(1, 3, 2);
    scene.add(sun);
  }
  plane(new THREE.MeshStandardMaterial({ color: 0xcccccc }), scene, floor);
  plane(new THREE.MeshPhysicalMaterial({ color: 0xcccccc }), scene, wall);
  if (pane) {
    const glass = { color: 0xffffff, transparent: true, opacity: 0.5 };
    const mesh = plane(new THREE.MeshLambertMaterial(glass), scene, (m) => void m.position.set(0, 0.8, -0.4));
    mesh.scale.setScalar(0.2);
  }
  const shadows = new AoGridShadows({ combine });
  made.contextNode = shadows.contextNode;
  const parsed = gridOf(grid);
  for (let idx = 0; add && idx < count; idx++) {
    const object = new THREE.Group();
    object.position.set(0.7 * idx - 0.35 * (count - 1), 0, 0);
    object.rotation.y = 0.5 * idx;
    scene.add(object);
    shadows.add(parsed, object);
  }
  return pixels(made, scene, camera());
}

/** Renders 1 - AO of the scene `scene.toml`, by `aogrid` for each object or by `AoGridShadows`. */
export async function renderScene({ robot, table, corners, isWebGL, how, background }) {
  const made = await renderer(isWebGL, 256);
  const scene = new THREE.Scene();
  const places = [
    { grid: gridOf(robot), corners: corners.robot, position: [0, 0, 0], degrees: 20 },
    { grid: gridOf(table), corners: corners.table, position: [1.5, 0, -0.5], degrees: -15 },
  ];
  const shadows = new AoGridShadows({ combine: how === 'merge' ? 'merge' : 'multiply' });
  const material = new THREE.MeshBasicNodeMaterial({ side: THREE.DoubleSide });
  let product = float(1);
  for (const { grid, corners: floats, position, degrees } of places) {
    const geometry = new THREE.BufferGeometry();
    const positions = Float32Array.from({ length: floats.length / 2 }, (_, idx) => floats[6 * Math.floor(idx / 3) + (idx % 3)]);
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    // Without an index, each triangle has its own normal.
    geometry.computeVertexNormals();
    const mesh = new THREE.Mesh(geometry, material);
    mesh.position.fromArray(position);
    mesh.rotation.y = (degrees * Math.PI) / 180;
    scene.add(mesh);
    shadows.add(grid, mesh);
    if (how === 'node') product = product.mul(aogrid(grid, mesh));
  }
  material.colorNode = vec4(vec3(how === 'node' ? product : shadows.node), 1);
  const ground = new THREE.Mesh(new THREE.PlaneGeometry(30, 30), material);
  scene.add(floor(ground));
  // Set in linear color, as the pixels are.
  scene.background = new THREE.Color().setScalar(background);
  const eye = new THREE.PerspectiveCamera(40, 1, 0.1, 100);
  eye.position.set(3.4, 2.6, 4.6);
  eye.lookAt(0.4, 0.5, 0);
  return pixels(made, scene, eye, 256);
}

/** Returns the red channel of a picture, 0..255. */
export async function picture(url) {
  const image = await createImageBitmap(await (await fetch(url)).blob(), { colorSpaceConversion: 'none' });
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  const { data } = context.getImageData(0, 0, image.width, image.height);
  return Array.from({ length: data.length / 4 }, (_, idx) => data[4 * idx]);
}

/** Returns the resolution of a grid that the loader loads, or the code of its error. */
export async function load(url) {
  try {
    return (await new AoGridLoader().loadAsync(url)).resolution;
  } catch (error) {
    return error.code ?? error.message;
  }
}

/** Returns the messages of misuse of `AoGridShadows`, and whether it draws after changes. */
export async function misuse({ grid, occlusion }) {
  const messages = [];
  const attempt = (run) => {
    try {
      run();
    } catch (error) {
      messages.push(error.message);
    }
  };
  const shadows = new AoGridShadows({ capacity: 1 });
  const [first, second] = [new THREE.Group(), new THREE.Group()];
  const parsed = gridOf(grid);
  attempt(() => new AoGridShadows({ capacity: 1000 }));
  attempt(() => shadows.add(gridOf(occlusion), first));
  attempt(() => shadows.add(parsed, first));
  attempt(() => shadows.add(parsed, first, { strength: 0.5 }));
  attempt(() => shadows.add(parsed, second));
  attempt(() => shadows.remove(first).remove(first).add(parsed, second));
  return messages;
}
