// What lies over the picture and can be taken hold of: measures, and the handles of the crop box.

// Distance within which a handle is taken, px.
const HANDLE_PX = 10;

// The place of a point of the world in the picture, px from its corner; null behind the eye.
function onScreen(point) {
  const box = canvas.getBoundingClientRect();
  const { right, up, forward } = axes(state.camera);
  const away = sub(point, state.camera.position);
  const depth = dot(away, forward);
  const isFlat = state.camera.projection === "orthographic";
  if (!isFlat && depth <= 0) return null;
  const high = isFlat ? state.camera.height : 2 * depth * Math.tan((state.camera.fov_y * Math.PI) / 360);
  const scale = box.height / high;
  return [box.width / 2 + scale * dot(away, right), box.height / 2 - scale * dot(away, up)];
}

// Measures: two points have a distance, three the angle at the middle one.
const wanted = { points: 0, picked: [] };

function measure(points) {
  Object.assign(wanted, { points: wanted.points === points ? 0 : points, picked: [] });
  if (wanted.points) note(`click ${wanted.points} points on the picture, or move the cross by arrows and press Enter`);
  crossPlace = null;
  buildPanel();
  canvas.focus();
  drawMarks();
}

// Where Enter clicks, px from the corner of the picture: arrows move it while a measure is taken. Null is the middle.
let crossPlace = null;
// Way of the cross at each stroke of an arrow, px.
const CROSS_PX = 4;

function crossAt() {
  const box = canvas.getBoundingClientRect();
  return crossPlace ?? [box.width / 2, box.height / 2];
}

function moveCross(arrow) {
  const box = canvas.getBoundingClientRect();
  const [x, y] = add(crossAt(), mul(arrow, CROSS_PX));
  crossPlace = [Math.min(box.width - 1, Math.max(0, x)), Math.min(box.height - 1, Math.max(0, y))];
  drawMarks();
}

function clickCross() {
  const box = canvas.getBoundingClientRect();
  const [x, y] = crossAt();
  clicked({ clientX: box.left + x, clientY: box.top + y });
}

function picked(found) {
  if (!found) return note("there is nothing to measure at this place");
  wanted.picked.push(found.world);
  if (wanted.picked.length === wanted.points) {
    remember();
    state.measures = [...state.measures, wanted.picked];
    Object.assign(wanted, { points: 0, picked: [] });
    note(measured(state.measures.at(-1)));
    keepAddress();
    buildPanel();
  }
  drawMarks();
}

function measured(points) {
  if (points.length === 2) return `${short4(length(sub(points[1], points[0])))} ${state.scene.unit ?? "units"}`;
  const [a, b] = [unit(sub(points[0], points[1])), unit(sub(points[2], points[1]))];
  return `${((Math.acos(Math.min(1, Math.max(-1, dot(a, b)))) * 180) / Math.PI).toFixed(1)}\u00b0`;
}

const short4 = (x) => Number(x.toPrecision(4)).toString();

function measureRows() {
  const rows = state.measures.map((points, i) => make("li", {}, measured(points),
    button("\u00d7", () => { remember(); state.measures = state.measures.filter((_, j) => j !== i); changed({ panel: true, moving: false }); },
      { title: "Remove", ariaLabel: `remove measure ${i + 1}` })));
  const mode = (points, text) => button(text, () => measure(points), { ariaPressed: String(wanted.points === points), className: wanted.points === points ? "chosen" : "" });
  return [make("ol", {}, ...rows), make("div", { className: "buttons" }, mode(2, "distance"), mode(3, "angle"))];
}

