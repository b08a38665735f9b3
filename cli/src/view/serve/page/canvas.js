// The picture, the marks over it, and what the pointer does.

const canvas = document.getElementById("picture");
const marks = document.getElementById("marks");
const statusLine = document.getElementById("status");

// Time without motion after which the picture is drawn to the end, ms.
const REST_MS = 150;
// Most pixels of a picture at rest.
const MAX_PIXELS = 2e6;

// Time for which a note stays, ms.
const NOTE_MS = 6000;

let restTimer = 0;
let noteUntil = 0;
const frames = []; // times at which moving frames were shown, ms
const times = {};  // time of a resting picture by exactness, ms
let lastBlob = null;

function say(text, isBad = false) {
  // Sizes and times of pictures do not push a note away.
  if (!isBad && performance.now() < noteUntil) return;
  noteUntil = 0;
  statusLine.textContent = text;
  statusLine.classList.toggle("bad", isBad);
}

// Says something that a person should have the time to read.
function note(text) {
  noteUntil = 0;
  say(text);
  noteUntil = performance.now() + NOTE_MS;
}

// Size of the picture, px of the screen.
function fullSize() {
  const box = canvas.getBoundingClientRect();
  let scale = window.devicePixelRatio || 1;
  scale = Math.min(scale, Math.sqrt(MAX_PIXELS / (box.width * box.height)));
  return [box.width, box.height].map((side) => Math.max(1, Math.round(side * scale)));
}

// Something was changed: a quick picture now, an exact one when nothing changes any more.
function changed({ panel = false, moving = true } = {}) {
  if (!state.scene) return;
  if (panel) buildPanel();
  const size = fullSize();
  clearTimeout(restTimer);
  scaleDepth = null;
  if (moving) {
    send({ type: "draw", id: nextId++, motion: "moving", ...view(size) });
    restTimer = setTimeout(() => changed({ moving: false }), REST_MS);
  } else {
    send({ type: "draw", id: nextId++, motion: "resting", ...view(size) });
    askThumbnails();
    if (state.slices) askSlices([0, 1, 2]);
    keepAddress();
  }
  drawMarks();
  refreshButtons();
}

function show(bitmap, head, blob) {
  const size = fullSize();
  if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
  const context = canvas.getContext("2d");
  context.imageSmoothingQuality = "medium";
  const grey = state.scene.backdrop;
  context.fillStyle = `rgb(${grey} ${grey} ${grey})`;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
  bitmap.close();
  const now = performance.now();
  document.body.dataset.shown = head.id;
  document.body.dataset.kind = head.kind + (head.is_last ? " last" : "");
  if (playing && head.kind === "moving") setTimeout(nextStep, STEP_MS);
  if (head.kind === "moving") {
    frames.push(now);
    while (frames.length > 1 && now - frames[0] > 1000) frames.shift();
    const rate = frames.length > 1 ? ((frames.length - 1) * 1000) / (now - frames[0]) : 0;
    say(`${head.width} x ${head.height}, ${head.draw_ms.toFixed(0)} ms, ${rate.toFixed(0)} frames a second`);
  } else {
    frames.length = 0;
    if (head.is_last) {
      times[state.exactness] = head.draw_ms;
      lastBlob = blob;
      showTimes();
      askScale();
    }
    say(`${head.width} x ${head.height}, ${head.draw_ms.toFixed(0)} ms${head.is_last ? "" : ", refining... (Esc cancels)"}`);
  }
}

// A scale bar, the world's axes, and letters of the patient's sides.
function drawMarks() {
  const box = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  [marks.width, marks.height] = [box.width * ratio, box.height * ratio];
  const context = marks.getContext("2d");
  context.scale(ratio, ratio);
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 1.5;
  const { right, up, forward } = axes(state.camera);
  const names = patientSides() ?? ["x", "y", "z"];
  const centre = [44, box.height - 78];
  const arrows = [0, 1, 2].map((axis) => {
    const direction = [0, 0, 0];
    direction[axis] = 1;
    return { axis, x: dot(direction, right), y: -dot(direction, up), z: dot(direction, forward) };
  });
  arrows.sort((a, b) => b.z - a.z);
  // What is drawn into the picture is not drawn over it.
  for (const arrow of isDrawn("axes") ? [] : arrows) {
    const colour = ["#ff6b6b", "#7bd88f", "#6ab0ff"][arrow.axis];
    context.strokeStyle = context.fillStyle = colour;
    context.beginPath();
    context.moveTo(...centre);
    context.lineTo(centre[0] + 26 * arrow.x, centre[1] + 26 * arrow.y);
    context.stroke();
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(names[arrow.axis], centre[0] + 35 * arrow.x, centre[1] + 35 * arrow.y);
  }
  if (!isDrawn("scale-bar")) scaleBar(context, box);
  drawHandles(context);
  drawMeeting(context);
  drawMeasures(context);
}

