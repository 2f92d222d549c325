// The scene: a room, objects with grids, and a view in two halves.

import * as THREE from 'three/webgpu';
import { Fn, If, context, float, mrt, normalView, pass, screenUV, texture, uniform } from 'three/tsl';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { ao } from 'three/addons/tsl/display/GTAONode.js';
import { AoGridShadows } from 'aogrid/three';

/** What a half of the view shows. */
export const MODES = { grids: 'Grids', off: 'No occlusion', truth: 'Ray-traced truth', gtao: 'GTAO of three.js' };

/** The receivers of the room, for three.js and for rays: center and half edges. */
export const PLANES = [
  { center: [0, 0, 0], halfEdges: [[0, 0, 3.2], [4, 0, 0]] },
  { center: [0, 1.6, -1.7], halfEdges: [[4, 0, 0], [0, 1.6, 0]] },
];

/** Objects at once. */
export const CAPACITY = 16;

/** The radius in which GTAO looks, about the size of an object. */
const GTAO_RADIUS = 0.6;

export class Stage {
  /** Starts the renderer, with WebGPU where the browser has it. */
  static async create(canvas, options) {
    const renderer = new THREE.WebGPURenderer({ canvas, antialias: true, ...options });
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    await renderer.init();
    return new Stage(renderer);
  }

