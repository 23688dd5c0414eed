// One run's mechanism: bodies, glyphs, arrows and traces, at any time.

import { Box3, BufferGeometry, Float32BufferAttribute, Group, Line, LineBasicMaterial, Matrix4, Quaternion, Vector3 } from "three";
import { locate } from "./data.js";
import { COLORS, arrow, between, glyph, place, shape, skeleton } from "./glyphs.js";

const UP = new Vector3(0, 0, 1);

/** How far the frames of elements on a body are from each other and from its centre of mass: the median of all bodies of some extent. */
function linkOf(header, length) {
  const apart = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));
  const places = header.bodies.map(({ centre }) => [centre]);
  for (const { body, r } of header.elements.flatMap(({ frames }) => frames)) places[body]?.push(r);
  // Beyond some frames, the farthest from the first of them will do.
  const extents = places.map((points) => Math.max(...points.slice(0, 8).flatMap((a) => points.map((b) => apart(a, b)))));
  const links = extents.filter((extent) => extent > 1e-4 * length).sort((a, b) => a - b);
  return links.length ? links[links.length >> 1] : Infinity;
}

export class Mechanism {
  /** `length`: size of the scene; `ghost`: how much of it is seen through, for runs laid over the first. */
  constructor(run, length, ghost) {
    this.run = run;
    this.motion = run.motion;
    this.link = linkOf(run.motion.header, length);
    // Of the scene, but no larger than what is between two joints, as far as that can be seen.
    this.size = Math.min(0.06 * length, Math.max(0.25 * this.link, 0.0025 * length));
    this.group = new Group();
    const { header } = this.motion;
    // What has no shape is seen from where its whole path is.
    this.way = new Box3().setFromPoints(this.extent()).getSize(new Vector3()).length();
    this.bodies = header.bodies.map((body, k) => this.body(body, k));
    this.ground = new Group();
    this.group.add(this.ground, ...this.bodies);
    this.links = [];
    // What joints and forces look like that let go, each with its time.
    this.released = [];
    header.elements.forEach((element) => this.element(element));
    this.arrows = header.loads.map((load) => this.load(load));
    this.traces = new Map();
    this.lit = [];
    if (ghost) {
      this.group.traverse((object) => {
        if (object.material) Object.assign(object.material, { transparent: true, opacity: ghost, depthWrite: false });
      });
    }
  }

  body(body, k) {
    const group = new Group();
    group.name = body.name;
    const color = COLORS[k % COLORS.length];
    const frames = this.motion.header.elements.flatMap((element) => element.frames.filter((frame) => frame.body === k));
    const shapes = body.shapes.map((given) => shape(given, color)).filter(Boolean);
    const solid = shapes.length ? shapes : [skeleton(body.centre, frames, this.size, color, Math.min(0.008 * this.way, 0.15 * this.link))];
    group.add(...solid);
    return group;
  }

  /** What belongs to a body, or to the ground. */
  carrier(body) {
    return body < 0 ? this.ground : this.bodies[body];
  }

  element(element) {
    const release = (this.run.releases ?? []).find(({ joint }) => joint === element.name);
    const drawn = (object) => release && this.released.push({ object, time: release.time });
    const shown = element.kind === "joint" ? element.frames.slice(-1) : element.frames.slice(0, 1);
    if (element.kind !== "control") {
      for (const frame of shown) {
        const body = this.motion.header.bodies[frame.body];
        // Bodies with shapes show their joints themselves.
        if (body?.shapes.length) continue;
        const object = place(glyph(element.glyph, this.size, "#8a8f98"), frame);
        this.carrier(frame.body).add(object);
        drawn(object);
      }
    }
    if (["spring", "rod"].includes(element.glyph) && element.frames.length > 1) {
      const object = between(element.glyph, this.size, "#8a8f98");
      this.group.add(object);
      drawn(object);
      this.links.push({ object, ends: element.frames.slice(0, 2) });
    }
  }

  /** Shows elements and bodies of these names in a colour that is seen through everything. */
  light(names) {
    this.lit.forEach((object) => object.removeFromParent());
    const bright = "#e8273f";
    const elements = this.motion.header.elements.filter((element) => names.includes(element.name));
    this.lit = elements.flatMap((element) =>
      element.frames.slice(-1).map((frame) => {
        const object = place(glyph(element.glyph, 1.3 * this.size, bright), frame);
        object.traverse((part) => {
          if (part.material) Object.assign(part.material, { depthTest: false, transparent: true, opacity: 0.75 });
          part.renderOrder = 1;
        });
        this.carrier(frame.body).add(object);
        return object;
      }),
    );
    this.bodies.forEach((group) => {
      const on = names.includes(group.name);
      group.traverse((part) => part.material?.emissive?.set(on ? "#7a1020" : "#000000"));
    });
  }

  load(load) {
    const [force, torque] = [
      arrow(load.kind === "reaction" ? "#d62728" : "#2ca02c", 1, !load.unique),
      arrow(load.kind === "reaction" ? "#9467bd" : "#17a2b8", 2, !load.unique),
    ];
    this.group.add(force, torque);
    return { load, force, torque, frame: this.motion.header.elements[load.element].frames[load.frame] };
  }

  /** The largest force and torque among the loads of a kind, over the whole run. */
  largest(kinds) {
    let [force, torque] = [0, 0];
    const { loads, loadNumbers, samples } = this.motion;
    this.arrows.forEach(({ load }, k) => {
      if (!kinds.includes(load.kind)) return;
      for (let row = 0; row < samples; row++) {
        const at = row * loadNumbers + 6 * k;
        force = Math.max(force, Math.hypot(loads[at], loads[at + 1], loads[at + 2]) || 0);
        torque = Math.max(torque, Math.hypot(loads[at + 3], loads[at + 4], loads[at + 5]) || 0);
      }
    });
    return { force, torque };
  }

