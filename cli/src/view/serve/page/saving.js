// Files: written beside the command, or sent to this machine.

// A file that is being written, and the button that cancels it.
const task = document.getElementById("task");

function saving({ path, done, total }) {
  const name = path.split("/").at(-1);
  task.replaceChildren(
    make("span", {}, total > 1 ? `writing ${name}: ${done} of ${total}` : `writing ${name}...`),
    button("cancel", cancel, { title: "Key Esc" }));
}

function saved(text, isBad = false) {
  task.replaceChildren();
  if (isBad) say(text, true);
  else note(text);
}

// Ends the picture that is being refined, and the file that is being written.
function cancel() {
  send({ type: "cancel" });
  say("cancelled");
}

function progressed({ id, share }) {
  if (id === nextId - 1) say(`refining: ${Math.round(100 * share)}% (Esc cancels)`);
}

// A file that was drawn for this machine.
function downloaded(name, blob) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  saved(`downloaded ${name}`);
}

function close() {
  dialog.close();
}

function showCommand(text) {
  const pre = make("pre", {}, text);
  // Pictures of steps carry the mark by which --resume knows them.
  const same = (state.scene.volume?.steps.length ?? 1) > 1 ? "pixel for pixel" : "byte for byte";
  dialog.replaceChildren(make("p", {}, `This draws the picture again, ${same}:`), pre,
    make("div", { className: "buttons" },
      button("copy", async () => { await navigator.clipboard.writeText(text); close(); say("copied"); }), button("close", close)));
  dialog.showModal();
}

// Asks for a name, and where the file goes.
function ask(what, name, { sized = false, steps = false } = {}) {
  const size = fullSize();
  const file = make("input", { type: "text", value: name });
  const width = make("input", { type: "number", min: 1, value: size[0], ariaLabel: "width" });
  const height = make("input", { type: "number", min: 1, value: size[1], ariaLabel: "height" });
  const count = make("input", { type: "number", min: 2, max: 1000, value: 60 });
  const save = (to) => {
    const sides = sized ? [Number(width.value), Number(height.value)] : size;
    const detail = steps ? around(Number(count.value)) : ["path", "film"].includes(what) ? pathFile() : what === "session" ? JSON.parse(snapshot()) : null;
    send({ type: "save", what, name: file.value, detail, to, ...view(sides) });
    close();
    say(`saving ${file.value}...`);
  };
  dialog.replaceChildren(
    make("p", {}, "Save writes into the folder where the command was started; download sends the file to this machine."),
    row("name", file),
    ...(sized ? [row("size", width, height)] : []),
    ...(steps ? [row("pictures", count)] : []),
    make("div", { className: "buttons" },
      button("save", () => save("folder")), button("download", () => save("page")), button("cancel", close)));
  dialog.showModal();
}

function pathFile() {
  return { keys: state.keys.map((camera, i) => ({ time: 2 * i, camera })) };
}

// A session, or a look of ParaView or Slicer, that was dropped on the page or chosen.
async function opened(file) {
  const text = await file.text();
  let parsed = null;
  try {
    parsed = JSON.parse(text);
  } catch {
    // A look of Slicer is no JSON.
  }
  if (parsed?.format?.startsWith("resample session")) {
    remember();
    takeState(parsed.page);
    note(`opened ${file.name}`);
  } else if (state.scene.volume?.function) {
    send({ type: "look", name: file.name, text });
  } else {
    note(`${file.name}: no session, and this scene has no transfer function`);
  }
}

function openFile() {
  const input = make("input", { type: "file", accept: ".json,.vp", onchange: () => input.files[0] && opened(input.files[0]) });
  input.click();
}