// What the middle of the picture shows decides where the bar is true; null as long as that is not known.
let scaleDepth = null;

function askScale() {
  if (state.camera.projection === "orthographic") return;
  const size = fullSize();
  send({ type: "probe", purpose: "scale", at: size.map((side) => side / 2), ...view(size) });
}

function scaleFound(found) {
  if (!found) return;
  const { forward } = axes(state.camera);
  const depth = dot(sub(found.world, state.camera.position), forward);
  if (depth > 0) scaleDepth = depth;
  drawMarks();
}

// A length on the screen, in world units. In perspective it holds at one depth: that of what the middle of the picture shows.
function scaleBar(context, box) {
  const atTarget = heightAtTarget(state.camera) / box.height;
  const perPixel = scaleDepth ? (atTarget * scaleDepth) / axes(state.camera).distance : atTarget;
  const most = perPixel * Math.min(160, box.width / 4);
  const power = 10 ** Math.floor(Math.log10(most));
  const world = [5, 2, 1].map((n) => n * power).find((n) => n <= most);
  const width = world / perPixel;
  const [x, y] = [box.width - 16 - width, box.height - 18];
  context.strokeStyle = context.fillStyle = "#ddd";
  context.beginPath();
  context.moveTo(x, y - 4);
  context.lineTo(x, y);
  context.lineTo(x + width, y);
  context.lineTo(x + width, y - 4);
  context.stroke();
  context.textAlign = "center";
  context.textBaseline = "bottom";
  const where = state.camera.projection === "orthographic" ? "" : scaleDepth ? " in the middle" : " at the centre";
  context.textAlign = "right";
  context.fillText(`${Number(world.toPrecision(2))} ${state.scene.unit ?? "units"}${where}`, x + width, y - 4);
}

// The side of the patient that each world axis points to, where the file says it.
function patientSides() {
  const words = state.scene.volume?.space?.toLowerCase().split("-");
  const letters = { left: "L", right: "R", anterior: "A", posterior: "P", superior: "S", inferior: "I" };
  const sides = words?.map((word) => letters[word]);
  return sides?.length >= 3 && sides.every(Boolean) ? sides : null;
}

let drag = null;
let probeTimer = 0;
// The fingers, or the mouse, that hold the picture: places by number.
const held = new Map();

// Two fingers: where their middle is, and how far apart they are.
function pinch() {
  const [a, b] = [...held.values()];
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)) };
}

// The distance of a place of the page from the middle of the picture, in heights of the picture.
function fromMiddle({ x, y }) {
  const box = canvas.getBoundingClientRect();
  return [(x - box.left - box.width / 2) / box.height, (y - box.top - box.height / 2) / box.height];
}

// The motion that a press begins: a handle, the window of values, panning or turning.
function dragOf(event) {
  const box = canvas.getBoundingClientRect();
  const handle = event.button === 0 ? handleAt(event.clientX - box.left, event.clientY - box.top) : null;
  if (handle) return { kind: "handle", handle };
  if (event.button === 2 && state.scene?.volume?.function) return { kind: "window", window: windowOfCurve() };
  return { kind: event.shiftKey || event.button > 0 ? "pan" : "turn" };
}

canvas.addEventListener("contextmenu", (event) => event.preventDefault());

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  held.set(event.pointerId, { x: event.clientX, y: event.clientY });
  drag = { ...dragOf(event), x: event.clientX, y: event.clientY, from: { x: event.clientX, y: event.clientY }, isMoved: false };
  canvas.classList.add("turning");
});

canvas.addEventListener("pointermove", (event) => {
  if (!drag) return hover(event);
  if (!held.has(event.pointerId)) return;
  const before = held.size === 2 ? pinch() : null;
  held.set(event.pointerId, { x: event.clientX, y: event.clientY });
  const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
  if (dx === 0 && dy === 0 && !before) return;
  if (!drag.isMoved) remember();
  drag.isMoved = true;
  if (before) return pinched(before, pinch());
  if (held.size > 2) return;
  Object.assign(drag, { x: event.clientX, y: event.clientY });
  const box = canvas.getBoundingClientRect();
  if (drag.kind === "handle") dragHandle(drag.handle, dx, dy);
  else if (drag.kind === "window") dragWindow(event.clientX - drag.from.x, event.clientY - drag.from.y);
  else if (drag.kind === "pan") pan(dx, dy, box.height);
  else turn(dx, dy, Math.min(box.width, box.height));
  soon();
});

function dragWindow(dx, dy) {
  const [low, high] = dragged(drag.window, dx, dy);
  setWindow((low + high) / 2, high - low);
  drawCurve();
  note(`window ${short4(low)} to ${short4(high)}`);
}

