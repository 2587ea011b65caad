// Hand: which buttons are held, by mouse, finger, arrow key or letter. Nothing outlives a doubt:
// blur, a hidden page, a lost pointer, a menu, all of them let go.

export const NAMES = ["forward", "backward", "up", "down"];

const KEYS = {
  ArrowRight: "forward", KeyD: "forward", ArrowLeft: "backward", KeyA: "backward",
  ArrowUp: "up", KeyW: "up", ArrowDown: "down", KeyS: "down",
};

export class Hand {
  constructor() {
    this.held = new Map(); // what holds (a key, a pointer) to the name of the button
    this.changed = () => {};
    this.stop = () => {};
    for (const button of document.querySelectorAll(".hold")) this.listen(button);
    addEventListener("keydown", (event) => this.keyDown(event), { capture: true });
    addEventListener("keyup", (event) => this.letGo(event.code), { capture: true });
    for (const name of ["blur", "pagehide", "freeze", "contextmenu"]) {
      addEventListener(name, () => this.release());
    }
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
  }

  buttons() {
    const held = new Set(this.held.values());
    return NAMES.map((name) => held.has(name));
  }

  press(what, name) {
    if (this.held.get(what) === name) return;
    this.held.set(what, name);
    this.changed();
  }

  letGo(what) {
    if (this.held.delete(what)) this.changed();
  }

  release() {
    if (this.held.size === 0) return;
    this.held.clear();
    this.changed();
  }

  listen(button) {
    const name = button.dataset.button;
    button.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      button.setPointerCapture(event.pointerId);
      this.press(event.pointerId, name);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      button.addEventListener(end, (event) => this.letGo(event.pointerId));
    }
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    button.addEventListener("keydown", (event) => {
      if (event.code !== "Space" && event.code !== "Enter") return;
      event.preventDefault();
      if (!event.repeat) this.press(event.code, name);
    });
    button.addEventListener("blur", () => {
      this.letGo("Space");
      this.letGo("Enter");
    });
  }

  keyDown(event) {
    if (document.querySelector("dialog[open]")) return;
    if (event.code === "Escape") this.stop();
    if (event.ctrlKey || event.metaKey || event.altKey) return this.release();
    const name = KEYS[event.code];
    if (!name) return;
    event.preventDefault(); // nor does it move a focused list or scroll the page
    if (!event.repeat) this.press(event.code, name);
  }
}
