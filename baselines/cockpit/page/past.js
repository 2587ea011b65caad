// Past: the last states, and where the crane is between two of them.

const KEPT = 640; // states, 12.8 s of them
const BEHIND = 30; // the picture is this much behind the newest state, so that it need not guess [ms]
const FORGET = 0.02; // by which the estimate of the fastest message gives way, each state [ms]

export class Past {
  constructor() {
    this.states = [];
    this.period = 20;
    this.offset = null;
  }

  add(state) {
    const now = performance.now();
    const last = this.states.at(-1);
    if (last && (state.time < last.time || state.tick <= last.tick)) this.clear();
    this.states.push(state);
    if (this.states.length > KEPT) this.states.splice(0, KEPT / 8);
    const offset = now - state.tick * this.period;
    this.offset = this.offset === null ? offset : Math.min(this.offset + FORGET, offset);
  }

  clear() {
    this.states.length = 0;
    this.offset = null;
  }

  get newest() {
    return this.states.at(-1) ?? null;
  }

  /** The crane's eight numbers, and where it would come to rest, at the time of the picture. */
  now() {
    const count = this.states.length;
    if (count === 0) return null;
    const tick = (performance.now() - this.offset - BEHIND) / this.period;
    let after = count - 1;
    while (after > 0 && this.states[after - 1].tick >= tick) after--;
    const b = this.states[after];
    const a = this.states[Math.max(0, after - 1)];
    const share = b.tick > a.tick ? Math.min(1, Math.max(0, (tick - a.tick) / (b.tick - a.tick))) : 1;
    const between = (x, y) => x + share * (y - x);
    return { crane: a.crane.map((x, k) => between(x, b.crane[k])), rest: between(a.rest, b.rest) };
  }
}
