// What bodies and elements look like. Lengths are in metres; `size` is that of a glyph.

import {
  BoxGeometry,
  BufferGeometry,
  CapsuleGeometry,
  ConeGeometry,
  CylinderGeometry,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  Line,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshLambertMaterial,
  SphereGeometry,
  TorusGeometry,
  Vector3,
} from "three";

/** Colours of bodies that have none; after Okabe and Ito. */
export const COLORS = ["#4a90c2", "#d98032", "#3aa37c", "#c07fa5", "#b59440", "#7f74bd", "#53a3ad", "#8a9099"];

export function lacquer(color) {
  return new MeshLambertMaterial({ color, side: DoubleSide });
}

/** Puts an object at a frame {r, p}. */
export function place(object, { r, p }) {
  object.position.set(...r);
  object.quaternion.set(p[1], p[2], p[3], p[0]);
  return object;
}

/** The z axis of a frame along what three.js draws along y. */
function alongZ(geometry) {
  return geometry.rotateX(Math.PI / 2);
}

/** A shape of a body; `null` where its kind is unknown. */
export function shape(given, color) {
  const geometry = {
    box: () => new BoxGeometry(...given.size),
    cylinder: () => alongZ(new CylinderGeometry(given.radius, given.radius, given.length, 32)),
    sphere: () => new SphereGeometry(given.radius, 32, 20),
    capsule: () => alongZ(new CapsuleGeometry(given.radius, given.length, 8, 24)),
    mesh: () => {
      const mesh = new BufferGeometry();
      mesh.setAttribute("position", new Float32BufferAttribute(given.mesh.vertices.flat(), 3));
      mesh.setIndex(given.mesh.triangles.flat());
      mesh.computeVertexNormals();
      return mesh;
    },
  }[given.kind]?.();
  return geometry ? place(new Mesh(geometry, lacquer(given.color ?? color)), given) : null;
}

/** A bar from one point to another. */
export function bar(from, to, radius, material) {
  const [a, b] = [new Vector3(...from), new Vector3(...to)];
  const along = b.clone().sub(a);
  const mesh = new Mesh(new CylinderGeometry(radius, radius, along.length(), 10), material);
  mesh.position.copy(a).addScaledVector(along, 0.5);
  mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), along.normalize());
  return mesh;
}

/** A body without shapes: a ball of at least this radius, bars from its centre of mass to the frames of its elements. */
export function skeleton(centre, frames, size, color, least) {
  const group = new Group();
  const material = lacquer(color);
  const hub = new Mesh(new SphereGeometry(Math.max(0.35 * size, least), 16, 12), material);
  hub.position.set(...centre);
  group.add(hub);
  for (const { r } of frames) {
    if (Math.hypot(...r.map((x, k) => x - centre[k])) > 1e-4 * size) group.add(bar(centre, r, 0.14 * size, material));
  }
  return group;
}

/** The glyph of an element at one of its frames, z along its axis. */
export function glyph(kind, size, color) {
  const group = new Group();
  const add = (geometry, z = 0) => {
    const mesh = new Mesh(geometry, lacquer(color));
    mesh.position.z += z;
    group.add(mesh);
    return mesh;
  };
  const disc = (radius, height, z) => add(alongZ(new CylinderGeometry(radius, radius, height, 20)), z);
  switch (kind) {
    case "hinge":
      disc(0.3 * size, 0.12 * size, 0.25 * size);
      disc(0.3 * size, 0.12 * size, -0.25 * size);
      disc(0.1 * size, 0.6 * size, 0);
      break;
    case "slider":
      add(new BoxGeometry(0.4 * size, 0.4 * size, 0.9 * size));
      break;
    case "cylinder":
      disc(0.2 * size, 1.1 * size, 0);
      break;
    case "ball":
      add(new SphereGeometry(0.3 * size, 20, 14));
      break;
    case "universal":
      add(new BoxGeometry(0.7 * size, 0.14 * size, 0.14 * size));
      add(new BoxGeometry(0.14 * size, 0.7 * size, 0.14 * size));
      break;
    case "plane":
      add(new BoxGeometry(1.2 * size, 1.2 * size, 0.04 * size));
      break;
    case "weld":
      add(new BoxGeometry(0.35 * size, 0.35 * size, 0.35 * size));
      break;
    case "gear":
      add(new TorusGeometry(0.4 * size, 0.1 * size, 6, 24));
      break;
    case "screw":
      disc(0.12 * size, 1.1 * size, 0);
      for (const z of [-0.3, -0.1, 0.1, 0.3]) add(new TorusGeometry(0.18 * size, 0.05 * size, 6, 20), z * size);
      break;
    case "torque":
      add(new TorusGeometry(0.45 * size, 0.05 * size, 8, 28, 1.5 * Math.PI));
      break;
    case "none":
    case "rod":
    case "spring":
      break;
    default: {
      const s = 0.25 * size;
      const points = [-s, 0, 0, s, 0, 0, 0, -s, 0, 0, s, 0, 0, 0, -s, 0, 0, s];
      const cross = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
      group.add(new LineSegments(cross, new LineBasicMaterial({ color })));
    }
  }
  return group;
}

/** What stretches between two points: a helix for springs, a bar for rods; unit length along z. */
export function between(kind, size, color) {
  if (kind === "rod") return bar([0, 0, 0], [0, 0, 1], 0.1 * size, lacquer(color));
  const points = [0, 0, 0];
  for (let k = 0; k <= 160; k++) {
    const angle = (k / 160) * 16 * Math.PI;
    points.push(0.22 * size * Math.cos(angle), 0.22 * size * Math.sin(angle), 0.1 + (0.8 * k) / 160);
  }
  points.push(0, 0, 1);
  const helix = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
  return new Line(helix, new LineBasicMaterial({ color }));
}

/** An arrow of unit length along z; two heads for a torque. */
export function arrow(color, heads, faint) {
  const material = new MeshLambertMaterial({ color, transparent: faint, opacity: faint ? 0.45 : 1 });
  const group = new Group();
  const shaft = new Mesh(alongZ(new CylinderGeometry(0.018, 0.018, 0.82, 10)), material);
  shaft.position.z = 0.41;
  group.add(shaft);
  for (let k = 0; k < heads; k++) {
    const head = new Mesh(alongZ(new ConeGeometry(0.06, 0.18, 14)), material);
    head.position.z = 0.91 - 0.16 * k;
    group.add(head);
  }
  return group;
}