  constructor(renderer) {
    this.renderer = renderer;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0xdfe3e6);
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.05, 60);
    this.camera.position.set(1.6, 2.2, 4.6);
    this.controls = new OrbitControls(this.camera, renderer.domElement);
    this.controls.target.set(0, 0.55, -0.2);
    this.controls.maxPolarAngle = 1.54;
    this.controls.minDistance = 1;
    this.controls.maxDistance = 14;
    this.controls.update();
    this.controls.addEventListener('change', () => this.changed());
    this.split = uniform(0.5);
    this.truth = texture(new THREE.DataTexture(new Uint8Array([255]), 1, 1, THREE.RedFormat));
    this.truth.value.needsUpdate = true;
    this.modes = ['grids', 'off'];
    this.objects = [];
    this.strength = 1;
    this.onChange = () => {};
    this.needsFrame = true;
    this.#light();
    this.#room();
    this.setCombine('multiply');
  }

  get isWebGPU() {
    return this.renderer.backend.isWebGPUBackend === true;
  }

  #light() {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xe8e4df, 2.3));
    const sun = new THREE.DirectionalLight(0xfff1de, 0.5);
    sun.position.set(2, 4, 3);
    this.scene.add(sun);
  }

  #room() {
    const material = new THREE.MeshStandardMaterial({ color: 0xd9d6d1, roughness: 1 });
    for (const { center, halfEdges } of PLANES) {
      const [u, v] = halfEdges.map((edge) => new THREE.Vector3(...edge));
      const middle = new THREE.Vector3(...center);
      const corner = (s, t) => middle.clone().addScaledVector(u, s).addScaledVector(v, t);
      const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
      const geometry = new THREE.BufferGeometry().setFromPoints(corners);
      geometry.setIndex([0, 1, 2, 0, 2, 3]);
      geometry.computeVertexNormals();
      this.scene.add(new THREE.Mesh(geometry, material));
    }
  }

  /** Combines objects by `multiply` or `merge`. */
  setCombine(combine) {
    this.shadows?.dispose();
    this.shadows = new AoGridShadows({ capacity: CAPACITY, combine });
    for (const { grid, mesh } of this.objects) {
      if (grid) this.shadows.add(grid, mesh, { strength: this.strength });
    }
    this.setModes(...this.modes);
  }

  setStrength(strength) {
    this.strength = strength;
    for (const { grid, mesh } of this.objects) {
      if (grid) this.shadows.add(grid, mesh, { strength });
    }
    this.needsFrame = true;
  }

  /** Gives an object its grid, new or another one. */
  setGrid(object, grid) {
    object.grid = grid;
    this.shadows.add(grid, object.mesh, { strength: this.strength });
    this.changed();
  }

  /** Shows two of `MODES` left and right of the divider. */
  setModes(left, right) {
    this.modes = [left, right];
    const usesGtao = this.modes.includes('gtao');
    const prePass = usesGtao ? this.#prePass() : undefined;
    const of = (mode) => this.#transmittance(mode, prePass);
    const split = this.split;
    const both = Fn(() => {
      const t = float(1).toVar();
      // The blocks return nothing: what they return would be that of the function.
      If(screenUV.x.lessThan(split), () => void t.assign(of(left))).Else(() => void t.assign(of(right)));
      return t;
    })();
    const node = context(null, {
      getAO: (input, { material }) => {
        if (material.isMeshBasicNodeMaterial || material.isLineBasicNodeMaterial) return input;
        return input === null ? both : input.mul(both);
      },
    });
    this.pipeline?.dispose();
    this.pipeline = undefined;
    if (usesGtao) {
      const scenePass = pass(this.scene, this.camera, { samples: 4 });
      scenePass.contextNode = node;
      this.pipeline = new THREE.RenderPipeline(this.renderer, scenePass);
    }
    this.renderer.contextNode = usesGtao ? context() : node;
    this.changed();
  }

  /** Returns the AO of three.js, from the depth and the normals of what is on the screen. */
  #prePass() {
    const prePass = pass(this.scene, this.camera);
    prePass.setMRT(mrt({ output: normalView }));
    const depth = prePass.getTextureNode('depth');
    const gtao = ao(depth, prePass.getTextureNode(), this.camera);
    gtao.radius.value = GTAO_RADIUS;
    return gtao.getTextureNode();
  }

  #transmittance(mode, gtao) {
    if (mode === 'grids') return this.shadows.node;
    if (mode === 'truth') return this.truth.sample(screenUV).r;
    if (mode === 'gtao') return gtao.sample(screenUV).r;
    return float(1);
  }

  /** Shows an image of 1 - AO, one byte a pixel, rows from the top, as the truth. */
  setTruth(bytes, width, height) {
    const old = this.truth.value;
    const made = new THREE.DataTexture(bytes, width, height, THREE.RedFormat);
    made.minFilter = THREE.LinearFilter;
    made.magFilter = THREE.LinearFilter;
    made.unpackAlignment = 1;
    made.needsUpdate = true;
    this.truth.value = made;
    old.dispose();
    this.needsFrame = true;
  }

  /** Adds an object from its corners: positions and normals in turn, three corners a triangle. */
  addObject(name, corners) {
    const geometry = new THREE.BufferGeometry();
    const buffer = new THREE.InterleavedBuffer(corners, 6);
    geometry.setAttribute('position', new THREE.InterleavedBufferAttribute(buffer, 3, 0));
    geometry.setAttribute('normal', new THREE.InterleavedBufferAttribute(buffer, 3, 3));
    geometry.computeBoundingBox();
    const box = geometry.boundingBox;
    const size = box.getSize(new THREE.Vector3());
    const hue = (0.58 + 0.31 * this.objects.length) % 1;
    const material = new THREE.MeshStandardMaterial({ roughness: 0.7, side: THREE.DoubleSide });
    material.color.setHSL(hue, 0.22, 0.62);
    const mesh = new THREE.Mesh(geometry, material);
    // The group's origin is the middle of the object, which turns around it.
    mesh.position.copy(box.getCenter(new THREE.Vector3())).negate();
    const tilt = new THREE.Group().add(mesh);
    const group = new THREE.Group().add(tilt);
    const unit = 1.25 / Math.max(size.x, size.y, size.z);
    const object = { name, corners, mesh, tilt, group, unit, height: 0, turn: 0, scale: 1 };
    group.position.set(0, 0, -0.2);
    this.objects.push(object);
    this.scene.add(group);
    this.place(object);
    return object;
  }

  /** Applies an object's height, turn and scale. */
  place(object) {
    const { group, tilt } = object;
    group.rotation.y = (object.turn * Math.PI) / 180;
    group.scale.setScalar(object.unit * object.scale);
    const box = new THREE.Box3();
    const position = new THREE.Vector3();
    tilt.updateMatrix();
    const corners = object.mesh.geometry.boundingBox.clone().applyMatrix4(
      new THREE.Matrix4().makeTranslation(object.mesh.position),
    );
    box.copy(corners).applyMatrix4(tilt.matrix);
    position.copy(group.position);
    group.position.y = object.height - box.min.y * group.scale.y;
    group.position.x = THREE.MathUtils.clamp(position.x, -3.4, 3.4);
    group.position.z = THREE.MathUtils.clamp(position.z, -1.5, 2.8);
    this.changed();
  }

  tilt(object) {
    const quarter = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(1, 0, 0), -Math.PI / 2);
    object.tilt.quaternion.premultiply(quarter);
    this.place(object);
  }

  removeObject(object) {
    this.shadows.remove(object.mesh);
    this.scene.remove(object.group);
    object.mesh.geometry.dispose();
    object.mesh.material.dispose();
    this.objects.splice(this.objects.indexOf(object), 1);
    this.changed();
  }

  /** Notes that what is seen has changed, so that the truth begins anew. */
  changed() {
    this.needsFrame = true;
    this.onChange();
  }

  resize(width, height) {
    this.camera.aspect = width / height;
    // Narrow views keep the width of the scene.
    this.camera.fov = width < height ? 40 * Math.min(height / width, 1.5) : 40;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height, false);
    this.changed();
  }

  /** Returns the milliseconds that a frame took; with WebGPU until the GPU was done. */
  async frame() {
    this.needsFrame = false;
    const start = performance.now();
    if (this.pipeline) this.pipeline.render();
    else this.renderer.render(this.scene, this.camera);
    if (this.isWebGPU) await this.renderer.backend.device.queue.onSubmittedWorkDone();
    return performance.now() - start;
  }
}
