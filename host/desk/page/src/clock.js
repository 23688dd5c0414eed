// One time for everything on the page.

/** One clock for runs, in the unit of the first; sets `inFirst` of each run, its own unit in that of the first. */
export function clockOf(runs) {
  const unit = runs[0].secondsPerUnit;
  for (const run of runs) run.inFirst = run.secondsPerUnit / unit;
  const first = Math.min(...runs.filter((run) => run.times.length).map((run) => run.times[0] * run.inFirst));
  const last = Math.max(...runs.map((run) => (run.times.at(-1) ?? 0) * run.inFirst));
  return new Clock(Number.isFinite(first) ? first : 0, last);
}

/** A time that plays, in the unit of the first run. */
export class Clock {
  constructor(from, to) {
    [this.from, this.to, this.now] = [from, to, from];
    // The whole run in eight seconds, as long as nobody chooses otherwise.
    this.natural = (to - from) / 8 || 1;
    this.speed = 1;
    this.playing = false;
    this.listeners = [];
  }

  /** Plays a part only, in two seconds. */
  within(from, to) {
    [this.from, this.to] = [from, to];
    this.natural = (to - from) / 2 || 1;
    this.set(from, "part");
  }

  /** Calls back with the time and where it came from, at once and whenever it changes. */
  listen(listener) {
    this.listeners.push(listener);
    listener(this.now, null);
  }

  set(t, source = null) {
    this.now = Math.min(Math.max(t, this.from), this.to);
    for (const listener of this.listeners) listener(this.now, source);
  }

  play(on) {
    if (on === this.playing) return;
    this.playing = on;
    if (on && this.now >= this.to) this.set(this.from);
    let last = null;
    const tick = (stamp) => {
      if (!this.playing) return;
      if (last !== null) {
        const next = this.now + ((stamp - last) / 1000) * this.natural * this.speed;
        this.set(next > this.to ? this.from : next);
      }
      last = stamp;
      requestAnimationFrame(tick);
    };
    if (on) requestAnimationFrame(tick);
    this.set(this.now, "play");
  }
}
