// Colours of channels, labels and surfaces.

const hex = (rgb) => "#" + rgb.map((c) => Math.round(255 * Math.min(1, Math.max(0, c))).toString(16).padStart(2, "0")).join("");

// Channels as the command line drew them.
function channelsAsTold() {
  return state.scene.volume.channels.map(({ number, look, colour, window, gamma, opacity }) =>
    ({ number, look: colour ? hex(colour) : look, window, gamma, opacity, isOn: opacity > 0 }));
}

// The words of --channel; a channel that is off has no opacity.
function channelWords({ number, look, window, gamma, opacity, isOn }) {
  const parts = [number, look];
  if (window) parts.push(window.map(short).join(","), `gamma=${short(gamma)}`, `opacity=${isOn ? short(opacity) : 0}`);
  return parts.join(":");
}

// The switch and the colour of a channel, its window, gamma and opacity.
function channelRows(told, place) {
  const name = told.name ?? `channel ${told.number}`;
  const now = () => (state.channels ?? channelsAsTold())[place];
  const change = (field, value) => {
    state.channels ??= channelsAsTold();
    state.channels[place][field] = value;
    soon();
  };
  const { look, window, gamma, opacity, isOn } = now();
  const shown = make("input", { type: "checkbox", checked: isOn, ariaLabel: `show ${name}` });
  shown.addEventListener("change", () => {
    remember();
    change("isOn", shown.checked);
    if (shown.checked && now().opacity === 0) change("opacity", 1);
  });
  const colour = make("input", { type: "color", value: look?.startsWith("#") ? look : "#ffffff", ariaLabel: `colour of ${name}` });
  colour.addEventListener("focus", remember);
  colour.addEventListener("input", () => change("look", colour.value));
  const rows = [row(`${name}${look?.startsWith("#") ? "" : ` (${look})`}`, shown, colour)];
  if (!window) return rows;
  const end = (at, label) => {
    const input = make("input", { type: "number", step: "any", value: short(window[at]), ariaLabel: `${label} of ${name}` });
    input.addEventListener("focus", remember);
    input.addEventListener("change", () => {
      const ends = [...now().window];
      ends[at] = Number(input.value);
      if (ends[0] < ends[1]) change("window", ends);
      else note(`the window of ${name} is ${ends[0]} to ${ends[1]}: the first value has to be the smaller one`);
    });
    return input;
  };
  const ramp = (label, field, value, most) => {
    const input = make("input", { type: "range", min: field === "gamma" ? 0.1 : 0, max: most, step: 0.01, value, ariaLabel: `${label} of ${name}` });
    input.addEventListener("pointerdown", remember);
    input.addEventListener("input", () => change(field, Number(input.value)));
    return input;
  };
  return [...rows,
    row(`window ${told.number}`, end(0, "low end"), end(1, "high end")),
    row(`gamma ${told.number}`, ramp("gamma", "gamma", gamma, 3)),
    row(`opacity ${told.number}`, ramp("opacity", "opacity", opacity, 1))];
}

function channelPanel(channels) {
  return [...channels.flatMap(channelRows), make("div", { className: "buttons" },
    button("as started", () => { remember(); state.channels = null; changed({ panel: true }); }))];
}

// Most labels with rows of their own: the most frequent.
const LABEL_ROWS = 40;

function labelRows() {
  const { labels } = state.scene.volume;
  const typed = () => Object.fromEntries(labels.map(({ label, colour, opacity }) => [label, { colour: hex(colour), opacity }]));
  const now = state.labels ?? typed();
  const change = (label, field, value) => {
    state.labels ??= typed();
    state.labels[label][field] = value;
    soon();
  };
  const rows = labels.slice(0, LABEL_ROWS).map(({ label }) => {
    const colour = make("input", { type: "color", value: now[label].colour });
    colour.addEventListener("focus", remember);
    colour.addEventListener("input", () => change(label, "colour", colour.value));
    const opacity = make("input", { type: "range", min: 0, max: 1, step: 0.01, value: now[label].opacity, ariaLabel: `opacity of label ${label}` });
    opacity.addEventListener("pointerdown", remember);
    opacity.addEventListener("input", () => change(label, "opacity", Number(opacity.value)));
    return row(String(label), colour, opacity);
  });
  const rest = labels.length - rows.length;
  const note = rest > 0 ? [make("p", { className: "note" }, `${rest} smaller labels keep their colours`)] : [];
  return [...rows, ...note, make("div", { className: "buttons" },
    button("as started", () => { remember(); state.labels = null; changed({ panel: true }); }),
    button("save labels", () => ask("labels", "labels.json")))];
}

// Isosurfaces that stand in the volume, as the command line drew them.
const surfacesAsTold = () => state.scene.surfaces.map((surface) => ({ ...surface, colour: surface.colour && hex(surface.colour) }));
const allSurfaces = () => state.surfaces ?? surfacesAsTold();

// The words of --with-iso.
const surfaceWords = ({ value, colour, opacity }) => `${value}:${colour ?? ""},${opacity}`;

// Colours of new surfaces, one after another: ivory, vermilion, sky, green (the first is that of bone, the others are of Okabe and Ito).
const SURFACE_COLOURS = ["#f2e6cc", "#d55e00", "#56b4e9", "#009e73"];

// The value, the colour and the opacity of each surface.
function surfaceRows() {
  const [least, most] = state.scene.volume.range;
  const change = (place, fields) => { state.surfaces = allSurfaces().map((surface, i) => (i === place ? { ...surface, ...fields } : surface)); };
  const rows = allSurfaces().flatMap(({ value, colour, opacity }, place) => {
    const name = `surface ${place + 1}`;
    const picked = make("input", { type: "color", value: colour ?? "#ffffff", ariaLabel: `colour of ${name}` });
    picked.addEventListener("focus", remember);
    picked.addEventListener("input", () => { change(place, { colour: picked.value }); soon(); });
    const remove = () => { remember(); state.surfaces = allSurfaces().toSpliced(place, 1); changed({ panel: true }); };
    return [
      slider(name, { min: least, max: most, value, text: short, act: (x) => change(place, { value: Number(x.toPrecision(5)) }) }),
      slider(`opacity of ${name}`, { min: 0.05, max: 1, step: 0.05, value: opacity, text: short, act: (x) => change(place, { opacity: Number(short(x)) }) }),
      row(`colour of ${name}`, picked, button("\u00d7", remove, { title: "Remove", ariaLabel: `remove ${name}` })),
    ];
  });
  const add = () => {
    remember();
    const all = allSurfaces();
    const [low, high] = windowOfCurve();
    const value = Number(((low + high) / 2).toPrecision(5));
    state.surfaces = [...all, { value, colour: SURFACE_COLOURS[all.length % SURFACE_COLOURS.length], opacity: 1 }];
    changed({ panel: true });
  };
  const adding = button("add a surface", add, { id: "add-surface", title: "Of one value, inside the volume" });
  return [make("details", { open: rows.length > 0 }, make("summary", {}, "Surfaces"), ...rows, make("div", { className: "buttons" }, adding))];
}