// Two fingers zoom by their distance and pan by their middle.
function pinched(before, now) {
  zoom(before.apart / now.apart, fromMiddle(now));
  pan(now.x - before.x, now.y - before.y, canvas.getBoundingClientRect().height);
  soon();
}

for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, (event) => {
    held.delete(event.pointerId);
    const last = drag;
    const [rest] = held.values();
    // The finger that stays goes on from where it is.
    drag = rest ? { ...drag, ...rest } : null;
    canvas.classList.toggle("turning", Boolean(drag));
    if (name === "pointerup" && last && !last.isMoved && last.kind === "turn") clicked(event);
    if (!drag && last?.kind === "window") buildPanel();
  });
}

// A click chooses a point of a measure, or the voxel of the slices.
function clicked(event) {
  if (wanted.points) askProbe(event, "measure");
  else if (state.slices) askProbe(event, "slices");
}

canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  rememberSteps();
  zoom(Math.exp(Math.max(-200, Math.min(200, event.deltaY)) * 0.0015), fromMiddle({ x: event.clientX, y: event.clientY }));
  soon();
}, { passive: false });

canvas.addEventListener("dblclick", (event) => {
  if (!wanted.points) askProbe(event, "centre");
});

// One request for each frame of the screen is enough.
let isPlanned = false;
function soon() {
  if (isPlanned) return;
  isPlanned = true;
  requestAnimationFrame(() => {
    isPlanned = false;
    changed();
  });
}

function hover(event) {
  clearTimeout(probeTimer);
  probeTimer = setTimeout(() => askProbe(event), 120);
}

function askProbe(event, purpose = null) {
  if (!state.scene) return;
  const box = canvas.getBoundingClientRect();
  const size = fullSize();
  const at = [((event.clientX - box.left) / box.width) * size[0], ((event.clientY - box.top) / box.height) * size[1]];
  send({ type: "probe", at, purpose, ...view(size) });
}

function probeArrived(purpose, found) {
  if (purpose === "scale") return scaleFound(found);
  if (purpose === "measure") return picked(found);
  if (purpose === "slices") return found?.voxel && slicesAt(found.voxel);
  if (purpose === "centre" && found) {
    remember();
    centreOn(found.world);
    changed();
  }
  const line = document.getElementById("probe");
  const short = (x) => Number(x.toPrecision(5)).toString();
  const value = found?.voxel ? `${short(found.value)} at voxel ${found.voxel.join(", ")}; ` : "";
  line.textContent = found ? value + found.world.map(short).join(", ") : "";
}

// Pixels that a stroke of an arrow key turns or pans by.
const STROKE_PX = 20;

// Arrows turn and, with shift, pan; plus and minus zoom. While a measure is taken, arrows move its cross.
function strokes(event) {
  const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  const box = canvas.getBoundingClientRect();
  const zoomed = { "+": 0.9, "=": 0.9, "-": 1 / 0.9 }[event.key];
  if (!arrow && !zoomed) return false;
  if (arrow && wanted.points && !event.shiftKey) {
    event.preventDefault();
    moveCross(arrow);
    return false;
  }
  rememberSteps();
  if (zoomed) zoom(zoomed);
  else if (event.shiftKey) pan(...mul(arrow, STROKE_PX), box.height);
  else turn(...mul(arrow, STROKE_PX), Math.min(box.width, box.height));
  event.preventDefault();
  return true;
}

window.addEventListener("keydown", (event) => {
  if (!state.scene) return;
  // A slider has no text of its own; text fields and lists keep their keys.
  const types = event.target.matches("input:not([type=range]), textarea");
  const chooses = event.target.matches("select");
  if (event.key === "Escape" && !dialog.open) return cancel();
  const isRedo = event.key.toLowerCase() === "y" || (event.key.toLowerCase() === "z" && event.shiftKey);
  if ((isRedo || event.key === "z") && (event.ctrlKey || event.metaKey) && !types) {
    event.preventDefault();
    return isRedo ? redo() : undo();
  }
  if (types || chooses || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "Enter" && event.target === canvas && (wanted.points || state.slices)) {
    event.preventDefault();
    return clickCross();
  }
  const axis = { 1: [0, 1], 2: [0, -1], 3: [1, 1], 4: [1, -1], 5: [2, 1], 6: [2, -1] }[event.key];
  if (axis || event.key === "r") remember();
  if (axis) lookAlong(...axis);
  else if (event.key === "r") resetView();
  else if (event.target !== canvas || !strokes(event)) return;
  changed();
});

new ResizeObserver(() => changed()).observe(document.getElementById("stage"));
document.getElementById("toggle").addEventListener("click", () => document.body.classList.toggle("wide"));
