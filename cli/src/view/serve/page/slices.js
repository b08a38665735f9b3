// Three slices along the axes of the grid, beside the picture, and steps of a volume over time.

const strip = document.getElementById("slices");
const AXES = ["x", "y", "z"];
// Slices that were asked for and have not come, by axis; and whether a newer one is wanted.
const asked = [null, null, null];

// Windows of radiology, black and white, Hounsfield units.
const CT_WINDOWS = { brain: [0, 80], "soft tissue": [-160, 240], lung: [-1350, 150], bone: [-500, 1300] };

function toggleSlices() {
  remember();
  state.slices = state.slices ? null : { at: state.scene.volume.dims.map((n) => n >> 1), window: state.scene.volume.window };
  showSlices();
  changed({ panel: true, moving: false });
}

// The words of --with-slice: the three slices, and the plane that cuts the volume, where they stand in it.
function standingSlices() {
  const window = (state.slices?.window ?? state.scene.volume?.window ?? []).map(short4).join(",");
  const three = state.slices?.isStanding ? AXES.map((name, axis) => `${name}=${state.slices.at[axis]}:${window}`) : [];
  const plane = state.showsCut && option("clip-plane");
  return plane ? [...three, `${plane}:${window}`] : three;
}

// The volume is drawn again where slices stand in it.
function slicesChanged() {
  keepAddress();
  if (standingSlices().length) soon();
}

function showSlices() {
  const isOn = Boolean(state.slices && state.scene?.volume?.has_slices);
  strip.hidden = !isOn;
  if (!isOn) return strip.replaceChildren();
  const { dims, spacing, range, presets } = state.scene.volume;
  // Presets of CT are offered where values are Hounsfield units.
  const usual = presets.some(({ name }) => name === "ct") ? Object.entries(CT_WINDOWS) : [];
  const end = (i, name) => make("input", {
    type: "number", step: "any", value: short4(state.slices.window[i]), ariaLabel: `${name} end of the window`,
    onchange: (event) => setSliceWindow(state.slices.window.with(i, Number(event.target.value))),
  });
  const figures = AXES.map((name, axis) => {
    const sides = SIDES[axis];
    const plot = make("canvas", { id: `slice-${axis}`, title: "Click to choose a voxel; drag with the right button to change the window" });
    plot.style.aspectRatio = `${dims[sides[0]] * spacing[sides[0]]} / ${dims[sides[1]] * spacing[sides[1]]}`;
    watchSlice(plot, axis, sides);
    const input = make("input", { type: "range", min: 0, max: dims[axis] - 1, step: 1, value: state.slices.at[axis], ariaLabel: `slice along ${name}` });
    input.addEventListener("input", () => setSlice(axis, Number(input.value)));
    return make("div", {}, plot, make("div", { className: "row" }, make("output", { id: `at-${axis}` }), input));
  });
  const standing = make("input", { id: "standing", type: "checkbox", checked: Boolean(state.slices.isStanding), onchange: () => {
    remember();
    state.slices.isStanding = standing.checked;
    changed();
  } });
  strip.replaceChildren(...figures, make("div", { className: "row" }, make("span", {}, "window"), end(0, "low"), end(1, "high")),
    make("div", { className: "row" }, make("label", { htmlFor: "standing" }, "in the volume, too"), standing),
    make("div", { className: "buttons" },
      button("cut here", cutAtSlice, { title: "Cuts the volume at the slice along z" }),
      button("whole range", () => setSliceWindow(range)),
      ...usual.map(([name, window]) => button(name, () => setSliceWindow(window), { title: `Slices from ${window[0]} to ${window[1]}` }))));
  askSlices([0, 1, 2]);
}

function setSlice(axis, index) {
  rememberSteps();
  state.slices.at = state.slices.at.with(axis, index);
  askSlices([axis]);
  drawMarks();
  slicesChanged();
}

function setSliceWindow([low, high]) {
  if (!(low < high)) return;
  rememberSteps();
  state.slices.window = [low, high];
  const inputs = strip.querySelectorAll("input[type=number]");
  [low, high].forEach((value, i) => (inputs[i].value = short4(value)));
  askSlices([0, 1, 2]);
  slicesChanged();
}

// All three go through a voxel of the grid.
function slicesAt(voxel) {
  remember();
  state.slices.at = voxel;
  showSlices();
  drawMarks();
  slicesChanged();
}

function askSlices(list) {
  if (!state.slices) return;
  for (const axis of list) {
    if (asked[axis]) asked[axis] = "again";
    else {
      asked[axis] = "once";
      send({ type: "slice", axis, index: state.slices.at[axis], window: state.slices.window });
    }
    const line = document.getElementById(`at-${axis}`);
    if (line) line.textContent = `${AXES[axis]} ${state.slices.at[axis]}`;
    const input = strip.querySelectorAll("input[type=range]")[axis];
    if (input) input.value = state.slices.at[axis];
  }
  drawCrosses();
}

