// The transfer function: a histogram with opacity points to drag, and colours.

// Counts are drawn on a logarithmic scale.
function bars() {
  const counts = state.scene.volume.bars;
  const most = Math.log1p(Math.max(...counts));
  return counts.map((count) => Math.log1p(count) / (most || 1));
}

// A preset, a colour map or a window has made another function.
function functionArrived(known) {
  state.scene.volume.function = known;
  if (known && !state.curve) buildPanel();
}

// What is drawn: the edited function, or the one of the options.
function curve() {
  return state.curve ?? state.scene.volume.function;
}

function chosenPreset() {
  return state.scene.volume?.presets.find(({ name }) => name === state.changes.preset?.[0]);
}

// The light or the blending that goes with the look where nobody chose another.
function suggested(name) {
  if (state.curve) return null;
  return (chosenPreset() ?? state.scene.volume)?.suggested[name] ?? null;
}

// Makes the function the page's own, so that it can be edited.
function ownCurve() {
  remember();
  const { opacities, colours } = structuredClone(curve());
  // What went with the look stays when the look becomes the page's own.
  for (const name of option("iso") === null ? ["shade", "blend"] : []) {
    if (option(name) === null && suggested(name)) setOption(name, suggested(name));
  }
  state.curve = { opacities: spread(opacities), colours };
  // Only one of them says how values become colours.
  for (const name of ["preset", "window", "colormap"]) setOption(name);
  return state.curve;
}

// Opacities with the ends of the value range among them.
function spread(opacities) {
  const [low, high] = state.scene.volume.range;
  const list = opacities.map((knot) => [...knot]);
  if (list[0][0] > low) list.unshift([low, list[0][1]]);
  if (list.at(-1)[0] < high) list.push([high, list.at(-1)[1]]);
  return list;
}

const place = {
  x: (value) => (value - state.scene.volume.range[0]) / (state.scene.volume.range[1] - state.scene.volume.range[0] || 1),
  value: (x) => state.scene.volume.range[0] + x * (state.scene.volume.range[1] - state.scene.volume.range[0]),
  // Small opacities matter most: their square root is drawn.
  y: (opacity) => Math.sqrt(opacity),
  opacity: (y) => Math.min(1, Math.max(0, y)) ** 2,
};

function colourAt(value) {
  const list = curve().colours;
  const above = list.findIndex((knot) => knot[0] > value);
  if (above === 0) return list[0].slice(1);
  if (above < 0) return list.at(-1).slice(1);
  const [low, high] = [list[above - 1], list[above]];
  const share = (value - low[0]) / (high[0] - low[0] || 1);
  return [1, 2, 3].map((i) => low[i] + share * (high[i] - low[i]));
}

const css = (rgb) => `rgb(${rgb.map((x) => Math.round(255 * Math.min(1, Math.max(0, x)))).join(" ")})`;

function drawCurve() {
  const plot = document.getElementById("curve");
  if (!plot) return;
  const ratio = window.devicePixelRatio || 1;
  const box = plot.getBoundingClientRect();
  const [width, height] = [box.width, box.height];
  [plot.width, plot.height] = [width * ratio, height * ratio];
  const context = plot.getContext("2d");
  context.scale(ratio, ratio);
  const heights = bars();
  heights.forEach((bar, i) => {
    context.fillStyle = css(colourAt(place.value((i + 0.5) / heights.length)));
    context.globalAlpha = 0.55;
    context.fillRect((i * width) / heights.length, height * (1 - bar), width / heights.length + 0.5, height * bar);
  });
  context.globalAlpha = 1;
  const ink = getComputedStyle(plot).color;
  context.strokeStyle = context.fillStyle = ink;
  context.lineWidth = 1.5;
  context.beginPath();
  const knots = spread(curve().opacities);
  for (const [value, opacity] of knots) context.lineTo(place.x(value) * width, height * (1 - place.y(opacity)));
  context.stroke();
  // Points that can be told from one another.
  if (knots.length <= 64) {
    for (const [value, opacity] of knots) {
      context.beginPath();
      context.arc(place.x(value) * width, height * (1 - place.y(opacity)), 4, 0, 7);
      context.fill();
    }
  }
  drawBar(document.getElementById("bar"), (x) => colourAt(place.value(x)));
}

