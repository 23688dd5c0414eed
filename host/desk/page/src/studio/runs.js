// Runs: begun, watched, stopped, shown, compared with the one before.

import { clockOf } from "../clock.js";
import { readRuns } from "../data.js";
import { download, el, tick } from "../dom.js";
import { plots } from "../plots.js";
import { tables } from "../table.js";
import { motions } from "../view.js";
import { get, post, text as fetchText } from "./api.js";

const PAUSE = 150;

export class Runs {
  /** `handlers.messages` gets what is wrong with a text that cannot be run; `handlers.shown` is called when results are there. */
  constructor(bar, place, handlers) {
    Object.assign(this, { place, handlers, now: null, done: [], compare: false, shown: null });
    this.start = el("button", { type: "button", class: "play", onclick: () => handlers.run() }, "Run");
    this.halt = el("button", { type: "button", disabled: true, onclick: () => this.now && post(`/api/run/${this.now}/stop`).catch(() => {}) }, "Stop");
    this.progress = el("progress", { max: "1", value: "0", hidden: true, "aria-label": "Progress of the run" });
    this.words = el("span", { class: "small", role: "status" });
    bar.append(
      this.start,
      this.halt,
      this.progress,
      tick("Compare with last", false, (on) => {
        this.compare = on;
        if (this.done.length) this.show();
      }),
      this.words,
    );
    place.append(el("p", { class: "note" }, "No run yet. Run (Ctrl+Enter) shows motion, plots and table here."));
  }

  async begin(text) {
    if (this.now) return;
    this.start.disabled = true;
    this.halt.disabled = false;
    this.progress.hidden = false;
    try {
      this.now = (await post("/api/run", text)).run;
      const state = await this.watch();
      const { end } = state;
      this.handlers.messages(end.ok ? null : end.messages);
      if (end.ok) {
        this.done.push({ number: this.now, end });
        this.words.textContent = `Run ${this.now}: ${end.status}, ${end.seconds.toFixed(2)} s`;
        await this.show();
      } else this.words.textContent = `Run ${this.now}: cannot be run, see the messages`;
    } catch (error) {
      this.words.textContent = `The run failed: ${error.message}`;
      this.handlers.failed(error);
    } finally {
      this.now = null;
      this.start.disabled = false;
      this.halt.disabled = true;
      this.progress.hidden = true;
      this.progress.value = 0;
    }
  }

  async watch() {
    for (;;) {
      const state = await get(`/api/run/${this.now}`);
      this.progress.value = state.share;
      if (state.done) return state;
      this.words.textContent = `Run ${this.now}: ${Math.floor(100 * state.share)} %, ${state.seconds.toFixed(0)} s`;
      await new Promise((wait) => setTimeout(wait, PAUSE));
    }
  }

  /** The last run, with the one before if that is wanted. */
  async show() {
    const last = this.done.at(-1);
    const chosen = this.compare ? this.done.slice(-2).reverse() : [last];
    const list = chosen.map(({ number }) => number).join(",");
    const runs = await readRuns(await fetchText(`/api/data/${list}`));
    // What the last one needed is given back.
    this.shown?.abort.abort();
    const abort = new AbortController();
    const clock = clockOf(runs);
    const part = () => el("div");
    const [motion, charts, table] = [part(), part(), part()];
    const { end } = last;
    this.place.replaceChildren(
      el("p", { class: `verdict ${end.sound ? "good" : "bad"}` }, `Run ${last.number}: ${end.status}`),
      end.reason ? el("p", { class: "bad" }, end.reason) : "",
      end.failed_checks.length ? el("p", { class: "bad" }, `Failed checks: ${end.failed_checks.join(", ")}`) : "",
      el("div", { class: "bar" }, el("button", { type: "button", onclick: () => this.report(list) }, "Save report")),
      motion,
      charts,
      el("details", {}, el("summary", {}, "Table"), table),
      el("details", {}, el("summary", {}, "What the solver says"), el("pre", { tabindex: "0" }, end.text)),
    );
    // The place must be seen before charts can measure it.
    this.handlers.shown();
    let view = null;
    if (runs.some((run) => run.motion?.samples)) {
      try {
        view = motions(motion, runs, clock, abort.signal);
      } catch (error) {
        motion.append(el("p", { class: "note" }, `The motion cannot be drawn here: ${error.message}`));
      }
    }
    this.shown = { runs, clock, view, abort, charts: plots(charts, runs, clock, abort.signal) };
    tables(table, runs, clock);
  }

  /** One file for somebody else. */
  async report(list) {
    download("report.html", new Blob([await fetchText(`/api/report/${list}`)], { type: "text/html" }));
  }
}