async function sliceArrived(axis, blob) {
  const isOld = asked[axis] === "again";
  asked[axis] = null;
  const plot = document.getElementById(`slice-${axis}`);
  if (!plot) return;
  plot.bitmap = await createImageBitmap(blob);
  plot.dataset.index = state.slices?.at[axis];
  drawCrosses();
  if (isOld) askSlices([axis]);
}

// The axes of the grid to the right and down in the slice across an axis.
const SIDES = [[1, 2], [0, 2], [0, 1]];

// The letter of the patient's side that a direction points to; null where the file names none.
function sideOf(direction) {
  const letters = patientSides();
  if (!letters) return null;
  const sizes = direction.map(Math.abs);
  const axis = sizes.indexOf(Math.max(...sizes));
  const opposite = { L: "R", R: "L", A: "P", P: "A", S: "I", I: "S" };
  return direction[axis] > 0 ? letters[axis] : opposite[letters[axis]];
}

// Whether a slice is shown mirrored, to the right and down: the patient's left is on the right and the front on the left or on top, as in
// radiology; elsewhere up is where the first view has it.
function mirrored(axis) {
  const [across, down] = SIDES[axis].map((side) => unit(state.scene.volume.axes[side]));
  // The server has z go up, and y down.
  const below = axis === 2 ? down : mul(down, -1);
  const up = dot(state.start.up, below);
  if (!patientSides()) return [false, up > 0.5];
  return [["R", "A"].includes(sideOf(across)), ["A", "S"].includes(sideOf(below))];
}

// The place of a voxel in a slice, 0 to 1 from the left and from the top.
function inSlice(axis, at) {
  const { dims } = state.scene.volume;
  const [across, down] = SIDES[axis];
  const [isLeft, isUp] = mirrored(axis);
  const x = (at[across] + 0.5) / dims[across];
  const row_ = axis === 2 ? at[down] : dims[down] - 1 - at[down];
  const y = (row_ + 0.5) / dims[down];
  return [isLeft ? 1 - x : x, isUp ? 1 - y : y];
}

// The slices with lines where the others lie.
function drawCrosses() {
  for (const axis of [0, 1, 2]) {
    const plot = document.getElementById(`slice-${axis}`);
    if (!plot?.bitmap || !state.slices) continue;
    const box = plot.getBoundingClientRect();
    const ratio = window.devicePixelRatio || 1;
    [plot.width, plot.height] = [box.width * ratio, box.height * ratio];
    const context = plot.getContext("2d");
    context.imageSmoothingEnabled = false;
    const [isLeft, isUp] = mirrored(axis);
    context.save();
    context.translate(isLeft ? plot.width : 0, isUp ? plot.height : 0);
    context.scale(isLeft ? -1 : 1, isUp ? -1 : 1);
    context.drawImage(plot.bitmap, 0, 0, plot.width, plot.height);
    context.restore();
    const [across, down] = SIDES[axis];
    const [x, y] = inSlice(axis, state.slices.at).map((share, k) => share * [plot.width, plot.height][k]);
    const colours = ["#ff6b6b", "#7bd88f", "#6ab0ff"];
    for (const [colour, ends] of [[colours[across], [x, 0, x, plot.height]], [colours[down], [0, y, plot.width, y]]]) {
      context.strokeStyle = colour;
      context.globalAlpha = 0.7;
      context.beginPath();
      context.moveTo(ends[0], ends[1]);
      context.lineTo(ends[2], ends[3]);
      context.stroke();
    }
    context.globalAlpha = 1;
    drawSides(context, axis, ratio);
  }
}

// Letters of the patient's sides on the left and on top.
function drawSides(context, axis, ratio) {
  if (!patientSides()) return;
  const [across, down] = SIDES[axis].map((side) => unit(state.scene.volume.axes[side]));
  const [isLeft, isUp] = mirrored(axis);
  const below = axis === 2 ? down : mul(down, -1);
  const { width, height } = context.canvas;
  context.font = `${12 * ratio}px system-ui, sans-serif`;
  context.fillStyle = "#ffd54a";
  context.textBaseline = "middle";
  context.textAlign = "left";
  context.fillText(sideOf(mul(across, isLeft ? 1 : -1)), 4 * ratio, height / 2);
  context.textBaseline = "top";
  context.textAlign = "center";
  context.fillText(sideOf(mul(below, isUp ? 1 : -1)), width / 2, 4 * ratio);
}

