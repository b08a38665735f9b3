// The panel: what can be chosen for this kind of scene.

const panel = document.getElementById("panel");
const dialog = document.getElementById("dialog");

function make(name, fields = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(fields)) {
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key in element) element[key] = value;
    else element.setAttribute(key, value);
  }
  element.append(...children);
  return element;
}

function row(name, ...elements) {
  const first = elements[0];
  first.id ||= `field-${name.replace(/\W+/g, "-")}`;
  return make("div", { className: "row" }, make("label", { htmlFor: first.id }, name), ...elements);
}

function button(text, act, fields = {}) {
  return make("button", { type: "button", onclick: act, ...fields }, text);
}

// A choice among words; the first means "as the command line has it".
function choice(name, option_, words, first, value = option(option_)) {
  const select = make("select", {
    onchange: () => {
      remember();
      setOption(option_, select.value || null);
      if (state.scene.volume) settle(option_);
      if (state.scene.options.shadows) settleShadows(option_);
      changed({ panel: true });
    },
  }, ...[["", first], ...words.map((word) => [word, word])].map(([value, text]) => make("option", { value }, text)));
  select.value = value ?? "";
  return row(name, select);
}

function slider(name, { min, max, step, value, text = (x) => x, act }) {
  const shown = make("output", {}, text(value));
  const input = make("input", { type: "range", min, max, step: step ?? "any", value });
  input.addEventListener("pointerdown", remember);
  input.addEventListener("keydown", rememberSteps);
  input.addEventListener("input", () => {
    shown.textContent = text(Number(input.value));
    act(Number(input.value));
    soon();
  });
  return row(name, input, shown);
}

const short = (x) => Number(Number(x).toPrecision(3)).toString();

function sceneArrived(scene) {
  readingSince = null;
  const isFirst = state.scene?.title !== scene.title;
  state.scene = scene;
  document.title = `${scene.title} - resample view`;
  const { size, scene_size, ...camera } = scene.start;
  state.start = camera;
  const stored = isFirst ? stateOfAddress(scene.title) ?? scene.session : null;
  if (isFirst && state.camera) state.camera = null;
  state.camera ??= { ...camera };
  state.step = Math.min(state.step, Math.max(0, (scene.volume?.steps.length ?? 1) - 1));
  if (stored) return takeState(stored);
  showSlices();
  buildPanel();
  changed();
}

function buildPanel() {
  const { scene } = state;
  const kind = { volsplat: volumePanel, gaussians: gaussianPanel, texmap: meshPanel, warp3d: depthPanel, points: pointsPanel }[scene.application];
  const scroll = panel.scrollTop;
  panel.replaceChildren(
    make("h1", {}, scene.title),
    make("p", { className: "note" }, about()),
    ...kind(),
    ...sharedPanel(),
  );
  panel.scrollTop = scroll;
  refreshButtons();
  drawCurve();
  if (document.getElementById("point")) showPoint();
  showTimes();
}

// Buttons that need something to work on.
function refreshButtons() {
  const enable = (id, is) => document.getElementById(id)?.toggleAttribute("disabled", !is);
  enable("undo", past.length > 0);
  enable("redo", future.length > 0);
  enable("keep-curve", Boolean(state.curve));
}

function about() {
  const volume = state.scene.volume;
  if (!volume) return "drag: turn, wheel: zoom, shift-drag: pan";
  return `${volume.dims.join(" x ")} voxels, ${volume.range.map(short).join(" to ")}`;
}

