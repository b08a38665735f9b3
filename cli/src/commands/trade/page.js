// Draws the scatter from the rows, shows the pictures of the row that is chosen, and sorts the table.
"use strict";
const rows = JSON.parse(document.getElementById("data").textContent);
const colours = ["#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#B8A800", "#888888",
  "#332288", "#882255", "#44AA99", "#999933"];
// Where colours are used up, marks have a rim.
const colour = (k) => colours[k % colours.length];
const rim = (k) => (k < colours.length ? "" : "rim");
const groups = [...new Set(rows.map((row) => row.group))];
const more = new Set(["psnr", "ssim"]);
let chosen = -1;

// The names of the ladders stand to the right of the axes, or below where there is no room.
function sizes(plot) {
  const width = Math.max(300, plot.clientWidth), narrow = width < 600;
  const legend = narrow ? 16 * Math.ceil(groups.length / 2) + 12 : 0;
  return { width, narrow, height: Math.max(300, 0.55 * width) + legend, left: narrow ? 46 : 64, right: narrow ? 10 : 140, top: 22, bottom: 44 + legend };
}

function element(name, attributes, parent) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  parent.appendChild(made);
  return made;
}

// A logarithmic scale where values lie far apart, else a linear one; on a logarithmic one, 0 lies at its beginning.
function scale(all, from, to) {
  const values = all.filter((v) => v > 0);
  const low = Math.min(...(values.length ? values : all)), high = Math.max(...all);
  const log = values.length > 0 && Math.min(...all) >= 0 && high / low > 3;
  const map = log ? Math.log10 : (v) => v;
  const a = map(low), b = map(high), span = b - a || 1;
  const place = (v) => log && v <= 0 ? from : from + ((map(v) - a) / span * 0.92 + 0.04) * (to - from);
  const ticks = [];
  if (log) {
    for (let e = Math.floor(a); e <= Math.ceil(b); e++)
      for (const m of [1, 2, 5]) { const v = m * 10 ** e; if (v >= low * 0.9 && v <= high * 1.1) ticks.push(v); }
  } else {
    for (let k = 0; k <= 4; k++) ticks.push(low + (high - low) * k / 4);
  }
  return { place, ticks };
}

function draw() {
  const error = document.getElementById("error").value, cost = document.getElementById("cost").value;
  const at = rows.map((row) => ({ index: row.index, row, x: row.cost[cost], y: row.error[error] }))
    .filter((p) => Number.isFinite(p.x) && Number.isFinite(p.y));
  const plot = document.getElementById("plot");
  plot.replaceChildren();
  const size = sizes(plot);
  if (!at.length) { plot.textContent = "No setting has both figures."; return; }
  const svg = element("svg", { viewBox: `0 0 ${size.width} ${size.height}` }, plot);
  const x = scale(at.map((p) => p.x), size.left, size.width - size.right);
  const y = scale(at.map((p) => p.y), size.height - size.bottom, size.top);
  const text = (words, where, anchor) => {
    element("text", { class: "tick", "text-anchor": anchor, ...where }, svg).textContent = words;
  };
  for (const tick of x.ticks) {
    const place = x.place(tick);
    element("line", { class: "axis", x1: place, x2: place, y1: size.top, y2: size.height - size.bottom }, svg);
    text(Number(tick.toPrecision(3)), { x: place, y: size.height - size.bottom + 14 }, "middle");
  }
  for (const tick of y.ticks) {
    const place = y.place(tick);
    element("line", { class: "axis", x1: size.left, x2: size.width - size.right, y1: place, y2: place }, svg);
    text(Number(tick.toPrecision(3)), { x: size.left - 6, y: place + 4 }, "end");
  }
  const name = document.getElementById("cost").selectedOptions[0].textContent;
  text(`${name} →`, { x: size.width - size.right, y: size.height - size.bottom + 34 }, "end");
  text(`${error} ↑`, { x: size.left, y: 12 }, "start");
  const better = (a, b) => (more.has(error) ? a > b : a < b);
  let best = null;
  const front = [...at].sort((p, q) => p.x - q.x).filter((p) => {
    const keep = best === null || better(p.y, best);
    if (keep) best = p.y;
    return keep;
  });
  element("polyline", { class: "front", points: front.map((p) => `${x.place(p.x)},${y.place(p.y)}`).join(" ") }, svg);
  for (const p of at) {
    const circle = element("circle", {
      cx: x.place(p.x), cy: y.place(p.y), r: 6, "data-row": p.index, tabindex: 0,
      fill: colour(groups.indexOf(p.row.group)),
      class: p.index === chosen ? "chosen" : rim(groups.indexOf(p.row.group)),
    }, svg);
    element("title", {}, circle).textContent = `${p.row.name}\n${name} ${p.x.toPrecision(4)}\n${error} ${p.y.toPrecision(4)}`;
    circle.addEventListener("click", () => choose(p.index));
    circle.addEventListener("mouseenter", () => show(p.index));
  }
  groups.forEach((group, k) => {
    const below = size.height - size.bottom + 54 + 16 * Math.floor(k / 2);
    const [x, y] = size.narrow ? [size.left + (k % 2) * size.width / 2.3, below] : [size.width - size.right + 18, 22 + 16 * k];
    element("circle", { cx: x, cy: y, r: 5, fill: colour(k), class: rim(k) }, svg);
    text(group, { x: x + 10, y: y + 4 }, "start");
  });
}

function add(parent, name, content) {
  const made = document.createElement(name);
  made.textContent = content;
  parent.appendChild(made);
  return made;
}

function show(index) {
  const row = rows.find((row) => row.index === index), detail = document.getElementById("detail");
  detail.replaceChildren();
  add(detail, "h2", row.name);
  for (const [source, words] of [[row.picture, "picture"], [row.heatmap, "FLIP error"]]) {
    const image = add(detail, "img", "");
    image.src = source;
    image.alt = `${words} of ${row.name}`;
  }
  add(detail, "pre", row.command);
  const figures = Object.entries({ ...row.error, ...row.counts });
  add(detail, "p", figures.map(([name, value]) => `${name} ${typeof value === "number" ? Number(value.toPrecision(5)) : "∞"}`).join(" · "));
}

function choose(index) {
  chosen = index;
  show(index);
  for (const marked of document.querySelectorAll(".chosen")) marked.classList.remove("chosen");
  for (const found of document.querySelectorAll(`[data-row="${index}"]`)) found.classList.add("chosen");
}

function sort(column) {
  const body = document.querySelector("tbody");
  const key = (line) => line.cells[column].textContent;
  const lines = [...body.rows].sort((a, b) => {
    const [x, y] = [Number(key(a)), Number(key(b))];
    return Number.isNaN(x) || Number.isNaN(y) ? key(a).localeCompare(key(b)) : x - y;
  });
  body.replaceChildren(...lines);
}

for (const line of document.querySelectorAll("tbody tr, #verdict li")) line.addEventListener("click", () => choose(Number(line.dataset.row)));
document.querySelectorAll("th").forEach((head, column) => head.addEventListener("click", () => sort(column)));
document.getElementById("axes").addEventListener("change", draw);
window.addEventListener("resize", draw);
draw();
choose(Number(document.getElementById("detail").dataset.first));
