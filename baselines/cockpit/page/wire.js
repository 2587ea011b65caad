// Wire: the connection to the server, over which all four buttons are said every 20 ms.
//
// The timer runs on the page's main thread on purpose. When the page is hidden, stopped or busy it
// falls silent with it, and the dead-man in the control process lets go.

const INTERVAL = 20; // [ms]
const STALL = 150; // a timer that was this late has missed what the hand did meanwhile [ms]
const FULL = 1500; // so much is waiting to be sent that more would only be late [bytes]
const RETRY = 700; // [ms]

export class Wire {
  /** hand: { buttons(), release() }; hear: called with each message. */
  constructor(hand, hear) {
    this.hand = hand;
    this.hear = hear;
    this.token = null;
    this.tick = 0;
    this.said = -1;
    this.sequence = 0;
    this.last = performance.now();
    this.connect();
    setInterval(() => this.beat(), INTERVAL);
  }

  connect() {
    const key = new URLSearchParams(location.search).get("key") ?? "";
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(`${scheme}//${location.host}/wire?key=${encodeURIComponent(key)}`);
    this.socket.onmessage = (event) => this.take(JSON.parse(event.data));
    this.socket.onclose = () => {
      this.token = null;
      this.tick = 0;
      this.hand.release();
      this.hear({ type: "closed" });
      setTimeout(() => this.connect(), RETRY);
    };
  }

  take(message) {
    if (message.type === "state") this.tick = message.tick;
    if (message.type === "pendant") this.token = message.token;
    this.hear(message);
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** Something that only the holder of the pendant may say. */
  command(message) {
    if (this.token !== null) this.send({ ...message, token: this.token });
  }

  beat() {
    const now = performance.now();
    if (now - this.last > STALL) this.hand.release();
    this.last = now;
    if (this.socket.bufferedAmount > FULL) return;
    if (this.token !== null) this.hold();
    else if (this.tick !== this.said) this.send({ type: "seen", tick: this.tick });
    this.said = this.tick;
  }

  /** Says which buttons are held: with every beat, and at once when one changes. */
  hold() {
    this.command({
      type: "hold",
      sequence: this.sequence++,
      tick: this.tick,
      buttons: this.hand.buttons(),
    });
  }
}
