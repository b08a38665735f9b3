// The picture, the marks over it, and what the pointer does.

const canvas = document.getElementById("picture");
const marks = document.getElementById("marks");
const statusLine = document.getElementById("status");

// Time without motion after which the picture is drawn to the end, ms.
const REST_MS = 150;
// Most pixels of a picture at rest.
const MAX_PIXELS = 2e6;

let restTimer = 0;
const frames = []; // times at which moving frames were shown, ms
const times = {};  // time of a resting picture by exactness, ms
let lastBlob = null;

function say(text, isBad = false) {
  statusLine.textContent = text;
  statusLine.classList.toggle("bad", isBad);
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
  if (moving) {
    send({ type: "draw", id: nextId++, motion: "moving", ...view(size) });
    restTimer = setTimeout(() => changed({ moving: false }), REST_MS);
  } else {
    send({ type: "draw", id: nextId++, motion: "resting", ...view(size) });
    askThumbnails();
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
    }
    say(`${head.width} x ${head.height}, ${head.draw_ms.toFixed(0)} ms${head.is_last ? "" : ", refining..."}`);
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
  for (const arrow of arrows) {
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
  scaleBar(context, box);
}

function scaleBar(context, box) {
  const perPixel = heightAtTarget(state.camera) / box.height;
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
  context.fillText(Number(world.toPrecision(2)).toString(), x + width / 2, y - 4);
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

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  drag = { x: event.clientX, y: event.clientY, pans: event.shiftKey || event.button === 1 };
  canvas.classList.add("turning");
});

canvas.addEventListener("pointermove", (event) => {
  if (!drag) return hover(event);
  const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
  if (dx === 0 && dy === 0) return;
  Object.assign(drag, { x: event.clientX, y: event.clientY });
  const box = canvas.getBoundingClientRect();
  if (drag.pans) pan(dx, dy, box.height);
  else turn(dx, dy, Math.min(box.width, box.height));
  soon();
});

for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, () => {
    drag = null;
    canvas.classList.remove("turning");
  });
}

canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(Math.max(-200, Math.min(200, event.deltaY)) * 0.0015));
  soon();
}, { passive: false });

canvas.addEventListener("dblclick", (event) => {
  waiting.centre = true;
  askProbe(event);
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

function askProbe(event) {
  if (!state.scene) return;
  const box = canvas.getBoundingClientRect();
  const size = fullSize();
  const at = [((event.clientX - box.left) / box.width) * size[0], ((event.clientY - box.top) / box.height) * size[1]];
  send({ type: "probe", at, ...view(size) });
}

function probed(found) {
  const line = document.getElementById("probe");
  if (waiting.centre && found) {
    centreOn(found.world);
    changed();
  }
  waiting.centre = false;
  const short = (x) => Number(x.toPrecision(5)).toString();
  const value = found?.voxel ? `${short(found.value)} at voxel ${found.voxel.join(", ")}; ` : "";
  line.textContent = found ? value + found.world.map(short).join(", ") : "";
}

window.addEventListener("keydown", (event) => {
  if (event.target.matches("input, select, textarea") || !state.scene) return;
  const axis = { 1: [0, 1], 2: [0, -1], 3: [1, 1], 4: [1, -1], 5: [2, 1], 6: [2, -1] }[event.key];
  if (axis) lookAlong(...axis);
  else if (event.key === "r") state.camera = { ...state.start };
  else if (event.key === "z" && (event.ctrlKey || event.metaKey)) return undo();
  else return;
  changed();
});

new ResizeObserver(() => changed()).observe(document.getElementById("stage"));
document.getElementById("toggle").addEventListener("click", () => document.body.classList.toggle("wide"));
