// Main: puts the page together; what is shown follows the newest state, never a click by itself.

import { addBest, showBest } from "./best.js";
import { Chart } from "./charts.js";
import { Hand, NAMES } from "./hand.js";
import { Past } from "./past.js";
import { Scene } from "./scene.js";
import { Wire } from "./wire.js";

const CHARTS_EVERY = 60; // [ms]
const SLOW = 120; // [ms] between a tick and a message that names it: soon no hold lasts
const NOTES = {
  manual: "The buttons straight to the drive. Feel the swing.",
  linear: "MPC with one fixed cable length, without a sway sensor.",
  adaptive: "Linear MPC made anew from the measured cable length.",
  ltv: "A quadratic program that knows how the hoist moves.",
  "nmpc-a": "Nonlinear MPC; takes the cable to be at rest.",
  "nmpc-b": "Nonlinear MPC; goes on hoisting in its prediction.",
  lqr: "A state feedback, its gains by the cable length.",
  ppo: "A learned policy.",
};
const TASKS = {
  none: "Drive freely",
  position: "Position",
  "over-wall": "Over a wall",
  bay: "Into a bay",
  sequence: "Three in a row",
};
const TODO = {
  position: "Stop at the green mark",
  "over-wall": "Over the wall, to the green box",
  bay: "Into the bay, to the green box",
  sequence: "Stop at each green mark",
};

const $ = (id) => document.getElementById(id);
const past = new Past();
const scene = new Scene($("scene"));
const charts = [...document.querySelectorAll("[data-chart]")].map((canvas) => new Chart(canvas));
const hand = new Hand();
const wire = new Wire(hand, hear);
const page = { facts: null, building: "", failure: null, open: false, taken: false, pages: 1 };
let asked = false; // for the pendant, since the page was connected or shown
let finished = false; // the attempt whose end is on the screen
let pressed = false; // somebody has found out how to press

hand.changed = () => {
  showHeld();
  if (wire.token !== null) wire.hold();
};
hand.stop = () => wire.send({ type: "stop" });

function hear(message) {
  page.open = message.type !== "closed";
  if (message.type === "state") {
    past.add(message);
    if (message.tripped) hand.release();
  } else if (message.type === "hello") {
    page.building = message.building ?? "";
    page.failure = message.failure ?? null;
    if (message.facts) begin(message.facts);
  } else if (message.type === "pendant") {
    page.taken = message.taken;
    page.pages = message.pages;
    takeIfFree();
  } else if (message.type === "drive") {
    download(message.text);
  } else {
    asked = false;
    past.clear();
  }
}

/** The first page gets the pendant by itself. */
function takeIfFree() {
  if (asked || document.hidden || wire.token !== null) return;
  asked = true;
  if (!page.taken) wire.send({ type: "take" });
}

document.addEventListener("visibilitychange", () => {
  if (document.hidden) return;
  asked = false;
  if (page.open) takeIfFree();
});

function begin(facts) {
  page.facts = scene.facts = facts;
  past.period = 1000 * facts.period;
  chips($("controllers"), facts.controllers, (name) => name, "controller");
  chips($("tasks"), facts.tasks, (name) => TASKS[name] ?? name, "task");
  $("operator").replaceChildren(...facts.operators.map((name) => new Option(name, name)));
}

function chips(box, names, label, what) {
  box.replaceChildren(
    ...names.map((name) => {
      const chip = document.createElement("button");
      chip.textContent = label(name);
      chip.dataset.name = name;
      chip.setAttribute("role", "radio");
      chip.addEventListener("click", () => wire.command({ type: "choose", what, name }));
      return chip;
    }),
  );
}

