// The assembled mechanism beside the text.

import { Clock } from "../clock.js";
import { still } from "../view.js";

/** A mechanism that follows the text. */
export class Still {
  constructor(place) {
    this.place = place;
    this.view = null;
    this.marked = [];
  }

  /** Shows where everything is at the start. */
  show({ header, poses }) {
    const moving = header.bodies.flatMap((body, k) => (body.fixed ? [] : [k]));
    const motion = {
      header,
      samples: 1,
      times: new Float64Array(1),
      poses: Float32Array.from(poses.flat()),
      loads: new Float32Array(6 * header.loads.length),
      poseNumbers: 7 * moving.length,
      loadNumbers: 6 * header.loads.length,
      place: new Map(moving.map((body, k) => [body, k])),
    };
    const run = { name: "", inFirst: 1, timeUnit: header.time_unit, motion };
    if (this.view) this.view.replace([run]);
    else {
      this.place.replaceChildren();
      this.view = still(this.place, run, new Clock(0, 0));
      this.view.canvas.setAttribute("aria-label", "The mechanism as it is assembled. Dragging turns the view.");
    }
    this.light(this.marked);
  }

  /** Shows elements and bodies of these names in another colour. */
  light(names) {
    this.marked = names;
    if (!this.view) return;
    this.view.mechanisms.forEach((mechanism) => mechanism.light(names));
    this.view.request();
  }

  get ready() {
    return this.view !== null;
  }
}
