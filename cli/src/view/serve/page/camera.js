// Vectors, and a camera that turns around its target.

const add = (a, b) => a.map((x, i) => x + b[i]);
const sub = (a, b) => a.map((x, i) => x - b[i]);
const mul = (a, s) => a.map((x) => x * s);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.sqrt(dot(a, a));
const unit = (a) => mul(a, 1 / length(a));

// Rodrigues' rotation of a around a unit axis.
function turned(a, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(mul(a, c), mul(cross(axis, a), s)), mul(axis, dot(axis, a) * (1 - c)));
}

function axes(camera) {
  const forward = unit(sub(camera.target, camera.position));
  const right = unit(cross(forward, camera.up));
  return { forward, right, up: cross(right, forward), distance: length(sub(camera.target, camera.position)) };
}

// Height of what is seen at the target, world units.
function heightAtTarget(camera) {
  if (camera.projection === "orthographic") return camera.height;
  return 2 * axes(camera).distance * Math.tan((camera.fov_y * Math.PI) / 360);
}

// Turns around the target: half a turn for the shorter side of the picture, and an eighth of one where there is no back side.
function turn(dx, dy, side) {
  const { right, up } = axes(state.camera);
  const angle = (state.scene.application === "warp3d" ? Math.PI / 4 : Math.PI) / side;
  const offset = sub(state.camera.position, state.camera.target);
  const swing = (vector) => turned(turned(vector, up, -dx * angle), right, -dy * angle);
  const next = { ...state.camera, position: add(state.camera.target, swing(offset)), up: swing(up) };
  if (state.scene.application === "warp3d" && !insideCone(next)) return;
  state.camera = next;
}

// Within 25 degrees of where the picture was taken: beyond it, more is missing than seen.
function insideCone(camera) {
  const direction = (c) => unit(sub(c.target, c.position));
  return dot(direction(camera), direction(state.start)) > Math.cos((25 * Math.PI) / 180);
}

function pan(dx, dy, side) {
  const { right, up } = axes(state.camera);
  const scale = heightAtTarget(state.camera) / side;
  const shift = add(mul(right, -dx * scale), mul(up, dy * scale));
  state.camera = { ...state.camera, position: add(state.camera.position, shift), target: add(state.camera.target, shift) };
}

// Nearer to the target than this part of the scene, the target gives way. A guess.
const NEAREST = 0.01;

// Zooms towards a place of the picture: `at` is its distance from the middle, in heights of the picture, to the right and down.
function zoom(factor, at = [0, 0]) {
  const { right, up, distance } = axes(state.camera);
  const high = heightAtTarget(state.camera);
  const pointed = add(state.camera.target, add(mul(right, at[0] * high), mul(up, -at[1] * high)));
  const { position, target } = state.camera;
  if (state.camera.projection === "orthographic") {
    const shift = mul(sub(pointed, target), 1 - factor);
    state.camera = { ...state.camera, position: add(position, shift), target: add(target, shift), height: state.camera.height * factor };
    return;
  }
  const least = NEAREST * state.scene.start.scene_size;
  if (factor < 1 && distance * factor < least) {
    const shift = mul(unit(sub(pointed, position)), least * (1 - factor));
    state.camera = { ...state.camera, position: add(position, shift), target: add(target, shift) };
    return;
  }
  const towards = (place_) => add(pointed, mul(sub(place_, pointed), factor));
  state.camera = { ...state.camera, position: towards(position), target: towards(target) };
}

// The view along a world axis, from its positive or negative end.
function lookAlong(axis, sign) {
  const { distance } = axes(state.camera);
  const away = [0, 0, 0];
  away[axis] = sign;
  const start = state.start;
  // Up stays the axis that the scene stands on; seen along that one, it is the one that was forward.
  const upright = nearestAxis(start.up);
  const up = Math.abs(upright[axis]) > 0.5 ? mul(nearestAxis(axes(start).forward, upright), -sign * Math.sign(upright[axis]) * -1) : upright;
  state.camera = { ...state.camera, position: add(state.camera.target, mul(away, distance)), up };
}

function nearestAxis(vector, not = [0, 0, 0]) {
  const sizes = vector.map((x, i) => (not[i] ? 0 : Math.abs(x)));
  const best = sizes.indexOf(Math.max(...sizes));
  return vector.map((x, i) => (i === best ? Math.sign(x) : 0));
}

// Moves the target to a place in the world, and the eye with it.
function centreOn(place) {
  const shift = sub(place, state.camera.target);
  state.camera = { ...state.camera, target: place, position: add(state.camera.position, shift) };
}

// Cameras once around the target.
function around(steps) {
  const { up } = axes(state.camera);
  const offset = sub(state.camera.position, state.camera.target);
  return Array.from({ length: steps }, (_, step) => {
    const angle = (2 * Math.PI * step) / steps;
    return { ...state.camera, position: add(state.camera.target, turned(offset, up, angle)) };
  });
}

function resetView() {
  state.camera = { ...state.start };
}
