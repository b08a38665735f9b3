// Colours of channels and labels.

const hex = (rgb) => "#" + rgb.map((c) => Math.round(255 * Math.min(1, Math.max(0, c))).toString(16).padStart(2, "0")).join("");

// The colour of a channel, in place of the look that was typed.
function channelRow({ number, look, colour }, place) {
  const typed = state.scene.volume.channels.map((channel) => `${channel.number} ${channel.look}`);
  const now = () => state.changes.channel ?? typed;
  const [, word] = now()[place].split(" ");
  const input = make("input", { type: "color", value: word.startsWith("#") ? word : colour ? hex(colour) : "#ffffff" });
  input.addEventListener("focus", remember);
  input.addEventListener("input", () => {
    setOption("channel", ...now().map((pair, i) => (i === place ? `${number} ${input.value}` : pair)));
    soon();
  });
  return row(`channel ${number}${colour || word !== look ? "" : ` (${look})`}`, input);
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
