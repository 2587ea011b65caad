// Charts: the last twelve seconds on strips, each with limits that grow in steps.

import { fitted } from "./canvas.js";

const SHOWN = 12; // [s]
const LEFT = 30; // room for the labels [px]
const DEGREES = 180 / Math.PI;

const velocity = ([, v, l, rate, theta, omega]) =>
  v + l * omega * Math.cos(theta) + rate * Math.sin(theta);

const CHARTS = {
  velocity: {
    steps: [1.2, 2.4, 4.8],
    lines: [["ref", (s) => s.crane[6], [5, 3]], ["payload", (s) => velocity(s.crane), []]],
  },
  sway: { steps: [3, 6, 12, 24, 48, 96], lines: [["payload", (s) => s.crane[4] * DEGREES, []]] },
  acceleration: { steps: [0.6, 1.2, 3, 6], lines: [["payload", (s) => s.acceleration, []]] },
  length: { steps: null, lines: [["payload", (s) => s.crane[2], []]] },
};

export class Chart {
  constructor(canvas) {
    this.canvas = canvas;
    this.kind = CHARTS[canvas.dataset.chart];
    this.context = canvas.getContext("2d");
    fitted(this);
  }

  draw(states, facts, colours) {
    const { context: c, width, height, kind } = this;
    c.clearRect(0, 0, width, height);
    if (states.length < 2 || height < 20) return;
    const end = states.at(-1).time;
    let first = states.length - 1;
    while (first > 0 && states[first - 1].time > end - SHOWN) first--;
    const [low, high] = this.limits(states, first, facts);
    const x = (time) => width - ((end - time) / SHOWN) * (width - LEFT);
    const y = (value) => 4 + ((high - value) / (high - low)) * (height - 8);
    c.font = "10px system-ui";
    c.textAlign = "right";
    c.textBaseline = "middle";
    c.strokeStyle = colours("line");
    c.fillStyle = colours("soft");
    c.lineWidth = 1;
    c.setLineDash([]);
    for (const value of [low, (low + high) / 2, high]) {
      const at = Math.round(y(value)) + 0.5;
      c.beginPath();
      c.moveTo(LEFT, at);
      c.lineTo(width, at);
      c.stroke();
      c.fillText(String(Math.round(value * 10) / 10), LEFT - 5, Math.min(height - 6, Math.max(6, at)));
    }
    for (const [colour, of, dash] of kind.lines) {
      c.strokeStyle = colours(colour);
      c.lineWidth = 1.8;
      c.setLineDash(dash);
      c.beginPath();
      for (let k = first; k < states.length; k++) {
        const value = Math.min(high, Math.max(low, of(states[k])));
        c.lineTo(x(states[k].time), y(value));
      }
      c.stroke();
    }
  }

  limits(states, first, facts) {
    if (this.kind.steps === null) return [0, facts.cable[1]];
    let largest = 0;
    for (let k = first; k < states.length; k++) {
      for (const [, of] of this.kind.lines) largest = Math.max(largest, Math.abs(of(states[k])));
    }
    const step = this.kind.steps.find((one) => one >= largest) ?? this.kind.steps.at(-1);
    return [-step, step];
  }
}
