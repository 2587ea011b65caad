// Best: a table of the best attempts at each task, kept in this browser alone.

const KEPT = 5;
const PLACE = "oilcrane-best";

function all() {
  try {
    return JSON.parse(localStorage.getItem(PLACE)) ?? {};
  } catch {
    return {};
  }
}

/** Adds an attempt; returns its rank from 1, or 0 if it is none of the best. */
export function addBest({ task, score, presses, controller }) {
  const tables = all();
  const mine = { score, presses, controller };
  const table = [...(tables[task] ?? []), mine].sort((a, b) => a.score - b.score).slice(0, KEPT);
  tables[task] = table;
  try {
    localStorage.setItem(PLACE, JSON.stringify(tables));
  } catch {
    return 0; // a browser that keeps nothing
  }
  return table.indexOf(mine) + 1;
}

export function showBest(table, task) {
  const rows = all()[task] ?? [];
  table.hidden = rows.length === 0;
  table.tBodies[0].replaceChildren(
    ...rows.map((row) => {
      const line = document.createElement("tr");
      for (const text of [`${row.score.toFixed(1)} s`, row.presses, row.controller]) {
        line.insertCell().textContent = text;
      }
      return line;
    }),
  );
}
