// Curves over time: one chart per unit and quantity, all runs in it, one cursor for all of them and for the motion.

import uPlot from "uplot";
import style from "uplot/dist/uPlot.min.css";
import { locate, short, ticked } from "./data.js";
import { color, el, tick } from "./dom.js";

const MOST_CURVES = 8;
const HEIGHT = 260;
const LETTERS = "12px system-ui, sans-serif";
const LABELS = 13;
const ABOVE = 20;
const BELOW = { label: 22, values: 40 };

/** Draws all channels; gives the charts. */
export function plots(place, runs, clock, signal) {
  if (!document.getElementById("plot-style")) document.head.append(el("style", { id: "plot-style" }, style));
  const charts = [];
  const hosts = el("div");
  let differences = false;
  const happened = runs.flatMap((run) => run.events.map((event) => event.t * run.inFirst));
  let marked = happened.length > 0;
  const redraw = () => {
    charts.splice(0).forEach((chart) => chart.destroy());
    hosts.replaceChildren();
    for (const group of groups(runs)) charts.push(chart(hosts, group, runs, clock, differences && runs.length > 1, marked ? happened : []));
    mark(clock.now);
  };
  const reset = el("button", { type: "button", onclick: () => charts.forEach(whole) }, "Whole time");
  const hint = el("span", { class: "small" }, "Drag across a chart to zoom; the cursor moves the mechanism.");
  place.append(
    el(
      "div",
      { class: "bar" },
      reset,
      runs.length > 1
        ? tick(`Differences from ${runs[0].name}`, false, (on) => {
            differences = on;
            redraw();
          })
        : null,
      happened.length
        ? tick("Events", marked, (on) => {
            marked = on;
            redraw();
          })
        : null,
      hint,
    ),
    hosts,
  );
  const mark = (t) => {
    for (const chart of charts) chart.setCursor({ left: chart.valToPos(t, "x"), top: -10 }, false);
  };
  redraw();
  clock.listen((t, source) => source !== "chart" && mark(t));
  addEventListener("odyn-theme", redraw, { signal });
  signal?.addEventListener("abort", () => charts.splice(0).forEach((chart) => chart.destroy()));
  let waiting;
  const resize = () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => charts.forEach((chart) => chart.setSize({ width: hosts.clientWidth, height: HEIGHT })), 100);
  };
  addEventListener("resize", resize, { signal });
  return charts;
}

function whole(chart) {
  const times = chart.data[0];
  chart.setScale("x", { min: times[0], max: times[times.length - 1] });
}

/** Channels that share quantity and unit, at most so many together; the same names of all runs. */
function groups(runs) {
  const found = new Map();
  for (const run of runs) {
    for (const channel of run.channels) {
      const key = `${channel.quantity}\n${channel.unit}`;
      if (!found.has(key)) found.set(key, { quantity: channel.quantity, unit: channel.unit, names: new Set() });
      found.get(key).names.add(channel.name);
    }
  }
  return [...found.values()].flatMap((group) => {
    const names = [...group.names];
    const parts = [];
    for (let k = 0; k < names.length; k += MOST_CURVES) parts.push({ ...group, names: names.slice(k, k + MOST_CURVES) });
    return parts;
  });
}

function chart(hosts, group, runs, clock, differences, events) {
  const shown = differences ? runs.slice(1) : runs;
  const tables = shown.map((run) => tableOf(run, group, differences ? runs[0] : null));
  const data = tables.length > 1 ? uPlot.join(tables) : tables[0];
  const series = shown.flatMap((run) =>
    channelsOf(run, group).map((channel) => ({
      label: (runs.length > 1 ? `${run.name}: ${channel.name}` : channel.name) + (channel.unique ? "" : " (not unique)"),
      stroke: color(`--curve-${(group.names.indexOf(channel.name) % MOST_CURVES) + 1}`),
      width: 1.5,
      dash: run.index ? [4 + 4 * run.index, 4] : undefined,
      // Straight lines stay straight: points are not put on whole pixels.
      pxAlign: 0,
      spanGaps: true,
      points: { show: run.times.length === 1 },
      value: (_, x) => short(x),
    })),
  );
  const words = group.quantity.replaceAll("_", " ") || "value";
  const label = (differences ? "difference of " : "") + words + (group.unit ? ` [${group.unit}]` : "");
  // What the labels of an axis leave out.
  const notes = ["", ""];
  const axis = {
    stroke: color("--ink"),
    grid: { stroke: color("--grid"), width: 1 },
    ticks: { stroke: color("--grid"), width: 1 },
    font: LETTERS,
    labelFont: labels(LABELS),
    values: (_, ticks, which, space, step) => {
      const { labels, note } = ticked(ticks, step);
      notes[which] = note;
      return labels;
    },
  };
  const options = {
    width: hosts.clientWidth || 800,
    height: HEIGHT,
    scales: { x: { time: false } },
    cursor: { sync: { key: "odyn", setSeries: false }, drag: { x: true, y: false }, points: { size: 7 } },
    legend: { live: true },
    padding: [ABOVE, null, null, null],
    axes: [
      { ...axis, label: `${runs[0].over} [${runs[0].timeUnit}]`, labelSize: BELOW.label, size: BELOW.values },
      { ...axis, label, labelFont: fitting(label), labelSize: 22, size: (u, labels) => Math.max(70, 20 + widest(u.ctx, labels ?? [])) },
    ],
    series: [{ label: runs[0].over === "time" ? "t" : runs[0].over, value: (_, x) => short(x) }, ...series],
    hooks: {
      drawAxes: [(u) => lines(u, events), (u) => leftOut(u, notes)],
      setCursor: [
        (u) => {
          // Moved by a person over this chart, not by the clock or by another chart.
          if (!u.over.matches(":hover") || u.cursor.left < 0 || u.cursor.event === null) return;
          if (clock.playing) clock.play(false);
          clock.set(u.posToVal(u.cursor.left, "x"), "chart");
        },
      ],
    },
  };
  const host = el("figure", { class: "chart", "aria-label": `${label} over ${runs[0].over}: ${group.names.join(", ")}` });
  hosts.append(host);
  return new uPlot(options, data, host);
}

