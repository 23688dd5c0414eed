import "./locale.js";
import { clockOf } from "./clock.js";
import { readRuns } from "./data.js";
import { el } from "./dom.js";
import { plots } from "./plots.js";
import { eventLists, tables } from "./table.js";
import { theme } from "./theme.js";
import { motions } from "./view.js";

async function begin() {
  const runs = await readRuns(document.getElementById("odyn-data").textContent);
  const clock = clockOf(runs);
  theme();
  // Without a graphics context the rest is shown all the same.
  const shown = { runs, clock, view: null, charts: [] };
  const place = document.getElementById("motion");
  if (place && runs.some((run) => run.motion)) {
    try {
      shown.view = motions(place, runs, clock);
    } catch (error) {
      place.append(el("p", { class: "note" }, `The motion cannot be drawn here: ${error.message}`));
    }
  }
  // Analyses may have nothing over time.
  const curves = document.getElementById("plots");
  if (curves) {
    shown.charts = plots(curves, runs, clock);
    tables(document.getElementById("table"), runs, clock);
    const events = document.getElementById("events");
    if (events) eventLists(events, runs, clock);
  }
  // For tests, and for whoever opens the console.
  window.odyn = shown;
  document.documentElement.dataset.ready = "yes";
  if (shown.view && !matchMedia("(prefers-reduced-motion: reduce)").matches) clock.play(true);
}

begin().catch((error) => {
  document.getElementById("plots")?.append(el("p", { class: "bad" }, `The data of this page cannot be read: ${error.message}`));
  throw error;
});