function drawMeasures(context) {
  if (wanted.points && document.activeElement === canvas) {
    const [x, y] = crossAt();
    for (const [colour, width] of [["#000a", 3], ["#fff", 1]]) {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.beginPath();
      for (const [dx, dy] of [[9, 0], [0, 9]]) {
        context.moveTo(x - dx, y - dy);
        context.lineTo(x + dx, y + dy);
      }
      context.stroke();
    }
  }
  const pending = wanted.picked.length ? [wanted.picked] : [];
  for (const points of [...state.measures, ...pending]) {
    const places = points.map(onScreen);
    if (places.some((place_) => !place_)) continue;
    for (const [colour, width] of [["#000a", 4], ["#ffd54a", 1.5]]) {
      context.strokeStyle = context.fillStyle = colour;
      context.lineWidth = width;
      context.beginPath();
      for (const place_ of places) context.lineTo(...place_);
      context.stroke();
    }
    for (const [x, y] of places) context.fillRect(x - 2.5, y - 2.5, 5, 5);
    if (points === wanted.picked) continue;
    const [x, y] = points.length === 3 ? places[1] : mul(add(places[0], places[1]), 0.5);
    label(context, measured(points), x + 8, y - 8);
  }
}

// Text that is read on any ground.
function label(context, text, x, y) {
  context.textAlign = "left";
  context.textBaseline = "alphabetic";
  const width = context.measureText(text).width;
  context.fillStyle = "#000b";
  context.fillRect(x - 3, y - 12, width + 6, 16);
  context.fillStyle = "#ffd54a";
  context.fillText(text, x, y);
}

// The crop box: least and greatest corner in the world.
function cropBox() {
  const [low, high] = state.scene.volume.corners;
  const typed = option("crop")?.split(",").map(Number);
  return typed?.length === 6 ? typed : [...low, ...high];
}

function setCrop(box) {
  const [low, high] = state.scene.volume.corners;
  const isWhole = box.every((side, j) => (j < 3 ? side <= low[j] : side >= high[j - 3]));
  const isBox = [0, 1, 2].every((j) => box[j] < box[j + 3]);
  if (isWhole) setOption("crop");
  else if (isBox) setOption("crop", box.map((side) => Number(side.toPrecision(6))).join(","));
}

let showsCrop = false;

// The middle of each side of the crop box: x from, y from, z from, x to, y to, z to.
function handles() {
  if (!showsCrop || !state.scene?.volume) return [];
  const box = cropBox();
  const middle = [0, 1, 2].map((j) => (box[j] + box[j + 3]) / 2);
  return box.map((side, i) => ({ side: i, world: middle.with(i % 3, side) }));
}

// Takes the handle under the pointer, if there is one.
function handleAt(x, y) {
  const near = handles().map((handle) => ({ ...handle, at: onScreen(handle.world) }))
    .filter(({ at }) => at && Math.hypot(at[0] - x, at[1] - y) < HANDLE_PX);
  return near[0] ?? null;
}

// Moves a side of the crop box along its axis, by a motion of the pointer.
function dragHandle(handle, dx, dy) {
  const axis = handle.side % 3;
  const box = cropBox();
  const [low, high] = state.scene.volume.corners;
  const reach = (high[axis] - low[axis]) / 100;
  const [from, to] = [onScreen(handle.world), onScreen(handle.world.with(axis, handle.world[axis] + reach))];
  if (!from || !to) return;
  const along = sub(to, from);
  const shift = (reach * (dx * along[0] + dy * along[1])) / Math.max(dot(along, along), 1e-6);
  box[handle.side] = Math.min(high[axis], Math.max(low[axis], box[handle.side] + shift));
  setCrop(box);
  handle.world = handle.world.with(axis, box[handle.side]);
}

function drawHandles(context) {
  const all = handles();
  if (!all.length) return;
  const box = cropBox();
  const corner = (i) => [0, 1, 2].map((axis) => box[(i >> axis) & 1 ? axis + 3 : axis]);
  context.strokeStyle = "#fffb";
  context.lineWidth = 1;
  for (let i = 0; i < 8; i++) {
    for (const bit of [1, 2, 4].filter((bit) => !(i & bit))) {
      const [from, to] = [onScreen(corner(i)), onScreen(corner(i | bit))];
      if (!from || !to) continue;
      context.beginPath();
      context.moveTo(...from);
      context.lineTo(...to);
      context.stroke();
    }
  }
  for (const { side, world } of all) {
    const at = onScreen(world);
    if (!at) continue;
    context.fillStyle = ["#ff6b6b", "#7bd88f", "#6ab0ff"][side % 3];
    context.beginPath();
    context.arc(...at, 6, 0, 7);
    context.fill();
    context.stroke();
  }
}
