// Earlier and later states; the state in the page's address, and in sessions.

// The part of the state that a person has made.
const OWN = ["camera", "changes", "curve", "labels", "channels", "surfaces", "exactness", "keys", "light", "step", "measures", "slices", "showsCut", "looks"];
// Time within which turns of a wheel and strokes of a key count as one change, ms.
const ONE_CHANGE_MS = 700;
// Most characters of an address; longer states are kept by sessions alone. A guess below the limits of browsers.
const MOST_ADDRESS = 60000;

const past = [];
const future = [];
// When the last small step was made, ms; long ago where another change came after it.
let steppedAt = -Infinity;

const snapshot = () => JSON.stringify(Object.fromEntries(OWN.map((name) => [name, state[name]])));

// Before a change: undo comes back to here.
function remember() {
  const now = snapshot();
  if (past.at(-1) !== now) past.push(now);
  if (past.length > 200) past.shift();
  future.length = 0;
  steppedAt = -Infinity;
  refreshButtons();
}

// As remember, for changes that come in many small steps.
function rememberSteps() {
  const now = performance.now();
  if (now - steppedAt > ONE_CHANGE_MS) remember();
  steppedAt = now;
}

function step(from, to) {
  const now = snapshot();
  let next = from.pop();
  while (next === now) next = from.pop();
  if (!next) return refreshButtons();
  to.push(now);
  takeState(JSON.parse(next));
}

const undo = () => step(past, future);
const redo = () => step(future, past);

// Takes over what a snapshot, an address or a session holds.
function takeState(stored) {
  for (const name of OWN) if (name in stored) state[name] = stored[name];
  showSlices();
  changed({ panel: true });
}

// The address holds the state, so that a reload and a restarted command find it again.
function keepAddress() {
  const text = encodeURIComponent(`${state.scene.title}\n${snapshot()}`);
  if (text.length < MOST_ADDRESS) window.history.replaceState(null, "", `#${text}`);
}

// The state of the address, where it is one of this file.
function stateOfAddress(title) {
  try {
    const text = decodeURIComponent(location.hash.slice(1));
    const end = text.indexOf("\n");
    return end > 0 && text.slice(0, end) === title ? JSON.parse(text.slice(end + 1)) : null;
  } catch {
    return null;
  }
}

// Looks that were given a name: in the browser, for this address, and in sessions.
const LOOKS = "resample looks";
const OF_LOOK = ["window", "preset", "colormap", "shade", "blend", "light", "opacity-scale", "opacity-unit", "gradient-filter", "gradient-opacity"];

function storedLooks() {
  try {
    return JSON.parse(localStorage.getItem(LOOKS) ?? "{}");
  } catch {
    return {};
  }
}

const allLooks = () => ({ ...storedLooks(), ...state.looks });

function keepLook(name) {
  const chosen = Object.entries(state.changes).filter(([option_]) => OF_LOOK.includes(option_));
  state.looks = { ...state.looks, [name]: { curve: structuredClone(curve()), changes: Object.fromEntries(chosen) } };
  try {
    localStorage.setItem(LOOKS, JSON.stringify(allLooks()));
  } catch {
    note(`${name} is kept until the page is closed, and in a session`);
  }
}

function useLook(name) {
  remember();
  const look = allLooks()[name];
  for (const option_ of OF_LOOK) setOption(option_);
  Object.assign(state.changes, structuredClone(look.changes));
  state.curve = structuredClone(look.curve);
  changed({ panel: true });
}

function forgetLook(name) {
  const { [name]: _, ...rest } = allLooks();
  state.looks = rest;
  try {
    localStorage.setItem(LOOKS, JSON.stringify(rest));
  } catch {
    // It was not kept there either.
  }
}