function volumePanel() {
  const { volume } = state.scene;
  const parts = stepRows();
  if (volume.function) {
    const plot = make("canvas", { id: "curve", title: "Drag a point; click to add one, double-click to remove it; shift-drag moves all" });
    watchCurve(plot);
    const [low, high] = windowOfCurve();
    const [least, most] = volume.range;
    parts.push(
      make("h2", {}, "Transfer function"),
      plot,
      make("canvas", { id: "bar" }),
      make("div", { id: "point" }),
      make("div", { className: "row" }, make("label", { htmlFor: "is-log" }, "logarithm"),
        make("input", { id: "is-log", type: "checkbox", checked: state.plot.isLog, onchange: (event) => { state.plot.isLog = event.target.checked; drawCurve(); } }),
        button("zoom", () => { state.plot.range = windowOfCurve(); drawCurve(); }, { title: "Shows the window of the colours; the wheel zooms, too" }),
        button("all", () => { state.plot.range = null; drawCurve(); }, { title: "Shows all values" })),
      slider("level", { min: least, max: most, value: (low + high) / 2, text: short, act: (level) => setLevel(level) }),
      slider("width", { min: (most - least) / 500, max: 2 * (most - least), value: high - low || 1, text: short, act: (width) => setWidth(width) }),
      slider("opacity", { min: -2, max: 2, value: Math.log10(option("opacity-scale") ?? state.scene.options["opacity-scale"] ?? 1),
        text: (x) => short(10 ** x), act: (x) => setOption("opacity-scale", short(10 ** x)) }),
      make("div", { className: "buttons" },
        button("as started", () => { remember(); state.curve = null; state.surfaces = null; state.changes = {}; changed({ panel: true }); }),
        button("open...", openFile, { title: "A file of ParaView or Slicer, or a session; files can be dropped on the page, too" })),
      ...lookRows(),
    );
    if (volume.presets.length) parts.push(make("h2", {}, "Presets"), presets());
    parts.push(make("details", {}, make("summary", {}, "Colour maps"), maps()));
  }
  if (volume.channels.length) parts.push(make("h2", {}, "Channels"), ...channelPanel(volume.channels));
  if (volume.labels.length) parts.push(make("h2", {}, "Labels"), ...labelRows());
  const isUnlit = UNLIT.includes(option("blend") ?? suggested("blend"));
  parts.push(make("h2", {}, "Light and blending"),
    isUnlit ? choice("light", "shade", volume.shadings, "none", null) : choice("light", "shade", volume.shadings, suggested("shade") ?? "none"),
    isUnlit ? "" : lightSliders(),
    ...(isUnlit ? [] : blockedLight()),
    choice("blend", "blend", volume.blends, suggested("blend") ?? "emission"));
  if (option("blend") === "isosurface" || option("iso") !== null) {
    const [least, most] = volume.range;
    const now = Number(option("iso") ?? (least + most) / 2);
    if (option("iso") === null) setOption("iso", now);
    parts.push(slider("surface at", { min: least, max: most, value: now, text: short, act: (x) => setOption("iso", short(x)) }));
  }
  if (volume.function && volume.has_slices) parts.push(...surfaceRows());
  parts.push(make("details", { open: Boolean(option("clip-plane")) }, make("summary", {}, "Cut"), ...cutSlider()));
  const crop = make("details", { open: Boolean(option("crop")) || showsCrop }, make("summary", {}, "Crop box"),
    make("p", { className: "note" }, "Drag the handles on the picture."), ...cropSliders());
  crop.addEventListener("toggle", () => { showsCrop = crop.open; drawMarks(); });
  parts.push(crop);
  if (volume.has_slices) parts.push(make("div", { className: "buttons" }, button(state.slices ? "hide slices" : "slices", toggleSlices, { id: "show-slices" })));
  return parts;
}

function setLevel(level) {
  const [low, high] = windowOfCurve();
  setWindow(level, high - low || 1);
  drawCurve();
}

function setWidth(width) {
  const [low, high] = windowOfCurve();
  setWindow((low + high) / 2, width);
  drawCurve();
}

// Looks that were kept under a name.
function lookRows() {
  const name = make("input", { type: "text", placeholder: "name of this look", ariaLabel: "name of this look", maxLength: 40 });
  const keep = () => {
    if (!name.value) return;
    keepLook(name.value);
    changed({ panel: true, moving: false });
  };
  const rows = Object.keys(allLooks()).map((known) => make("div", { className: "row" },
    button(known, () => useLook(known)),
    button("\u00d7", () => { forgetLook(known); changed({ panel: true, moving: false }); }, { title: "Forget", ariaLabel: `forget ${known}` })));
  return [...rows, make("div", { className: "row" }, name, button("keep look", keep))];
}

// The direction towards the light, around the camera of the start.
function lightFrom(angles) {
  state.light = angles;
  const [azimuth, elevation] = angles.map((degrees) => (degrees * Math.PI) / 180);
  const { forward, right, up } = axes(state.camera);
  const level = add(mul(forward, -Math.cos(azimuth)), mul(right, Math.sin(azimuth)));
  const direction = add(mul(level, Math.cos(elevation)), mul(up, Math.sin(elevation)));
  setOption("light", direction.map((x) => x.toFixed(4)).join(","));
}

