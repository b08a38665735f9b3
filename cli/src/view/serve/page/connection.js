// The socket: requests go out, pictures and answers come in.

let socket = null;
let nextId = 1;
const waiting = { thumbnails: [] };

function connect() {
  const address = new URL("socket", location.href);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.search = address.hash = "";
  socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  readingSince ??= performance.now();
  reading();
  socket.onmessage = (event) => (typeof event.data === "string" ? heard(JSON.parse(event.data)) : pictured(event.data));
  socket.onclose = lost;
}

// Time between two attempts to reach the command again, ms.
const AGAIN_MS = 1000;

let readingSince = null;
let isElsewhere = false;

// Says how long the file is being read.
function reading() {
  if (readingSince === null) return;
  const seconds = Math.floor((performance.now() - readingSince) / 1000);
  say(seconds > 0 ? `reading the file... ${seconds} s` : "reading the file...");
  setTimeout(reading, 1000);
}

// A command that was started again with the same address finds the page as it was.
function lost() {
  readingSince = null;
  asked.fill(null);
  if (isElsewhere) return;
  say("not connected: the command has ended, or the page is open elsewhere", true);
  setTimeout(connect, AGAIN_MS);
}

function openedElsewhere() {
  isElsewhere = true;
  say("the page was opened elsewhere: reload it to go on here", true);
}

function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function heard(message) {
  switch (message.type) {
    case "scene": return sceneArrived(message);
    case "function": return functionArrived(message.function);
    case "error": return say(message.text, true);
    case "elsewhere": return openedElsewhere();
    case "look": return lookArrived(message);
    case "saving": return saving(message);
    case "saved": return saved(`saved ${message.path}`);
    case "not-saved": return saved(message.text, true);
    case "progress": return progressed(message);
    case "no-thumbnail": return thumbnailFailed(message.preset);
    case "command": return showCommand(message.text);
    case "probe": return probeArrived(message.purpose, message.found);
  }
}

async function pictured(data) {
  const headLength = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, headLength)));
  const blob = new Blob([new Uint8Array(data, 4 + headLength)], { type: head.format });
  if (head.kind === "thumbnail") return thumbnailArrived(head, blob);
  if (head.kind === "slice") return sliceArrived(Number(head.name), blob);
  if (head.kind === "file") return downloaded(head.name, blob);
  try {
    const bitmap = await createImageBitmap(blob);
    show(bitmap, head, blob);
  } finally {
    send({ type: "shown", id: head.id });
  }
}