/** A faint line behind the curves at each time, one per pixel. */
function lines(u, times) {
  const { left, top, width, height } = u.bbox;
  const drawn = new Set(times.map((t) => Math.round(u.valToPos(t, "x", true))).filter((x) => x >= left && x <= left + width));
  u.ctx.save();
  u.ctx.strokeStyle = color("--event");
  u.ctx.lineWidth = devicePixelRatio;
  u.ctx.beginPath();
  for (const x of drawn) {
    u.ctx.moveTo(x, top);
    u.ctx.lineTo(x, top + height);
  }
  u.ctx.stroke();
  u.ctx.restore();
}

const labels = (size) => `${size}px system-ui, sans-serif`;

/** The letters in which a label beside the curves, about the middle of their height, does not reach beyond the chart. */
function fitting(label) {
  const middle = ABOVE + (HEIGHT - ABOVE - BELOW.label - BELOW.values) / 2;
  const ctx = document.createElement("canvas").getContext("2d");
  ctx.font = labels(LABELS);
  const share = (2 * middle - 4) / ctx.measureText(label).width;
  return labels(Math.floor(LABELS * Math.min(1, share)));
}

/** The width of the widest of some labels, in pixels of the page. */
function widest(ctx, labels) {
  ctx.save();
  ctx.font = LETTERS;
  const widths = labels.map((label) => ctx.measureText(label).width);
  ctx.restore();
  return Math.ceil(Math.max(0, ...widths));
}

/** What labels leave out, at the end of their axis: above that of values, right below that of times. */
function leftOut(u, [below, above]) {
  const { left, top, width, height } = u.bbox;
  u.ctx.save();
  u.ctx.scale(devicePixelRatio, devicePixelRatio);
  u.ctx.font = LETTERS;
  u.ctx.fillStyle = color("--ink");
  u.ctx.textBaseline = "bottom";
  u.ctx.textAlign = "left";
  u.ctx.fillText(above, left / devicePixelRatio, top / devicePixelRatio - 4);
  u.ctx.textAlign = "right";
  u.ctx.fillText(below, (left + width) / devicePixelRatio, (top + height) / devicePixelRatio + 54);
  u.ctx.restore();
}

function channelsOf(run, group) {
  const fits = (channel) => channel.quantity === group.quantity && channel.unit === group.unit && group.names.includes(channel.name);
  return run.channels.filter(fits);
}

function tableOf(run, group, base) {
  const times = run.inFirst === 1 ? run.times : run.times.map((t) => t * run.inFirst);
  const columns = channelsOf(run, group).map((channel) => {
    if (!base) return finite(channel.values);
    const own = base.channels.find((other) => other.name === channel.name && other.quantity === channel.quantity);
    const [first, last] = [base.times[0] * base.inFirst, base.times[base.times.length - 1] * base.inFirst];
    // Where the first run has no value there is no difference; round-off of the times is none of theirs.
    const near = 1e-9 * (last - first);
    const isThere = (t) => own && t >= first - near && t <= last + near;
    const factor = own && own.si_per_unit / channel.si_per_unit;
    return Array.from(times, (t, row) => (isThere(t) ? gap(channel.values[row] - factor * at(base, own.values, t)) : null));
  });
  return [times, ...columns];
}

/** A column as uPlot wants it: gaps where a number is not finite. */
function finite(values) {
  return values.every(Number.isFinite) ? values : Array.from(values, gap);
}

function gap(x) {
  return Number.isFinite(x) ? x : null;
}

/** A column at a time of the page, linear between samples. */
export function at(run, values, t) {
  const [row, share] = locate(run.times, t / run.inFirst);
  return share ? values[row] + share * (values[row + 1] - values[row]) : values[row];
}
