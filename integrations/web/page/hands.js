// Pointers and keys: objects are dragged on the floor, the divider along the view.

import * as THREE from 'three/webgpu';

/** Degrees, units and factors of a key. */
const STEP = { turn: 5, move: 0.05, scale: 1.04 };

/** Lets pointers drag objects. `select` is called with the object that is touched. */
export function dragObjects(stage, canvas, select) {
  const caster = new THREE.Raycaster();
  const floor = new THREE.Plane(new THREE.Vector3(0, 1, 0), 0);
  const offset = new THREE.Vector3();
  const point = new THREE.Vector3();
  let dragged;
  const aim = (event) => {
    const box = canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = 1 - ((event.clientY - box.top) / box.height) * 2;
    caster.setFromCamera(new THREE.Vector2(x, y), stage.camera);
  };
  // Before the controls of the camera, which see the event only if it is not for an object.
  canvas.addEventListener(
    'pointerdown',
    (event) => {
      if (!event.isPrimary || event.button !== 0) return;
      aim(event);
      const hit = caster.intersectObjects(stage.objects.map((object) => object.mesh))[0];
      if (hit === undefined) return;
      dragged = stage.objects.find((object) => object.mesh === hit.object);
      event.stopImmediatePropagation();
      canvas.setPointerCapture(event.pointerId);
      floor.constant = -hit.point.y;
      offset.copy(dragged.group.position).sub(hit.point);
      select(dragged);
    },
    { capture: true },
  );
  canvas.addEventListener('pointermove', (event) => {
    if (dragged === undefined || !event.isPrimary) return;
    aim(event);
    if (caster.ray.intersectPlane(floor, point) === null) return;
    dragged.group.position.x = point.x + offset.x;
    dragged.group.position.z = point.z + offset.z;
    stage.place(dragged);
  });
  for (const end of ['pointerup', 'pointercancel']) {
    canvas.addEventListener(end, () => (dragged = undefined));
  }
}

/** Lets keys move the chosen object. `get` returns it, `changed` is called after a change. */
export function moveByKeys(stage, canvas, { get, changed, next, remove }) {
  const moves = {
    ArrowLeft: (o) => (o.group.position.x -= STEP.move),
    ArrowRight: (o) => (o.group.position.x += STEP.move),
    ArrowUp: (o) => (o.group.position.z -= STEP.move),
    ArrowDown: (o) => (o.group.position.z += STEP.move),
    PageUp: (o) => (o.height = Math.min(o.height + STEP.move, 2)),
    PageDown: (o) => (o.height = Math.max(o.height - STEP.move, 0)),
    q: (o) => (o.turn = wrap(o.turn - STEP.turn)),
    e: (o) => (o.turn = wrap(o.turn + STEP.turn)),
    '+': (o) => (o.scale = Math.min(o.scale * STEP.scale, 2)),
    '-': (o) => (o.scale = Math.max(o.scale / STEP.scale, 0.25)),
    n: next,
    Delete: remove,
  };
  canvas.addEventListener('keydown', (event) => {
    const move = moves[event.key] ?? moves[event.key.toLowerCase()];
    const object = get();
    if (move === undefined || object === undefined || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    move(object);
    if (stage.objects.includes(object)) stage.place(object);
    changed();
  });
}

/** Returns the same angle in -180..180 degrees. */
function wrap(degrees) {
  return ((((degrees + 180) % 360) + 360) % 360) - 180;
}

/** Lets pointers and keys move the divider. `set` is called with its place, 0..1. */
export function moveDivider(divider, set) {
  let place = 0.5;
  const moveTo = (to) => {
    place = Math.min(Math.max(to, 0), 1);
    divider.style.left = `${100 * place}%`;
    divider.setAttribute('aria-valuenow', String(Math.round(100 * place)));
    set(place);
  };
  divider.addEventListener('pointerdown', (event) => {
    divider.setPointerCapture(event.pointerId);
    event.preventDefault();
    divider.focus();
  });
  divider.addEventListener('pointermove', (event) => {
    if (!divider.hasPointerCapture(event.pointerId)) return;
    const box = divider.parentElement.getBoundingClientRect();
    moveTo((event.clientX - box.left) / box.width);
  });
  divider.addEventListener('keydown', (event) => {
    const steps = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 };
    if (steps[event.key] === undefined) return;
    event.preventDefault();
    moveTo(place + steps[event.key]);
  });
  moveTo(place);
}
