// The table of a run and the list of its events, a page of rows at a time.

import { locate, short } from "./data.js";
import { choice, download, el } from "./dom.js";

const ROWS = 25;

/** A table of `count()` rows, of which a page is shown; `head()` and `cells(row)` give its cells, `controls` stand before the counts. */
function paged(caption, { head, count, cells }, controls) {
  let first = 0;
  const body = el("tbody");
  const top = el("tr");
  const status = el("span", { class: "small", role: "status" });
  const go = (to) => {
    first = Math.max(0, Math.min(to, Math.max(0, count() - ROWS)));
    const end = Math.min(first + ROWS, count());
    top.replaceChildren(...head());
    body.replaceChildren(...Array.from({ length: end - first }, (_, k) => el("tr", {}, ...cells(first + k))));
    status.textContent = count() ? `Rows ${first + 1} to ${end} of ${count()}` : "No rows";
  };
  const button = (text, action) => el("button", { type: "button", onclick: action }, text);
  const bar = el(
    "div",
    { class: "bar" },
    ...controls(go, button).flat(),
    button("First", () => go(0)),
    button("Back", () => go(first - ROWS)),
    button("Forward", () => go(first + ROWS)),
    button("Last", () => go(count())),
    status,
  );
  const table = el("table", {}, el("caption", { class: "hidden" }, caption), el("thead", {}, top), body);
  go(0);
  return [bar, el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": caption }, table)];
}

const title = (text, unit) => el("th", { scope: "col", class: "n" }, text, unit ? el("small", {}, ` ${unit}`) : null);
const number = (x) => el("td", { class: "n" }, x);

/** A choice among runs, where there are several. */
function chosen(runs, change) {
  if (runs.length < 2) return [];
  const names = runs.map((run, k) => [String(k), run.name]);
  return [choice("Run", names, "0", (k) => change(runs[Number(k)]))];
}

export function tables(place, runs, clock) {
  let run = runs[0];
  const rows = {
    head: () => [title(run.over === "time" ? "t" : run.over, run.timeUnit), ...run.channels.map((channel) => title(channel.name, channel.unit))],
    count: () => run.times.length,
    cells: (row) => [run.times[row], ...run.channels.map((channel) => channel.values[row])].map((x) => number(String(x))),
  };
  const controls = (go, button) => [
    chosen(runs, (to) => {
      run = to;
      go(0);
    }),
    button("At the cursor", () => go(locate(run.times, clock.now / run.inFirst)[0])),
    button("Save as CSV", () => save(run)),
  ];
  place.append(...paged("Values of all outputs", rows, controls));
}

/** What happened to contacts; its times move everything else. */
export function eventLists(place, all, clock) {
  const runs = all.filter((run) => run.events.length);
  let [run, contact] = [runs[0], ""];
  let list = run.events;
  const word = (text) => el("td", { class: "w" }, text);
  const rows = {
    head: () => [
      title("t", run.timeUnit),
      ...["contact", "row", "what"].map((text) => el("th", { scope: "col", class: "w" }, text)),
      title("rate before", "SI"),
      title("after", "SI"),
      title("impulse", "SI"),
      title("energy lost", "J"),
    ],
    count: () => list.length,
    cells: (row) => {
      const event = list[row];
      const go = () => {
        clock.play(false);
        clock.set(event.t * run.inFirst, "event");
      };
      const time = el("button", { type: "button", class: "link", onclick: go, title: "Show this time" }, short(event.t));
      const numbers = [event.before, event.after, event.impulse, event.lost];
      return [number(time), word(event.element), word(event.row), word(event.kind), ...numbers.map((x) => number(short(x)))];
    },
  };
  const contacts = el("span");
  const controls = (go) => {
    const narrow = (to) => {
      contact = to;
      list = contact ? run.events.filter((event) => event.element === contact) : run.events;
      go(0);
    };
    const names = () => {
      const known = [...new Set(run.events.map((event) => event.element))];
      contacts.replaceChildren(choice("Contact", [["", "all"], ...known.map((name) => [name, name])], "", narrow));
    };
    names();
    const other = (to) => {
      run = to;
      names();
      narrow("");
    };
    return [chosen(runs, other), contacts];
  };
  place.append(...paged("Events", rows, controls));
}

function save(run) {
  const quoted = (name) => (/[",\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name);
  const lines = [["t", ...run.channels.map((channel) => quoted(channel.name))].join(",")];
  run.times.forEach((t, row) => lines.push([t, ...run.channels.map((channel) => channel.values[row])].join(",")));
  download(`${run.name}.csv`, new Blob([lines.join("\n") + "\n"]));
}
