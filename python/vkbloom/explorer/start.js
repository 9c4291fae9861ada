// The page on its own: its messages go through a socket of the server that it came from.

import { mount } from "./page.js";

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

socket.addEventListener("open", () => {
  const page = mount(explorer, (message) => socket.send(JSON.stringify(message)));
  socket.addEventListener("message", (event) => page.receive(...unpack(event.data)));
  socket.addEventListener("close", () => page.fail("The server has stopped."));
});
socket.addEventListener("error", () => {
  if (!explorer.hasChildNodes()) explorer.textContent = "The server cannot be reached.";
});