function lightSliders() {
  const box = make("div");
  const shade = option("shade") ?? suggested("shade");
  const isBlocked = isOn("shadows");
  if (!isBlocked && (!shade || shade === "none")) return box;
  const angles = state.light ?? [0, 0];
  const act = (index) => (x) => lightFrom((state.light ?? angles).with(index, x));
  box.append(slider("light from", { min: -90, max: 90, value: angles[0], text: (x) => `${x.toFixed(0)}\u00b0`, act: act(0) }),
    slider("height", { min: -90, max: 90, value: angles[1], text: (x) => `${x.toFixed(0)}\u00b0`, act: act(1) }));
  return box;
}

// Switches of what takes light on its way.
function blockedLight() {
  return ["shadows", "occlusion"].map((name) => {
    const input = make("input", { type: "checkbox", checked: isOn(name), onchange: () => {
      remember();
      setSwitch(name, input.checked);
      // Shadows need a direction: from above, beside the camera.
      if (name === "shadows" && input.checked && option("light") === null) lightFrom([-40, 40]);
      changed({ panel: true });
    } });
    return row(name, input);
  });
}

function cropSliders() {
  const [low, high] = state.scene.volume.corners;
  const box = cropBox();
  const names = ["x from", "y from", "z from", "x to", "y to", "z to"];
  return names.map((name, i) => slider(name, {
    min: low[i % 3], max: high[i % 3], value: box[i], text: short,
    act: (x) => setCrop(cropBox().with(i, x)),
  }));
}

// A plane that faces the eye, moved into the volume: what lies before it is cut away.
function cutSlider() {
  const [low, high] = state.scene.volume.corners;
  const { forward } = axes(state.camera);
  const normal = option("clip-plane")?.split(",").slice(0, 3).map(Number) ?? forward;
  const ends = [0, 1, 2].map((axis) => [low[axis] * normal[axis], high[axis] * normal[axis]]);
  const near = ends.reduce((sum, end) => sum + Math.min(...end), 0);
  const far = ends.reduce((sum, end) => sum + Math.max(...end), 0);
  const at = Number(option("clip-plane")?.split(",")[3] ?? near);
  const act = (share) => {
    if (share <= 0) setOption("clip-plane");
    else setOption("clip-plane", [...normal, near + share * (far - near)].map((x) => Number(x.toPrecision(7))).join(","));
  };
  const shown = make("input", { type: "checkbox", checked: state.showsCut, onchange: () => { remember(); state.showsCut = shown.checked; changed(); } });
  return [
    slider("depth", { min: 0, max: 1, value: (at - near) / (far - near), text: (x) => `${Math.round(100 * x)}%`, act }),
    make("div", { className: "buttons" },
      button("from here", () => { remember(); setOption("clip-plane"); changed({ panel: true }); }, { title: "The plane faces the eye as it stands now" })),
    ...(state.scene.volume.has_slices ? [row("values on it", shown)] : []),
  ];
}

function presets() {
  const box = make("div", { className: "presets" });
  for (const { name, about } of state.scene.volume.presets) {
    const image = waiting.pictures?.[name];
    box.append(make("button", {
      type: "button", title: about, "data-name": name, className: option("preset") === name && !state.curve ? "chosen" : "",
      onclick: () => {
        remember();
        state.curve = null;
        for (const other of ["window", "colormap", "shade", "blend", "light"]) setOption(other);
        setOption("preset", name);
        settle("preset");
        changed({ panel: true });
      },
    }, image && image !== NO_PICTURE ? make("img", { src: image, alt: "" }) : make("span", { className: "empty" }), name));
  }
  return box;
}

// Pictures of presets are asked for one at a time, when nothing else is to do.
function askThumbnails() {
  const names = state.scene.volume?.function ? state.scene.volume.presets.map((preset) => preset.name) : [];
  waiting.pictures ??= {};
  const next = names.find((name) => !waiting.pictures[name]);
  if (next) send({ type: "thumbnail", preset: next, ...view([96, 96]) });
}

// In place of a picture that cannot be drawn.
const NO_PICTURE = "none";

// One that cannot be drawn leaves its place empty; the others follow.
function thumbnailFailed(name) {
  waiting.pictures[name] = NO_PICTURE;
  askThumbnails();
}

function thumbnailArrived(head, blob) {
  waiting.pictures[head.name] = URL.createObjectURL(blob);
  // The button itself stays: it may be held down at this moment.
  const place = panel.querySelector(`.presets [data-name="${head.name}"] .empty`);
  place?.replaceWith(make("img", { src: waiting.pictures[head.name], alt: "" }));
  askThumbnails();
}

