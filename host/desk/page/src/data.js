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
  const text = Number(x.toPrecision(6)).toString();
  return text.replace("-", "\u2212");
}
