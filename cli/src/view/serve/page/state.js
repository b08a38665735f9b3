// The state of the page: the camera, the options, the transfer function. Everything that is drawn follows from it.

const state = {
  scene: null,        // what the server told about the file
  camera: null,       // { position, target, up, fov_y | projection + height }
  start: null,        // the camera of the command line
  changes: {},        // options by name, lists of words
  curve: null,        // { opacities: [[value, opacity]], colours: [[value, r, g, b]] } once it was edited, else null
  labels: null,       // { label: { colour: "#rrggbb", opacity } } of all labels once one was edited, else null
  channels: null,     // [{ number, look, window, gamma, opacity, isOn }] of all channels once one was edited, else null
  surfaces: null,     // [{ value, colour: "#rrggbb" or null, opacity }] of all isosurfaces in the volume once one was edited, else null
  exactness: "default",
  keys: [],           // key frames: cameras
  light: null,        // the direction of the light: degrees around and above the camera of the start
  step: 0,            // of a volume over time
  measures: [],       // lists of two or three places in the world
  slices: null,       // { at: [i, j, k], window: [low, high], isStanding } while they are shown; isStanding: in the volume, too
  showsCut: false,    // the values on the plane that cuts the volume
  looks: {},          // { curve, changes } by name
  plot: { isLog: true, range: null }, // how the histogram is drawn, and the values that it shows; null is all
  point: 0,           // the point of the transfer function that is edited
};

// The transfer function in the form of ParaView.
function transferFile() {
  if (!state.curve) return null;
  const points = state.curve.opacities.flatMap(([value, opacity]) => [value, opacity, 0.5, 0]);
  return { ColorSpace: "RGB", Name: state.scene.title, Points: points, RGBPoints: state.curve.colours.flat() };
}

// The options that the page changed; edited channels, surfaces and slices in the volume are options, too.
function changes() {
  const all = { ...state.changes };
  if (state.channels) all.channel = state.channels.map(channelWords);
  if (state.surfaces) all["with-iso"] = state.surfaces.map(surfaceWords);
  const slices = standingSlices();
  if (slices.length) all["with-slice"] = slices;
  return all;
}

// The part of a request that says what is drawn.
function view(size) {
  return { camera: state.camera, size, changes: changes(), transfer: transferFile(), labels: state.labels, exactness: state.exactness, step: state.step };
}

function setOption(name, ...words) {
  if (words.length === 0 || words[0] === null) delete state.changes[name];
  else state.changes[name] = words.map(String);
}

// Switches without a value: "on", and "off" where the command line has them.
function setSwitch(name, isOn) {
  const isTyped = name in state.scene.options.set;
  if (isOn === isTyped) setOption(name);
  else setOption(name, isOn ? "on" : "off");
}

function isOn(name) {
  const value = option(name);
  return value !== null && value !== "off";
}

// Blendings that show a scalar of each ray, without light.
const UNLIT = ["maximum", "minimum", "average"];

// The newest choice wins: takes off what cannot stand beside it, and says so.
function settle(newest) {
  const blend = option("blend") ?? suggested("blend");
  const shade = option("shade") ?? suggested("shade") ?? "none";
  if (newest === "blend" && state.changes.blend?.[0] !== "isosurface") {
    for (const name of ["iso", "iso-colour", "iso-opacity"]) setOption(name);
  }
  const refused = UNLIT.includes(blend) ? ["shadows", "occlusion"] : [];
  for (const name of refused.filter(isOn)) {
    setSwitch(name, false);
    note(`${blend} goes without ${name}`);
  }
  if (!UNLIT.includes(blend) || shade === "none") return;
  if (newest === "shade") {
    setOption("blend", "emission");
    note(`${blend} has no light: blending is emission now`);
  } else {
    setOption("shade");
    setOption("light");
    note(`${blend} has no light: ${shade} is off`);
  }
}

// Lights of which a mesh has no shadow.
const SHADOWLESS = ["unlit", "headlight", "lambert"];

// As settle, for a mesh: shadows are those of its surroundings' light.
function settleShadows(newest) {
  const shade = option("shade");
  if ((option("shadows") ?? "none") === "none" || !SHADOWLESS.includes(shade)) return;
  if (newest === "shade") {
    setOption("shadows", "none");
    note(`${shade} goes without shadows`);
  } else {
    setOption("shade", "auto");
    note(`shadows need the light of the surroundings: ${shade} is off`);
  }
}

function option(name) {
  return state.changes[name]?.[0] ?? state.scene.options.set[name] ?? null;
}
