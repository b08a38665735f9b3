// The transfer function: a histogram with opacity points to drag, and colours.

// Counts, 0 to 1 of the greatest, on a logarithmic scale or not.
function bars() {
  const height = state.plot.isLog ? Math.log1p : (count) => count;
  const counts = state.scene.volume.bars;
  const most = height(Math.max(...counts));
  return counts.map((count) => height(count) / (most || 1));
}

// The values that the plot shows.
const plotRange = () => state.plot.range ?? state.scene.volume.range;

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
  const { opacities, colours } = structuredClone(curve());
  // What went with the look stays when the look becomes the page's own.
  for (const name of option("iso") === null ? ["shade", "blend"] : []) {
    if (option(name) === null && suggested(name)) setOption(name, suggested(name));
  }
  state.curve = { opacities, colours };
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
  x: (value) => (value - plotRange()[0]) / (plotRange()[1] - plotRange()[0] || 1),
  value: (x) => plotRange()[0] + x * (plotRange()[1] - plotRange()[0]),
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
  const [least, most] = state.scene.volume.range;
  const value = (i) => least + ((most - least) * i) / heights.length;
  heights.forEach((bar, i) => {
    context.fillStyle = css(colourAt(value(i + 0.5)));
    context.globalAlpha = 0.55;
    const [from, to] = [value(i), value(i + 1)].map((end) => place.x(end) * width);
    context.fillRect(from, height * (1 - bar), to - from + 0.5, height * bar);
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
    knots.forEach(([value, opacity], i) => {
      context.fillStyle = state.curve && i === state.point ? css(colourAt(value)) : ink;
      context.beginPath();
      context.arc(place.x(value) * width, height * (1 - place.y(opacity)), state.curve && i === state.point ? 6 : 4, 0, 7);
      context.fill();
      context.stroke();
    });
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
    remember();
    const own = ownCurve();
    own.opacities = spread(own.opacities);
    const knots = own.opacities;
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
    state.point = index;
    changed();
    drawCurve();
    showPoint();
  });
  plot.addEventListener("pointermove", (event) => {
    if (!held) return;
    const at = pointed(event);
    if (held.all) moveAll(held, at.x);
    else movePoint(held.index, at);
    drawCurve();
    showPoint();
    soon();
  });
  plot.addEventListener("pointerup", () => (held = null));
  plot.addEventListener("dblclick", (event) => {
    const index = nearest(pointed(event));
    if (index >= 0) removePoint(index);
  });
  plot.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomPlot(place.value(pointed(event).x), Math.exp(event.deltaY * 0.002));
  }, { passive: false });
}

function movePoint(index, { x, y }) {
  const knots = state.curve.opacities;
  const [low, high] = state.scene.volume.range;
  const least = index > 0 ? knots[index - 1][0] : low;
  const most = index < knots.length - 1 ? knots[index + 1][0] : high;
  setPoint(index, Math.min(most, Math.max(least, place.value(x))), place.opacity(y));
}

// The colour at a point goes with it.
function setPoint(index, value, opacity) {
  const [before] = state.curve.opacities[index];
  state.curve.opacities[index] = [value, opacity];
  const colours = state.curve.colours;
  const own = colours.find((knot) => knot[0] === before);
  if (own && colours.length > 2) {
    own[0] = value;
    colours.sort((a, b) => a[0] - b[0]);
  }
}

function colourPoint(index, rgb) {
  const [value] = state.curve.opacities[index];
  const own = state.curve.colours.find((knot) => knot[0] === value);
  if (own) own.splice(1, 3, ...rgb);
  else state.curve.colours.push([value, ...rgb]);
  state.curve.colours.sort((a, b) => a[0] - b[0]);
}

function removePoint(index) {
  if (state.curve.opacities.length > 2) state.curve.opacities.splice(index, 1);
  state.point = Math.max(0, index - 1);
  drawCurve();
  showPoint();
  changed();
}

// The values between which the plot is drawn, around one of them.
function zoomPlot(value, factor) {
  const [least, most] = state.scene.volume.range;
  const [low, high] = plotRange().map((end) => value + (end - value) * factor);
  const isWhole = high - low >= most - least;
  state.plot.range = isWhole ? null : [Math.max(least, low), Math.min(most, high)];
  drawCurve();
}

// The point that is edited: its place in the list, value, opacity and colour, as numbers.
function showPoint() {
  const box = document.getElementById("point");
  if (!box) return;
  const knots = spread(curve().opacities);
  const index = Math.min(state.point, knots.length - 1);
  const [value, opacity] = knots[index];
  // A number that is typed makes the function the page's own.
  const edit = (change) => {
    remember();
    const own = ownCurve();
    own.opacities = spread(own.opacities);
    change(own.opacities);
    drawCurve();
    showPoint();
    changed();
  };
  const number = (name, now, least, most, act) => make("input", {
    type: "number", step: "any", value: short4(now), ariaLabel: `${name} of the point`,
    onchange: (event) => edit(() => act(Math.min(most, Math.max(least, Number(event.target.value))))),
  });
  const [least, most] = [knots[index - 1]?.[0] ?? state.scene.volume.range[0], knots[index + 1]?.[0] ?? state.scene.volume.range[1]];
  const list = make("select", { ariaLabel: "point", onchange: () => { state.point = list.selectedIndex; drawCurve(); showPoint(); } },
    ...knots.map((_, i) => make("option", {}, `point ${i + 1} of ${knots.length}`)));
  list.selectedIndex = index;
  const colour = make("input", { type: "color", value: hex(colourAt(value)), ariaLabel: "colour of the point" });
  colour.addEventListener("change", () => edit(() => colourPoint(index, [1, 3, 5].map((i) => parseInt(colour.value.slice(i, i + 2), 16) / 255))));
  const middle = (value + (knots[index + 1]?.[0] ?? state.scene.volume.range[1])) / 2;
  box.replaceChildren(
    make("div", { className: "row" }, list, colour),
    make("div", { className: "row" }, number("value", value, least, most, (x) => setPoint(index, x, opacity)),
      number("opacity", opacity, 0, 1, (x) => setPoint(index, value, x)),
      button("+", () => edit((all) => { all.splice(index + 1, 0, [middle, opacity]); state.point = index + 1; }), { title: "Add a point", ariaLabel: "add a point" }),
      button("\u2212", () => edit(() => removePoint(index)), { title: "Remove this point", ariaLabel: "remove this point" })));
}

// The ends of the colours.
function windowOfCurve() {
  const all = curve().colours.map((knot) => knot[0]);
  return [all[0], all.at(-1)];
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
  const [first, last] = windowOfCurve();
  const moved = (value) => level + ((value - first) / (last - first || 1) - 0.5) * width;
  state.curve.opacities = opacities.map(([value, opacity]) => [moved(value), opacity]);
  state.curve.colours = colours.map(([value, ...rgb]) => [moved(value), ...rgb]);
}

// Lays a named map over the range of the present colours.
function setMap(name) {
  remember();
  const list = ownCurve().colours;
  const [first, last] = [list[0][0], list.at(-1)[0]];
  const stops = state.scene.volume.maps[name];
  state.curve.colours = stops.map((rgb, i) => [first + ((last - first) * i) / (stops.length - 1), ...rgb]);
}

// A transfer function of a file that was dropped on the page.
function lookArrived({ name, look }) {
  remember();
  ownCurve();
  state.curve = look.function;
  if (look.shade) setOption("shade", look.shade);
  if (look.opacity_unit) setOption("opacity-unit", look.opacity_unit);
  note([`${name} is the transfer function now`, ...look.notes].join("; "));
  changed({ panel: true });
}
