// Scene: the crane from the side, to scale, with its goals, walls and the place where it would rest.

import { fitted } from "./canvas.js";

const HALL = 13.7; // from the girder to below the floor [m]
const FLOOR = 12.6; // [m] below the girder
const AROUND = 6.5; // shown on either side where the whole rail does not fit [m]
const LEAST = 21; // pixels a metre at which the whole rail fits
const TOP = 34; // room above the girder [px]
const TASK = 30; // more of it while a task is written there [px]
const APART = 0.5; // from payload to where it will rest, from which on that is named [m]
const STRIP = 24; // height of the overview [px]
const BOX = [0.9, 0.7]; // the payload [m]

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.centre = 0;
    this.facts = { rail: 20, cable: [1, 12] };
    fitted(this, () => (this.colours = null));
  }

  colour(name) {
    this.colours ??= getComputedStyle(document.documentElement);
    return this.colours.getPropertyValue(`--${name}`);
  }

  /** view: what Past.now() says; state: the newest one. */
  draw(view, state) {
    const { context: c, width, height } = this;
    c.clearRect(0, 0, width, height);
    if (!view || width === 0) return;
    const { rail } = this.facts;
    const whole = width / (2 * rail + 2.4);
    this.follows = whole < LEAST;
    this.top = TOP + (state.task === "none" ? 0 : TASK);
    const high = (height - this.top - (this.follows ? STRIP : 4)) / HALL;
    this.scale = Math.min(high, this.follows ? width / (2 * AROUND) : whole);
    const [s, , l, , theta] = view.crane;
    const half = width / this.scale / 2;
    const reach = Math.max(0, rail + 1.2 - half);
    const wanted = Math.min(reach, Math.max(-reach, this.follows ? s : 0));
    this.centre += (wanted - this.centre) * (Math.abs(wanted - this.centre) > 4 ? 1 : 0.12);
    this.x = (metres) => width / 2 + (metres - this.centre) * this.scale;
    this.y = (metres) => this.top + metres * this.scale;
    this.hall(rail);
    this.walls(state.walls);
    this.goals(state);
    this.ghost(view.rest, l, Math.abs(view.rest - s - l * Math.sin(theta)) > APART);
    this.crane(s, l, theta, state);
    if (this.follows) this.overview(s, view.rest, state);
  }

  hall(rail) {
    const { context: c, width } = this;
    c.fillStyle = this.colour("floor");
    c.fillRect(0, this.y(FLOOR), width, this.height);
    c.font = "11px system-ui";
    c.textAlign = "center";
    c.lineWidth = 1;
    for (let metres = -rail; metres <= rail; metres += 1) {
      const x = Math.round(this.x(metres)) + 0.5;
      const long = metres % 5 === 0;
      c.strokeStyle = this.colour("line");
      c.beginPath();
      c.moveTo(x, this.y(FLOOR));
      c.lineTo(x, this.y(FLOOR) + (long ? 8 : 4));
      if (long) {
        c.moveTo(x, this.y(0) + 6);
        c.lineTo(x, this.y(FLOOR));
      }
      c.stroke();
      c.fillStyle = this.colour("soft");
      if (long) c.fillText(`${metres} m`, x, this.y(FLOOR) + 17);
    }
    const left = this.x(-rail - 0.6);
    const girder = this.x(rail + 0.6) - left;
    c.fillStyle = this.colour("steel");
    c.fillRect(left, this.y(0) - 14, girder, 14);
    c.fillStyle = this.colour("steel-dark");
    c.fillRect(left, this.y(0) - 3, girder, 3);
    for (const end of [-rail - 0.6, rail + 0.2]) {
      c.fillRect(this.x(end), this.y(0) - 20, 0.4 * this.scale, 26);
    }
  }

  walls(walls) {
    const c = this.context;
    for (const [left, right, top] of walls) {
      // The payload is drawn around a point that must not enter the obstacle.
      const inset = Math.min(BOX[0] / 2, (right - left) / 2 - 0.1);
      const x = this.x(left + inset);
      const y = this.y(top + BOX[1] / 2);
      c.fillStyle = this.colour("wall");
      c.fillRect(x, y, this.x(right - inset) - x, this.y(FLOOR) - y);
      c.fillStyle = this.colour("ref");
      c.fillRect(x, y, this.x(right - inset) - x, 4);
    }
  }

  goals(state) {
    const c = this.context;
    state.goals.forEach(([position, depth, tolerance], number) => {
      if (number < state.stage || (state.done && number <= state.stage)) return;
      const x = this.x(position);
      const here = number === state.stage;
      c.globalAlpha = here ? 1 : 0.4;
      c.strokeStyle = c.fillStyle = this.colour("goal");
      c.lineWidth = 2;
      const width = Math.max(3, 2 * tolerance * this.scale);
      c.globalAlpha *= 0.25;
      c.fillRect(x - width / 2, this.y(0) + 8, width, (FLOOR * this.scale) - 8);
      c.globalAlpha = here ? 1 : 0.4;
      const y = depth === null ? this.y(FLOOR) - 4 : this.y(depth);
      const w = BOX[0] * this.scale;
      const h = BOX[1] * this.scale;
      c.setLineDash([]);
      if (depth === null) {
        c.beginPath();
        c.moveTo(x - 9, y - 16);
        c.lineTo(x + 9, y - 16);
        c.lineTo(x, y);
        c.fill();
      } else {
        c.strokeRect(x - w / 2, y - h / 2, w, h);
      }
      c.font = "600 12px system-ui";
      c.textAlign = "center";
      const label = state.goals.length > 1 ? `goal ${number + 1}` : "goal";
      if (here) c.fillText(label, x, depth === null ? y - 22 : y + h / 2 + 15);
      c.globalAlpha = 1;
    });
  }

  ghost(rest, length, named) {
    const c = this.context;
    c.strokeStyle = this.colour("payload");
    c.lineWidth = 1.5;
    c.setLineDash([5, 4]);
    c.globalAlpha = 0.75;
    const w = BOX[0] * this.scale;
    const h = BOX[1] * this.scale;
    c.strokeRect(this.x(rest) - w / 2, this.y(length) - h / 2, w, h);
    c.beginPath();
    c.moveTo(this.x(rest), this.y(length) + h / 2);
    c.lineTo(this.x(rest), this.y(FLOOR));
    c.stroke();
    c.setLineDash([]);
    c.globalAlpha = 1;
    if (!named) return;
    c.fillStyle = this.colour("payload");
    c.font = "12px system-ui";
    c.textAlign = "center";
    c.fillText("rests here", this.x(rest), this.y(length) + h / 2 + 16);
  }

  crane(s, l, theta, state) {
    const c = this.context;
    const x = this.x(s);
    const px = this.x(s + l * Math.sin(theta));
    const py = this.y(l * Math.cos(theta));
    const w = BOX[0] * this.scale;
    const h = BOX[1] * this.scale;
    c.strokeStyle = this.colour("line");
    c.lineWidth = 1;
    c.beginPath();
    c.moveTo(x, this.y(0));
    c.lineTo(x, this.y(l));
    c.stroke();
    c.strokeStyle = this.colour("cable");
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(x, this.y(0));
    c.lineTo(px, py);
    c.stroke();
    const t = Math.max(26, 1.3 * this.scale);
    c.fillStyle = this.colour("ink");
    rounded(c, x - t / 2, this.y(0) - 26, t, 18, 4);
    c.fillStyle = this.colour("steel");
    for (const side of [-0.32, 0.32]) disc(c, x + side * t, this.y(0) - 9, 5);
    disc(c, x, this.y(0), 4);
    c.save();
    c.translate(px, py);
    c.rotate(-theta);
    c.fillStyle = this.colour("payload");
    rounded(c, -w / 2, -h / 2, w, h, 4);
    c.strokeStyle = c.fillStyle = this.colour("press-ink");
    c.globalAlpha = 0.55;
    c.lineWidth = 1.5;
    c.strokeRect(-w / 2 + 4, -h / 2 + 4, w - 8, h - 8);
    c.restore();
    this.arrow(x, state.buttons);
  }

  /** What is asked for, beside the trolley: also when somebody else presses. */
  arrow(x, [forward, backward, up, down]) {
    const c = this.context;
    c.fillStyle = this.colour("ref");
    c.font = "700 17px system-ui";
    c.textAlign = "center";
    const way = (forward ? 1 : 0) - (backward ? 1 : 0);
    const hoist = (down ? 1 : 0) - (up ? 1 : 0);
    if (way) c.fillText(way > 0 ? "▶" : "◀", x + way * (0.75 * this.scale + 22), this.y(0) - 11);
    if (hoist) c.fillText(hoist > 0 ? "▼" : "▲", x - 16, this.y(0) + 26);
  }

  overview(s, rest, state) {
    const { context: c, width, height } = this;
    const { rail } = this.facts;
    const x = (metres) => width / 2 + (metres / (rail + 1)) * (width / 2 - 8);
    const y = height - STRIP / 2 + 2;
    c.fillStyle = this.colour("panel");
    c.fillRect(0, height - STRIP, width, STRIP);
    c.fillStyle = this.colour("steel");
    c.fillRect(x(-rail), y - 2, x(rail) - x(-rail), 3);
    const half = width / this.scale / 2;
    c.strokeStyle = this.colour("soft");
    c.lineWidth = 1;
    c.strokeRect(x(this.centre - half), y - 9, x(this.centre + half) - x(this.centre - half), 18);
    c.fillStyle = this.colour("goal");
    const goal = state.goals[state.stage];
    if (goal) {
      c.beginPath();
      c.moveTo(x(goal[0]) - 5, y - 9);
      c.lineTo(x(goal[0]) + 5, y - 9);
      c.lineTo(x(goal[0]), y);
      c.fill();
    }
    c.fillStyle = this.colour("payload");
    disc(c, x(s), y, 5);
  }
}

function rounded(c, x, y, width, height, radius) {
  c.beginPath();
  c.roundRect(x, y, width, height, radius);
  c.fill();
}

function disc(c, x, y, radius) {
  c.beginPath();
  c.arc(x, y, radius, 0, 2 * Math.PI);
  c.fill();
}