function watchSlice(plot, axis, [across, down]) {
  let held_ = null;
  const choose = (event) => {
    const box = plot.getBoundingClientRect();
    const { dims } = state.scene.volume;
    const [isLeft, isUp] = mirrored(axis);
    const index = (share, n, isTurned) => Math.min(n - 1, Math.max(0, Math.floor((isTurned ? 1 - share : share) * n)));
    const x = index((event.clientX - box.left) / box.width, dims[across], isLeft);
    const y = index((event.clientY - box.top) / box.height, dims[down], isUp);
    rememberSteps();
    state.slices.at = state.slices.at.with(across, x).with(down, axis === 2 ? y : dims[down] - 1 - y);
    askSlices([across, down]);
    drawMarks();
    slicesChanged();
  };
  plot.addEventListener("contextmenu", (event) => event.preventDefault());
  plot.addEventListener("pointerdown", (event) => {
    plot.setPointerCapture(event.pointerId);
    held_ = { x: event.clientX, y: event.clientY, window: state.slices.window, isWindow: event.button === 2 };
    if (!held_.isWindow) choose(event);
  });
  plot.addEventListener("pointermove", (event) => {
    if (!held_) return;
    if (!held_.isWindow) return choose(event);
    setSliceWindow(dragged(held_.window, event.clientX - held_.x, event.clientY - held_.y));
  });
  for (const name of ["pointerup", "pointercancel"]) plot.addEventListener(name, () => (held_ = null));
  plot.addEventListener("wheel", (event) => {
    event.preventDefault();
    const at = state.slices.at[axis] + Math.sign(event.deltaY);
    setSlice(axis, Math.min(state.scene.volume.dims[axis] - 1, Math.max(0, at)));
  }, { passive: false });
}

// A window after a drag: to the right it widens, upwards its middle falls, as in radiology.
function dragged([low, high], dx, dy) {
  const [least, most] = state.scene.volume.range;
  const level = (low + high) / 2 + (dy * (most - least)) / 500;
  const width = (high - low) * Math.exp(dx / 150);
  return [level - width / 2, level + width / 2];
}

// The place of a voxel in the world.
function inWorld(voxel) {
  const { origin, axes: columns } = state.scene.volume;
  return voxel.reduce((place_, index, axis) => add(place_, mul(columns[axis], index)), origin);
}

// A plane along z through the chosen voxel: what lies on the side of the eye is cut away.
function cutAtSlice() {
  remember();
  const { forward } = axes(state.camera);
  const column = unit(state.scene.volume.axes[2]);
  const normal = dot(column, forward) >= 0 ? column : mul(column, -1);
  const at = dot(inWorld(state.slices.at), normal);
  setOption("clip-plane", [...normal, at].map((x) => Number(x.toPrecision(7))).join(","));
  changed({ panel: true });
}

// Where the three slices meet, in the picture.
function drawMeeting(context) {
  if (!state.slices || !state.scene.volume?.has_slices) return;
  const at = onScreen(inWorld(state.slices.at));
  if (!at) return;
  for (const [colour, width] of [["#000a", 3.5], ["#fff", 1.2]]) {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    for (const [x, y] of [[-9, 0], [0, -9]]) {
      context.moveTo(at[0] + x, at[1] + y);
      context.lineTo(at[0] + x / 3, at[1] + y / 3);
      context.moveTo(at[0] - x / 3, at[1] - y / 3);
      context.lineTo(at[0] - x, at[1] - y);
    }
    context.stroke();
  }
}

// Steps of a volume over time.
let playing = false;

function stepRows() {
  const { steps } = state.scene.volume;
  if (steps.length < 2) return [];
  const name = make("p", { className: "note", id: "step-name" }, steps[state.step]);
  const shown = slider("step", { min: 0, max: steps.length - 1, step: 1, value: state.step, text: (x) => `${x + 1} of ${steps.length}`, act: setStep });
  return [make("h2", {}, "Time"), shown, name, make("div", { className: "buttons" }, button(playing ? "pause" : "play", playSteps, { id: "play-steps" }))];
}

function setStep(at) {
  state.step = at;
  const name = document.getElementById("step-name");
  if (name) name.textContent = state.scene.volume.steps[at];
}

function playSteps() {
  playing = !playing;
  buildPanel();
  if (playing) nextStep();
}

// Least time of a step, ms: about that of a film for slow motion.
const STEP_MS = 80;

// The next step, once the one before is on the screen.
function nextStep() {
  if (!playing) return;
  // Those of the step that is drawn now.
  askSlices([0, 1, 2]);
  setStep((state.step + 1) % state.scene.volume.steps.length);
  const input = document.getElementById("field-step");
  if (input) {
    input.value = state.step;
    input.parentElement.querySelector("output").textContent = `${state.step + 1} of ${state.scene.volume.steps.length}`;
  }
  changed();
}
