// The data of a report: what `document.rs` packed.

/** Decodes the element with the data into runs. */
export async function readRuns(text) {
  const packed = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const bytes = await new Response(stream).arrayBuffer();
  const length = new DataView(bytes).getUint32(0, true);
  const content = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const start = 8 * Math.ceil((4 + length) / 8);
  const block = ({ at, count, type }) => new { f64: Float64Array, u8: Uint8Array }[type](bytes, start + at, count);
  return content.runs.map((run, index) => ({
    index,
    name: run.name,
    title: run.summary.title,
    over: run.summary.over || "time",
    parts: run.summary.parts ?? [],
    releases: run.summary.releases ?? [],
    timeUnit: run.channels[0].unit,
    secondsPerUnit: run.channels[0].si_per_unit,
    times: block(run.time),
    channels: run.channels.slice(1).map((channel, k) => ({ ...channel, values: block(run.columns[k]) })),
    events: (run.events ?? []).map(([t, element, row, kind, before, after, impulse, lost]) => ({ t, element, row, kind, before, after, impulse, lost })),
    motion: run.motion ? readMotion(block(run.motion)) : null,
  }));
}

/** A `motion.bin`: one line of JSON, then a record per sample. */
export function readMotion(bytes) {
  const end = bytes.indexOf(10);
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  const moving = header.bodies.flatMap((body, k) => (body.fixed ? [] : [k]));
  const poseNumbers = 7 * moving.length;
  const loadNumbers = 6 * header.loads.length;
  const size = 8 + 4 * (poseNumbers + loadNumbers);
  const samples = Math.floor((bytes.length - end - 1) / size);
  const view = new DataView(bytes.buffer, bytes.byteOffset + end + 1, samples * size);
  const times = new Float64Array(samples);
  const poses = new Float32Array(samples * poseNumbers);
  const loads = new Float32Array(samples * loadNumbers);
  for (let row = 0; row < samples; row++) {
    let at = row * size;
    times[row] = view.getFloat64(at, true);
    at += 8;
    for (let k = 0; k < poseNumbers; k++, at += 4) poses[row * poseNumbers + k] = view.getFloat32(at, true);
    for (let k = 0; k < loadNumbers; k++, at += 4) loads[row * loadNumbers + k] = view.getFloat32(at, true);
  }
  const place = new Map(moving.map((body, k) => [body, k]));
  return { header, samples, times, poses, loads, poseNumbers, loadNumbers, place };
}

/** The interval of ascending times that a time is in, as the index of its begin and the share that is over. */
export function locate(times, t) {
  let [low, high] = [0, times.length - 1];
  if (high < 1 || !(t > times[0])) return [0, 0];
  if (t >= times[high]) return [high, 0];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle;
  }
  return [low, (t - times[low]) / (times[high] - times[low])];
}

/** A number for people: six significant digits. */
export function short(x) {
  if (x === null || x === undefined) return "";
  if (!Number.isFinite(x)) return String(x);
  const rounded = Number(x.toPrecision(6));
  return minus(Math.abs(rounded) >= 1e9 ? rounded.toExponential() : rounded.toString());
}

/** Labels of the ticks of an axis, short and each another one, and the factor and the sum that are left out of all of them. */
export function ticked(ticks, step) {
  const known = ticks.filter(Number.isFinite);
  if (!known.length || !(step > 0)) return { labels: ticks.map(short), note: "" };
  const most = (base) => Math.max(...known.map((x) => Math.abs(x - base)));
  // Where six digits do not tell neighbours apart, labels are differences from the first.
  const base = most(0) > 1e5 * step ? known[0] : 0;
  const power = Math.floor(Math.log10(most(base) || 1) + 1e-9);
  const exponent = power >= 5 || power < -3 ? Math.max(-300, 3 * Math.floor(power / 3)) : 0;
  const scaled = known.map((x) => Math.round((x - base) / step) * step).map((x) => (exponent < 0 ? x * 10 ** -exponent : x / 10 ** exponent));
  let decimals = 0;
  const unit = step / 10 ** exponent;
  while (decimals < 9 && scaled.some((x) => Math.abs(x - Number(x.toFixed(decimals))) > 1e-3 * unit)) decimals++;
  const text = new Map(known.map((x, k) => [x, minus(String(Number(scaled[k].toFixed(decimals))))]));
  const superscript = [...String(exponent)].map((c) => "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"["-0123456789".indexOf(c)]).join("");
  const sum = base ? `${base < 0 ? "\u2212" : "+"} ${minus(String(Number(Math.abs(base).toPrecision(15))))}` : "";
  const note = [exponent ? `\u00d7 10${superscript}` : "", sum].filter(Boolean).join(" ");
  return { labels: ticks.map((x) => text.get(x) ?? ""), note };
}

function minus(text) {
  return text.replaceAll("-", "\u2212");
}