function maps() {
  const box = make("div", { className: "maps" });
  for (const [name, stops] of Object.entries(state.scene.volume.maps)) {
    const bar = make("canvas");
    drawBar(bar, (x) => stops[Math.min(stops.length - 1, Math.floor(x * stops.length))]);
    box.append(make("button", { type: "button", onclick: () => { setMap(name); changed({ panel: true }); } }, bar, name));
  }
  return box;
}

function gaussianPanel() {
  const { options } = state.scene;
  const error = Number(option("slab-error") ?? options["slab-error"]);
  return [
    make("h2", {}, "Gaussians"),
    choice("samples", "samples", options.samples, "auto"),
    slider("slab error", { min: -3, max: 0, value: Math.log10(error), text: (x) => short(10 ** x),
      act: (x) => setOption("slab-error", short(10 ** x)) }),
  ];
}

function meshPanel() {
  const { options } = state.scene;
  return [
    make("h2", {}, "Surface"),
    choice("light", "shade", options.shade, "as the material says"),
    choice("shadows", "shadows", options.shadows, "none"),
    textures(),
    choice("texels by", "method", options.method, "hybrid"),
    slider("turn light", { min: -180, max: 180, value: Number(option("environment-turn") ?? 0), text: (x) => `${x.toFixed(0)}\u00b0`,
      act: (x) => setOption("environment-turn", x.toFixed(0)) }),
    slider("exposure", { min: -6, max: 6, value: Number(option("exposure") ?? 0), text: (x) => `${x.toFixed(1)} stops`,
      act: (x) => setOption("exposure", x.toFixed(1)) }),
    choice("tone map", "tone-map", options["tone-map"], "none"),
  ];
}

// Pictures shown, left out, or replaced by a grid that shows the density of their texels.
function textures() {
  const words = [["shown", "shown"], ["left-out", "left out"], ["grid", "density of texels"]];
  const select = make("select", { onchange: () => { remember(); setOption("textures", select.value); changed(); } },
    ...words.map(([value, text]) => make("option", { value }, text)));
  select.value = option("textures") ?? state.scene.options.textures;
  return row("textures", select);
}

function depthPanel() {
  const { options } = state.scene;
  return [
    make("h2", {}, "Warp"),
    choice("holes", "fill", options.fill, "shown"),
    choice("method", "method", options.method, "hybrid"),
  ];
}

function pointsPanel() {
  const { options } = state.scene;
  return [
    make("h2", {}, "Points"),
    choice("colours", "color-by", options["color-by"], options.colored),
    choice("colour map", "colormap", options.maps, options.colormap ?? "as the values have it"),
    choice("light", "shade", options.shade, "as the colours have it"),
    choice("blend", "blend", ["linear", "mean"], "linear"),
  ];
}

// Whether a part of a figure is drawn, and the word of one that has several.
const figurePart = (name) => (name in state.changes ? state.changes[name][0] ?? null : state.scene.options.figure[name]);
const isDrawn = (name) => Boolean(state.scene.options.figure && figurePart(name) && figurePart(name) !== "off");

// What is drawn into the picture beside the scene, as the command line has it.
function figureRows() {
  const { figure } = state.scene.options;
  if (!figure) return [];
  const set = (name, value, typed) => {
    remember();
    if (value === typed) delete state.changes[name];
    else state.changes[name] = value === null ? [] : [value];
    changed({ panel: true });
  };
  const isByValue = ["height", "intensity"].includes(option("color-by") ?? state.scene.options.colored);
  const parts = state.scene.volume?.function || isByValue ? ["scale-bar", "colour-bar"] : ["scale-bar"];
  const rows = parts.map((name) => row(name.replace("-", " "), make("input", { type: "checkbox", checked: isDrawn(name),
    onchange: (event) => set(name, event.target.checked ? "on" : "off", figure[name] ? "on" : "off") })));
  const kind = make("select", { onchange: () => set("axes", kind.value, figure.axes ?? "off") },
    ...[["off", "none"], ["directions", "directions"], ["box", "box with numbers"]].map(([value, text]) => make("option", { value }, text)));
  kind.value = isDrawn("axes") ? figurePart("axes") : "off";
  const caption = make("input", { type: "text", value: figurePart("caption") ?? "", onchange: () => set("caption", caption.value || null, figure.caption) });
  const isOpen = [...parts, "axes", "caption"].some(isDrawn);
  return [make("details", { open: isOpen }, make("summary", {}, "Figure"), ...rows, row("axes", kind), row("caption", caption))];
}

