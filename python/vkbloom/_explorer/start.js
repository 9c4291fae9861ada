// The stand-alone page: its messages go through a socket to its server.

import { addressStore, mount } from "./page.js";

const address = new URL("socket", location.href);
address.protocol = "ws:";
const socket = new WebSocket(address);
socket.binaryType = "arraybuffer";

const explorer = document.getElementById("explorer");

function unpack(data) {
  const length = new DataView(data).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  let offset = 4 + length;
  const buffers = message.buffers.map((size) => {
    offset += size;
    return new Uint8Array(data, offset - size, size);
  });
  return [message, buffers];
}

// The server's message format: the header's length, the header, the file.
function pack(message, [file]) {
  const header = new TextEncoder().encode(JSON.stringify(message));
  const packed = new Uint8Array(4 + header.length + file.length);
  new DataView(packed.buffer).setUint32(0, header.length, true);
  packed.set(header, 4);
  packed.set(file, 4 + header.length);
  return packed;
}

socket.addEventListener("open", () => {
  const send = (message, files = []) =>
    socket.send(files.length ? pack(message, files) : JSON.stringify(message));
  const page = mount(explorer, send, { store: addressStore, heading: "h1" });
  socket.addEventListener("message", (event) => page.receive(...unpack(event.data)));
  socket.addEventListener("close", () => page.fail("The server has stopped."));
});
socket.addEventListener("error", () => {
  if (!explorer.hasChildNodes()) explorer.textContent = "The server cannot be reached.";
});