// Colours along a canvas; `at` gives the display colour of a place from 0 to 1.
function drawBar(bar, at) {
  bar.width = 128;
  bar.height = 1;
  const context = bar.getContext("2d");
  for (let x = 0; x < bar.width; x++) {
    context.fillStyle = css(at((x + 0.5) / bar.width));
    context.fillRect(x, 0, 1, 1);
  }
}

// Dragging a point moves it, a click elsewhere adds one, a double click removes one; with shift the whole curve is moved.
function watchCurve(plot) {
  let held = null;
  const pointed = (event) => {
    const box = plot.getBoundingClientRect();
    return { x: (event.clientX - box.left) / box.width, y: 1 - (event.clientY - box.top) / box.height, box };
  };
  const nearest = ({ x, y, box }) => {
    const distance = ([value, opacity]) => Math.hypot((place.x(value) - x) * box.width, (place.y(opacity) - y) * box.height);
    const list = state.curve.opacities.map(distance);
    const best = list.indexOf(Math.min(...list));
    return list[best] < 10 ? best : -1;
  };
  plot.addEventListener("pointerdown", (event) => {
    plot.setPointerCapture(event.pointerId);
    const knots = ownCurve().opacities;
    const at = pointed(event);
    if (event.shiftKey) {
      held = { from: at.x, all: knots.map((knot) => [...knot]), colours: state.curve.colours.map((knot) => [...knot]) };
      return;
    }
    let index = nearest(at);
    if (index < 0) {
      index = knots.filter((knot) => knot[0] <= place.value(at.x)).length;
      knots.splice(index, 0, [place.value(at.x), place.opacity(at.y)]);
    }
    held = { index };
    changed();
    drawCurve();
  });
  plot.addEventListener("pointermove", (event) => {
    if (!held) return;
    const at = pointed(event);
    if (held.all) moveAll(held, at.x);
    else movePoint(held.index, at);
    drawCurve();
    soon();
  });
  plot.addEventListener("pointerup", () => (held = null));
  plot.addEventListener("dblclick", (event) => {
    const index = nearest(pointed(event));
    if (index >= 0 && state.curve.opacities.length > 2) state.curve.opacities.splice(index, 1);
    drawCurve();
    changed();
  });
}

function movePoint(index, { x, y }) {
  const knots = state.curve.opacities;
  const [low, high] = state.scene.volume.range;
  const least = index > 0 ? knots[index - 1][0] : low;
  const most = index < knots.length - 1 ? knots[index + 1][0] : high;
  knots[index] = [Math.min(most, Math.max(least, place.value(x))), place.opacity(y)];
}

function moveAll(held, x) {
  const shift = place.value(x) - place.value(held.from);
  const moved = (list) => list.map((knot) => [knot[0] + shift, ...knot.slice(1)]);
  state.curve.opacities = moved(held.all);
  state.curve.colours = moved(held.colours);
}

// Stretches colours and opacities to a window of values.
function setWindow(level, width) {
  const { opacities, colours } = ownCurve();
  const all = [...opacities, ...colours].map((knot) => knot[0]);
  const [first, last] = [Math.min(...all), Math.max(...all)];
  const moved = (value) => level + ((value - first) / (last - first || 1) - 0.5) * width;
  state.curve.opacities = opacities.map(([value, opacity]) => [moved(value), opacity]);
  state.curve.colours = colours.map(([value, ...rgb]) => [moved(value), ...rgb]);
}

// Lays a named map over the range of the present colours.
function setMap(name) {
  const list = ownCurve().colours;
  const [first, last] = [list[0][0], list.at(-1)[0]];
  const stops = state.scene.volume.maps[name];
  state.curve.colours = stops.map((rgb, i) => [first + ((last - first) * i) / (stops.length - 1), ...rgb]);
}

// Reads a file of ParaView that was dropped on the page.
async function dropped(file) {
  const parsed = JSON.parse(await file.text());
  const map = Array.isArray(parsed) ? parsed[0] : parsed;
  if (!Array.isArray(map.RGBPoints) && !Array.isArray(map.Points)) throw new Error("no RGBPoints and no Points");
  const own = ownCurve();
  const fours = (list) => Array.from({ length: list.length / 4 }, (_, i) => list.slice(4 * i, 4 * i + 4));
  if (map.RGBPoints) own.colours = fours(map.RGBPoints);
  if (map.Points) own.opacities = fours(map.Points).map(([value, opacity]) => [value, opacity]);
}