function sharedPanel() {
  const background = make("select", { onchange: () => { remember(); setOption("background", background.value || null); changed(); } },
    ...[["", "none"], ["white", "white"], ["black", "black"], ["#808080", "grey"]].map(([value, text]) => make("option", { value }, text)));
  background.value = option("background") ?? "";
  const exactness = make("select", { onchange: () => { state.exactness = exactness.value; changed({ moving: false }); } },
    ...[["fast", "quick"], ["default", "as command line"], ["1/64", "error up to 1/64"], ["1/255", "error up to 1/255"], ["exact", "exact"]]
      .map(([value, text]) => make("option", { value }, text)));
  exactness.value = state.exactness;
  return [
    make("h2", {}, "Picture"),
    row("background", background),
    row("at rest", exactness),
    ...figureRows(),
    make("p", { className: "note", id: "times" }),
    make("div", { className: "buttons" },
      button("undo", undo, { id: "undo", title: "Ctrl-Z" }),
      button("redo", redo, { id: "redo", title: "Ctrl-Y" }),
      button("reset view", () => { remember(); resetView(); changed(); }, { title: "Key r; keys 1 to 6 look along the axes" }),
      ...(state.scene.application === "warp3d" ? [] : ["+x", "-x", "+y", "-y", "+z", "-z"]).map((text, i) =>
        button(text, () => { remember(); lookAlong(i >> 1, i % 2 ? -1 : 1); changed(); }, { title: `Key ${i + 1}` }))),
    make("h2", {}, "Keep it"),
    make("div", { className: "buttons" },
      button("copy command", () => send({ type: "command", ...view(fullSize()) })),
      button("picture", () => ask("picture", "view.png", { sized: true })),
      button("transfer function", () => ask("transfer", "transfer.json"), { id: "keep-curve" }),
      button("camera", () => ask("camera", "camera.json")),
      button("session", () => ask("session", "session.json"), { title: "All of this page, for resample view --session" }),
      ...(state.scene.volume?.function ? [] : [button("open...", openFile, { title: "A session" })]),
      button("turntable", () => ask("turntable", "turntable.webp", { sized: true, steps: true }), { disabled: state.scene.application === "warp3d" })),
    make("h2", {}, "Measure"),
    ...measureRows(),
    make("h2", {}, "Key frames"),
    keyList(),
    make("div", { className: "buttons" },
      button("add view", () => { remember(); state.keys = [...state.keys, { ...state.camera }]; changed({ panel: true, moving: false }); }),
      button("play", play, { disabled: state.keys.length < 2 }),
      button("save path", () => ask("path", "path.json"), { disabled: state.keys.length < 2 }),
      button("render", () => ask("film", "path.webp", { sized: true }), { disabled: state.keys.length < 2 })),
  ];
}

function keyList() {
  return make("ol", {}, ...state.keys.map((key, i) => make("li", {}, `at ${2 * i} s`,
    button("show", () => { remember(); state.camera = { ...key }; changed(); }),
    button("\u00d7", () => { remember(); state.keys = state.keys.filter((_, j) => j !== i); changed({ panel: true, moving: false }); }, { title: "Remove" }))));
}

// Goes through the key frames, two seconds from each to the next.
function play() {
  const begin = performance.now();
  const step = () => {
    const time = (performance.now() - begin) / 2000;
    const index = Math.floor(time);
    if (index >= state.keys.length - 1) {
      state.camera = { ...state.keys.at(-1) };
      return changed();
    }
    const [from, to, share] = [state.keys[index], state.keys[index + 1], time - index];
    const mixed = (name) => add(mul(from[name], 1 - share), mul(to[name], share));
    const distance = axes(from).distance ** (1 - share) * axes(to).distance ** share;
    const target = mixed("target");
    const away = unit(add(mul(unit(sub(from.position, from.target)), 1 - share), mul(unit(sub(to.position, to.target)), share)));
    state.camera = { ...from, target, position: add(target, mul(away, distance)), up: mixed("up") };
    changed();
    requestAnimationFrame(step);
  };
  step();
}

function showTimes() {
  const line = document.getElementById("times");
  if (line) line.textContent = Object.entries(times).map(([name, ms]) => `${name} ${ms.toFixed(0)} ms`).join(", ");
}
