/* Transport over a web socket, to the server of this page; the token is that of the page. */
const address = new URL("socket", window.location.href);
address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
address.search = window.location.search;
const socket = new WebSocket(address);
const transport = { send: (message) => socket.send(JSON.stringify(message)), onmessage: null, onclose: null, polls: true };
const live = mount(document.getElementById("live"), transport);
socket.addEventListener("open", () => live.open());
socket.addEventListener("message", (event) => transport.onmessage(JSON.parse(event.data)));
socket.addEventListener("close", (event) => transport.onclose(event.reason || "The server has ended."));