  /** Pose of a body at a time of the page, as [position, quaternion]; between samples both are interpolated. */
  pose(body, t) {
    const k = this.motion.place.get(body);
    if (k === undefined) return [new Vector3(), new Quaternion()];
    const [row, share] = locate(this.motion.times, t / this.run.inFirst);
    const read = (at) => {
      const p = this.motion.poses.subarray(at, at + 7);
      return [new Vector3(p[0], p[1], p[2]), new Quaternion(p[4], p[5], p[6], p[3])];
    };
    const [r, q] = read(row * this.motion.poseNumbers + 7 * k);
    if (share > 0) {
      const [r1, q1] = read((row + 1) * this.motion.poseNumbers + 7 * k);
      r.lerp(r1, share);
      q.slerp(q1, share);
    }
    return [r, q];
  }

  /** A point of a body (or of the ground, -1) at a time, in ground axes. */
  point(body, r, t) {
    const [position, turn] = body < 0 ? [new Vector3(), new Quaternion()] : this.pose(body, t);
    return new Vector3(...r).applyQuaternion(turn).add(position);
  }

  /** Moves everything to a time; `show` says which arrows, and how long a newton is. */
  move(t, show) {
    this.bodies.forEach((group, k) => {
      const [r, q] = this.pose(k, t);
      group.position.copy(r);
      group.quaternion.copy(q);
    });
    for (const { object, ends } of this.links) {
      const [a, b] = ends.map((end) => this.point(end.body, end.r, t));
      stretch(object, a, b.sub(a), 1);
    }
    for (const { object, time } of this.released) object.visible = t / this.run.inFirst < time;
    const [row, share] = locate(this.motion.times, t / this.run.inFirst);
    const { loads, loadNumbers } = this.motion;
    this.arrows.forEach(({ load, force, torque, frame }, k) => {
      const wanted = show.kinds.includes(load.kind) && show.elements(load, frame);
      [force, torque].forEach((object, which) => {
        const scale = which ? show.perTorque : show.perForce;
        const at = row * loadNumbers + 6 * k + 3 * which;
        const value = (c) => loads[at + c] + (share ? share * (loads[at + loadNumbers + c] - loads[at + c]) : 0);
        const vector = new Vector3(value(0), value(1), value(2)).multiplyScalar(scale);
        object.visible = wanted && vector.length() > 0.02 * show.longest;
        if (object.visible) stretch(object, this.point(frame.body, frame.r, t), vector, null);
      });
    });
  }

  /** Shows or hides the path of a point of a body. */
  trace(key, body, r, on, color) {
    if (!on) {
      const line = this.traces.get(key);
      if (line) this.group.remove(line);
      this.traces.delete(key);
      return;
    }
    const points = [];
    for (const t of this.motion.times) points.push(...this.point(body, r, t * this.run.inFirst));
    const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
    const line = new Line(geometry, new LineBasicMaterial({ color }));
    line.frustumCulled = false;
    this.traces.set(key, line);
    this.group.add(line);
  }

  /** The motion of ground as seen from a body that stays where it was at a time. */
  seenFrom(body, start, t) {
    if (body < 0) return new Matrix4();
    const matrix = (at) => new Matrix4().compose(...this.pose(body, at), new Vector3(1, 1, 1));
    return matrix(start).multiply(matrix(t).invert());
  }

  /** Points that everything is between, over the run. */
  extent() {
    const step = Math.max(1, Math.floor(this.motion.samples / 100));
    const { bodies, elements } = this.motion.header;
    const own = bodies.map((body, k) => {
      const frames = elements.flatMap((element) => element.frames.filter((frame) => frame.body === k));
      const bare = [body.centre, ...frames.map((frame) => frame.r)].map((r) => new Vector3(...r));
      return body.shapes.length ? body.shapes.flatMap(corners) : bare;
    });
    const found = elements.flatMap((element) => element.frames.filter((frame) => frame.body < 0).map((frame) => new Vector3(...frame.r)));
    for (let row = 0; row < this.motion.samples; row += step) {
      const t = this.motion.times[row] * this.run.inFirst;
      own.forEach((points, k) => {
        const [r, q] = this.pose(k, t);
        points.forEach((point) => found.push(point.clone().applyQuaternion(q).add(r)));
      });
    }
    return found.filter((point) => Number.isFinite(point.x + point.y + point.z));
  }
}

/** The corners of the box around a shape, in the frame of its body. */
function corners({ kind, r, p, radius = 0, length = 0, size, mesh }) {
  const turn = new Quaternion(p[1], p[2], p[3], p[0]);
  const placed = (point) => point.applyQuaternion(turn).add(new Vector3(...r));
  if (mesh) {
    const numbers = mesh.vertices.flat();
    return Array.from({ length: numbers.length / 3 }, (_, k) => placed(new Vector3(...numbers.slice(3 * k, 3 * k + 3))));
  }
  const along = { cylinder: length / 2, sphere: radius, capsule: length / 2 + radius }[kind];
  const half = size ? size.map((x) => x / 2) : [radius, radius, along];
  const signs = [-1, 1];
  return signs.flatMap((x) => signs.flatMap((y) => signs.map((z) => placed(new Vector3(x * half[0], y * half[1], z * half[2])))));
}

/** Puts an object of unit length along z from a point along a vector; `width` null scales it as a whole. */
function stretch(object, from, along, width) {
  const length = along.length() || 1e-12;
  object.position.copy(from);
  object.quaternion.setFromUnitVectors(UP, along.clone().normalize());
  object.scale.set(width ?? length, width ?? length, length);
}