function download(text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  link.download = `oilcrane-drive-${new Date().toISOString().slice(0, 19).replaceAll(":", "")}.json`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

$("stop").addEventListener("click", () => hand.stop());
$("resume").addEventListener("click", () => wire.command({ type: "do", action: "resume" }));
$("take").addEventListener("click", () => wire.send({ type: "take" }));
$("leave").addEventListener("click", () => wire.command({ type: "leave" }));
$("help").addEventListener("click", () => {
  hand.release();
  $("help-text").showModal();
});
$("next-task").addEventListener("click", () => wire.command({ type: "do", action: "reset" }));
$("same-task").addEventListener("click", () => wire.command({ type: "do", action: "again" }));
for (const button of document.querySelectorAll("[data-do]")) {
  button.addEventListener("click", () => wire.command({ type: "do", action: button.dataset.do }));
}
$("operator").addEventListener("change", ({ target }) => {
  wire.command({ type: "choose", what: "operator", name: target.value });
  target.blur();
});
const root = document.documentElement;
root.dataset.theme =
  localStorage.getItem("oilcrane-theme") ??
  (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
$("theme").addEventListener("click", () => {
  root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("oilcrane-theme", root.dataset.theme);
  scene.colours = null;
});

function showHeld() {
  const state = past.newest;
  const mine = hand.buttons();
  for (const button of document.querySelectorAll(".hold")) {
    const number = NAMES.indexOf(button.dataset.button);
    button.setAttribute("aria-pressed", String(mine[number]));
    button.classList.toggle("theirs", !mine[number] && Boolean(state?.buttons[number]));
  }
  pressed ||= mine.includes(true);
}

function status(state) {
  if (page.failure) return ["warn", page.failure];
  if (!page.open) return ["warn", "No connection"];
  if (!state) return ["wait", page.building ? `Building ${page.building} …` : "Getting ready …"];
  if (state.stopped) return ["stop", "Emergency stop"];
  if (wire.token === null) return ["wait", page.taken ? "Watching: another page drives" : "Watching"];
  if (state.age > SLOW) return ["warn", `Link too slow: ${state.age} ms`];
  if (state.tripped) return ["warn", "Let go, then press again"];
  if (state.replay) return ["wait", `Replay ${(state.replay[0] * page.facts.period).toFixed(1)} s`];
  if (state.replayed !== null) return ["drive", state.replayed ? "Replayed bit for bit" : "Replay differs"];
  if (state.operator !== "you") return ["wait", `${state.operator}: press to take over`];
  return ["drive", "You hold the pendant"];
}

function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function show() {
  const state = past.newest;
  const [kind, text] = status(state);
  $("status").dataset.kind = kind;
  set($("status"), text);
  const mine = wire.token !== null;
  $("take").hidden = mine || page.taken || !page.open;
  $("leave").hidden = !mine || page.pages < 2;
  if (!state) return;
  showHeld();
  $("hint").hidden = pressed || !mine || state.task !== "none";
  $("stop").parentElement.classList.toggle("latched", state.stopped);
  $("resume").hidden = !state.stopped || !mine;
  for (const [id, name] of [["controllers", state.controller], ["tasks", state.task]]) {
    for (const chip of $(id).children) {
      chip.setAttribute("aria-checked", String(chip.dataset.name === name));
      chip.disabled = !mine || (id === "controllers" && state.stopped);
    }
  }
  set($("controller-note"), NOTES[state.controller] ?? "");
  for (const control of [...document.querySelectorAll("[data-do]"), $("operator")]) {
    control.disabled = !mine;
  }
  if (document.activeElement !== $("operator")) $("operator").value = state.operator;
  $("answer").value = state.answer;
  set($("answer-text"), `${state.answer.toFixed(2)} of ${past.period} ms`);
  showTask(state);
}

function showTask(state) {
  const some = state.task !== "none";
  $("task-line").hidden = !some;
  set($("task-text"), TODO[state.task] ?? "");
  set($("task-clock"), `${state.clock.toFixed(1)} s`);
  set($("task-presses"), `${state.presses} ${state.presses === 1 ? "press" : "presses"}`);
  if (state.done && !finished) {
    const rank = state.operator === "you" && state.replayed === null && !state.replay ? addBest(state) : 0;
    const hits = state.collisions ? `, ${state.collisions} collisions` : "";
    const place = rank === 1 ? " Your best." : "";
    set($("done-text"), `Done in ${state.clock.toFixed(1)} s with ${state.presses} presses${hits}.${place}`);
  }
  finished = state.done;
  $("done").hidden = !state.done;
  if ($("best").dataset.shown !== `${state.task} ${state.done}`) {
    $("best").dataset.shown = `${state.task} ${state.done}`;
    showBest($("best"), state.task);
  }
}

let charted = 0;
function frame(now) {
  show();
  scene.draw(past.now(), past.newest);
  if (now - charted > CHARTS_EVERY && page.facts) {
    charted = now;
    for (const chart of charts) chart.draw(past.states, page.facts, (name) => scene.colour(name));
  }
  requestAnimationFrame(frame);
}
requestAnimationFrame(frame);
