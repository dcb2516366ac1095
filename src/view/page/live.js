// The connection to a simulation that runs: commands go there, frames, meshes and news come from it.

/** Milliseconds until a lost connection is tried again. */
const RETRY = 1500;

class Live {
  /** `taken` is called with each message: its kind, and what it holds. */
  constructor(taken) {
    this.taken = taken;
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}${location.pathname}stream`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.taken("connection", true);
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") {
        const message = JSON.parse(data);
        this.taken(message.kind, message);
        return;
      }
      const [head, planes] = opened(new Uint8Array(data));
      const read = { mesh: meshOf, carried: meshOf, slice: sliceOf, frame: (head, planes) => frameOf(head, planes, null) }[head.kind];
      this.taken(head.kind, read(head, planes));
      // the next frame is sent when this one has been taken
      this.send({ do: "seen" });
    };
    socket.onclose = () => {
      this.taken("connection", false);
      setTimeout(() => this.open(), RETRY);
    };
    this.socket = socket;
  }

  send(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }
}
