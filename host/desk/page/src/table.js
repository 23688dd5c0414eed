// The table of a run, a page of rows at a time.

import { locate } from "./data.js";
import { choice, download, el } from "./dom.js";

const ROWS = 25;

export function tables(place, runs, clock) {
  let [run, first] = [runs[0], 0];
  const body = el("tbody");
  const head = el("tr");
  const status = el("span", { class: "small", role: "status" });
  const go = (to) => {
    first = Math.max(0, Math.min(to, Math.max(0, run.times.length - ROWS)));
    draw();
  };
  function draw() {
    const name = (text, unit) => el("th", { scope: "col", class: "n" }, text, unit ? el("small", {}, ` ${unit}`) : null);
    head.replaceChildren(name(run.over === "time" ? "t" : run.over, run.timeUnit), ...run.channels.map((channel) => name(channel.name, channel.unit)));
    const rows = [];
    for (let row = first; row < Math.min(first + ROWS, run.times.length); row++) {
      const cells = [run.times[row], ...run.channels.map((channel) => channel.values[row])];
      rows.push(el("tr", {}, ...cells.map((x) => el("td", { class: "n" }, String(x)))));
    }
    body.replaceChildren(...rows);
    status.textContent = run.times.length
      ? `Rows ${first + 1} to ${Math.min(first + ROWS, run.times.length)} of ${run.times.length}`
      : "No rows";
  }
  const button = (text, action) => el("button", { type: "button", onclick: action }, text);
  const bar = el(
    "div",
    { class: "bar" },
    runs.length > 1
      ? choice("Run", runs.map((r) => [String(r.index), r.name]), "0", (k) => {
          run = runs[Number(k)];
          go(0);
        })
      : null,
    button("First", () => go(0)),
    button("Back", () => go(first - ROWS)),
    button("Forward", () => go(first + ROWS)),
    button("Last", () => go(run.times.length)),
    button("At the cursor", () => go(locate(run.times, clock.now / run.inFirst)[0])),
    button("Save as CSV", () => save(run)),
    status,
  );
  const table = el("table", {}, el("caption", { class: "hidden" }, "Values of all outputs"), el("thead", {}, head), body);
  place.append(bar, el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Table" }, table));
  draw();
}

function save(run) {
  const quoted = (name) => (/[",\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name);
  const lines = [["t", ...run.channels.map((channel) => quoted(channel.name))].join(",")];
  run.times.forEach((t, row) => lines.push([t, ...run.channels.map((channel) => channel.values[row])].join(",")));
  download(`${run.name}.csv`, new Blob([lines.join("\n") + "\n"]));
}
