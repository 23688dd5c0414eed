// The motion: a canvas with its controls.

import { Box3, Color, DirectionalLight, GridHelper, Group, HemisphereLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { short } from "./data.js";
import { choice, color, download, el, labelled, tick } from "./dom.js";
import { COLORS } from "./glyphs.js";
import { Mechanism } from "./mechanism.js";

export function motions(place, runs, clock, signal) {
  return new View(place, runs.filter((run) => run.motion && run.motion.samples), clock, { signal });
}

/** The mechanism as it stands: one sample, no controls of time. */
export function still(place, run, clock) {
  return new View(place, [run], clock, { still: true });
}

class View {
  constructor(place, runs, clock, { signal, still = false } = {}) {
    this.clock = clock;
    this.canvas = el("canvas", {
      tabindex: "0",
      role: "img",
      "aria-label": "Motion of the mechanism. Space plays, left and right arrows step, dragging turns the view.",
    });
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new Scene();
    this.world = new Group();
    this.scene.add(this.world, new HemisphereLight(0xffffff, 0x8890a0, 2.2));
    const sun = new DirectionalLight(0xffffff, 2.0);
    this.scene.add(sun);
    this.sun = sun;
    this.take(runs);
    this.show = { kinds: [], elements: () => true, perForce: 0, perTorque: 0, longest: 0.3 * this.length };
    this.scale = 1;
    this.only = null;
    this.largest = [{ force: 0, torque: 0 }];
    this.follow = -1;
    this.camera = new PerspectiveCamera(35, 4 / 3, 0.01 * this.length, 100 * this.length);
    this.orbit = new OrbitControls(this.camera, this.canvas);
    this.orbit.addEventListener("change", () => this.request());
    place.append(el("div", { class: "stage" }, this.canvas), ...(still ? [] : [this.controls(), this.details()]));
    this.background();
    const recolor = () => {
      this.background();
      this.request();
    };
    addEventListener("odyn-theme", recolor, { signal });
    signal?.addEventListener("abort", () => {
      this.renderer.dispose();
      this.renderer.forceContextLoss();
    });
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
    this.resize();
    this.frame();
    clock.listen(() => this.request());
    this.canvas.addEventListener("keydown", (event) => this.key(event));
  }

  take(runs) {
    this.length = runs[0].motion.header.length || 1;
    this.mechanisms = runs.map((run, k) => new Mechanism(run, this.length, k ? 0.35 : 0));
    this.mechanisms.forEach((mechanism) => this.world.add(mechanism.group));
  }

  /** Shows others in their place, from where one looks at the moment, unless their size is quite another. */
  replace(runs) {
    const before = this.length;
    for (const { group } of this.mechanisms) {
      this.world.remove(group);
      group.traverse((part) => {
        part.geometry?.dispose();
        part.material?.dispose();
      });
    }
    this.take(runs);
    if (Math.abs(Math.log(this.length / before)) > 0.7) this.frame();
    this.request();
  }

  /** Draws once, at the next chance. */
  request() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = null;
      this.draw();
    });
  }

  draw() {
    const t = this.clock.now;
    this.world.matrixAutoUpdate = false;
    this.world.matrix.copy(this.mechanisms[0].seenFrom(this.follow, this.clock.from, t));
    this.world.matrixWorldNeedsUpdate = true;
    this.mechanisms.forEach((mechanism) => mechanism.move(t, this.show));
    this.sun.position.copy(this.camera.position).addScaledVector(this.camera.up, this.length);
    this.renderer.render(this.scene, this.camera);
    this.drawn = (this.drawn ?? 0) + 1;
  }

  /** Pixels of a point of a body of the first run at a time, from the upper left corner of the canvas. */
  project(body, r, t) {
    this.clock.set(t);
    this.draw();
    const point = this.mechanisms[0].point(body, r, t).applyMatrix4(this.world.matrix).project(this.camera);
    const { clientWidth, clientHeight } = this.canvas;
    return [(0.5 + 0.5 * point.x) * clientWidth, (0.5 - 0.5 * point.y) * clientHeight];
  }

  /** Looks at everything, from the side that shows most of it. */
  frame() {
    const points = this.mechanisms.flatMap((mechanism) => mechanism.extent());
    const box = new Box3().setFromPoints(points);
    const [centre, size] = [box.getCenter(new Vector3()), box.getSize(new Vector3())];
    const gravity = new Vector3(...this.mechanisms[0].motion.header.gravity);
    // Planar mechanisms are looked at along their normal, a little from above and from the side.
    const sides = [size.x, size.y, size.z];
    const normal = sides.indexOf(Math.min(...sides));
    const axis = (k) => new Vector3(k === 0 ? 1 : 0, k === 1 ? 1 : 0, k === 2 ? 1 : 0);
    const view = axis(normal).multiplyScalar(normal === 1 ? -1 : 1);
    let up = gravity.length() ? gravity.negate().normalize() : axis(normal === 2 ? 1 : 2);
    if (Math.abs(up.dot(view)) > 0.9) up = axis(normal === 1 ? 2 : 1);
    const right = up.clone().cross(view);
    // Poses are numbers of 7 digits: what does not move may differ by them.
    const radius = size.length() > 1e-4 * this.length ? 0.5 * size.length() : this.length;
    const from = view.clone().addScaledVector(right, 0.3).addScaledVector(up, 0.35).normalize();
    // As near as all points allow.
    const across = up.clone().cross(from).normalize();
    const upwards = from.clone().cross(across);
    const slope = Math.tan((this.camera.fov * Math.PI) / 360);
    const needed = points.map((point) => {
      const to = point.clone().sub(centre);
      return to.dot(from) + Math.max(Math.abs(to.dot(upwards)), Math.abs(to.dot(across)) / this.camera.aspect) / slope;
    });
    const distance = 1.12 * needed.reduce((most, x) => Math.max(most, x), 0.1 * radius);
    this.camera.up.copy(up);
    this.camera.position.copy(centre).addScaledVector(from, distance);
    [this.camera.near, this.camera.far] = [distance / 100, distance * 20];
    this.camera.updateProjectionMatrix();
    this.orbit.target.copy(centre);
    this.orbit.update();
    this.floor(centre, up, radius, box);
    this.request();
  }

  floor(centre, up, radius, box) {
    if (this.grid) this.scene.remove(this.grid);
    const step = 10 ** Math.floor(Math.log10(radius));
    const cells = 2 * Math.ceil((1.5 * radius) / step);
    this.grid = new GridHelper(cells * step, Math.min(cells, 60));
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.35;
    this.grid.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), up);
    const low = [box.min, box.max].map((corner) => corner.clone().sub(centre).dot(up));
    this.grid.position.copy(centre).addScaledVector(up, Math.min(...low) - 0.02 * radius);
    this.scene.add(this.grid);
    this.background();
  }

  background() {
    this.scene.background = new Color(color("--stage"));
    this.grid?.material.color.set(color("--grid"));
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.request();
  }

  key(event) {
    const times = this.mechanisms[0].motion.times;
    const step = (times.length > 1 ? times[1] - times[0] : 0) * this.mechanisms[0].run.inFirst;
    const moves = { ArrowLeft: -step, ArrowRight: step, PageUp: -10 * step, PageDown: 10 * step };
    if (event.key === " ") this.clock.play(!this.clock.playing);
    else if (event.key in moves) {
      this.clock.play(false);
      this.clock.set(this.clock.now + moves[event.key]);
    } else if (event.key === "Home") this.clock.set(this.clock.from);
    else if (event.key === "End") this.clock.set(this.clock.to);
    else return;
    event.preventDefault();
  }

  controls() {
    const { clock } = this;
    const button = el("button", { type: "button", class: "play", onclick: () => clock.play(!clock.playing) });
    const slider = el("input", { type: "range", class: "time", min: String(clock.from), max: String(clock.to), step: "any", "aria-label": "Time" });
    slider.addEventListener("input", () => {
      clock.play(false);
      clock.set(Number(slider.value), "slider");
    });
    const unit = this.mechanisms[0].run.timeUnit;
    const now = el("output", { class: "now" });
    const { parts } = this.mechanisms[0].run;
    const only = (k) => {
      clock.within(parts[k].from, parts[k].to);
      [slider.min, slider.max] = [String(clock.from), String(clock.to)];
    };
    // Modes and equilibria are shown one at a time.
    const chosen = parts?.length ? choice("Show", parts.map((part, k) => [String(k), part.name]), "0", (k) => only(Number(k))) : null;
    if (chosen) only(0);
    clock.listen((t, source) => {
      if (source !== "slider") slider.value = String(t);
      slider.setAttribute("aria-valuetext", `${short(t)} ${unit}`);
      now.textContent = `${short(t)} ${unit}`;
      button.textContent = clock.playing ? "Pause" : "Play";
    });
    const speeds = [0.05, 0.1, 0.25, 0.5, 1, 2, 4].map((k) => [String(k), `${short(k * clock.natural)} ${unit} a second`]);
    return el("div", { class: "bar" }, chosen, button, slider, now, choice("Speed", speeds, "1", (k) => (clock.speed = Number(k))));
  }

  details() {
    const { header } = this.mechanisms[0].motion;
    const bodies = header.bodies.map((body, k) => [String(k), body.name]);
    const arrows = [["", "none"], ["reaction", "reactions"], ["force", "forces of elements"], ["reaction force", "both"]];
    const size = el("input", { type: "range", min: "-1", max: "1", step: "0.05", value: "0" });
    size.addEventListener("input", () => {
      this.scale = 10 ** Number(size.value);
      this.arrows();
    });
    const legend = el("span", { class: "small", role: "status" });
    this.legend = legend;
    const elements = header.elements.map((element, k) => [String(k), element.name]);
    const parts = [
      choice("Seen from", [["-1", "ground"], ...bodies], "-1", (k) => {
        this.follow = Number(k);
        this.request();
      }),
      choice("Arrows", arrows, "", (kinds) => {
        this.show.kinds = kinds.split(" ").filter(Boolean);
        this.largest = this.mechanisms.map((mechanism) => mechanism.largest(this.show.kinds));
        this.arrows();
      }),
      choice("of", [["", "all elements"], ...elements], "", (k) => {
        this.only = k === "" ? null : Number(k);
        this.arrows();
      }),
      labelled("Size", size),
      el("button", { type: "button", onclick: () => this.frame() }, "Whole view"),
      el("button", { type: "button", onclick: () => this.save() }, "Save picture"),
      legend,
    ];
    const hide = el("fieldset", {}, el("legend", {}, "Bodies"), ...bodies.map(([k, name]) => tick(name, true, (on) => this.hide(Number(k), on))));
    const points = [
      ...header.bodies.map((body, k) => [body.name, k, body.centre]),
      ...header.elements.flatMap((element) => {
        const frame = element.frames.at(-1);
        return element.kind === "joint" && frame && frame.body >= 0 ? [[element.name, frame.body, frame.r]] : [];
      }),
    ];
    const trace = ([name, body, r], k) =>
      tick(name, false, (on) => {
        this.mechanisms.forEach((mechanism) => mechanism.trace(`${k}`, body, r, on, COLORS[k % COLORS.length]));
        this.request();
      });
    const traces = el("fieldset", {}, el("legend", {}, "Paths of points"), ...points.map(trace));
    return el("div", {}, el("div", { class: "bar" }, ...parts), el("details", {}, el("summary", {}, "Bodies and paths"), hide, traces));
  }

  hide(body, on) {
    this.mechanisms.forEach((mechanism) => (mechanism.bodies[body].visible = on));
    this.request();
  }

  /** Arrows anew: the longest of what is shown has the length that is wanted. */
  arrows() {
    const { show, largest } = this;
    const most = (what) => Math.max(...largest.map((found) => found[what]));
    const long = show.longest * this.scale;
    show.perForce = most("force") ? long / most("force") : 0;
    show.perTorque = most("torque") ? long / most("torque") : 0;
    // What acts on the first frame of an element is the opposite of what acts on the others.
    show.elements = (load, frame) =>
      (this.only === null || load.element === this.only) && (load.frame > 0 || frame.body < 0 || this.only !== null);
    const faint = this.mechanisms[0].motion.header.loads.some((load) => !load.unique && show.kinds.includes(load.kind));
    this.legend.textContent = show.kinds.length
      ? `Longest: ${short(most("force"))} N, ${short(most("torque"))} N m (two heads).` +
        (faint ? " Faint: rigid bodies do not determine it." : "")
      : "";
    this.request();
  }

  save() {
    this.draw();
    this.canvas.toBlob((blob) => download("mechanism.png", blob));
  }
}
