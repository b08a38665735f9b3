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
  say("reading the file...");
  socket.onmessage = (event) => (typeof event.data === "string" ? heard(JSON.parse(event.data)) : pictured(event.data));
  socket.onclose = () => say("not connected: the command has ended, or the page is open elsewhere", true);
}

function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function heard(message) {
  switch (message.type) {
    case "scene": return sceneArrived(message);
    case "function": return functionArrived(message.function);
    case "error": return say(message.text, true);
    case "elsewhere": return say("the page was opened elsewhere", true);
    case "saving": return saving(message);
    case "saved": return saved(`saved ${message.path}`);
    case "not-saved": return saved(message.text, true);
    case "progress": return progressed(message);
    case "no-thumbnail": return thumbnailFailed(message.preset);
    case "command": return showCommand(message.text);
    case "probe": return message.purpose === "scale" ? scaleFound(message.found) : probed(message.found);
  }
}

async function pictured(data) {
  const headLength = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, headLength)));
  const blob = new Blob([new Uint8Array(data, 4 + headLength)], { type: head.format });
  if (head.kind === "thumbnail") return thumbnailArrived(head, blob);
  try {
    const bitmap = await createImageBitmap(blob);
    show(bitmap, head, blob);
  } finally {
    send({ type: "shown", id: head.id });
  }
}
