// How near each positioner is to another at the moment shown, in steps. Only pairs that come within the last step at
// some time are looked at, and each again only when it can have come to another step: no point of an arm is faster than
// its joints make it. A gap that is seen smaller than a proven one is a rounding of this drawing.

class ClearanceSteps {
  // `edges` [mm], ascending: a gap of at least k of them is at step k.
  constructor(model, edges) {
    Object.assign(this, { model, edges, ...model.near, fastest: fastest(model) });
    const pairs = this.bound.length;
    this.step = new Uint8Array(pairs);
    this.from = new Float64Array(pairs).fill(Infinity); // [s] from when ...
    this.until = new Float64Array(pairs).fill(-Infinity); // ... until when a pair's step is known
  }

  // The step of every positioner now, into `steps`.
  update(steps) {
    const { model, edges, first, second } = this, now = model.motion.time, shapes = new Map();
    if (now < 0) return; // nothing has been placed yet
    const shapesOf = (arm) => {
      if (!shapes.has(arm)) shapes.set(arm, solidsNow(model, arm).map((solid) => ({ ...solid, box: boxAround(solid) })));
      return shapes.get(arm);
    };
    steps.fill(edges.length);
    for (let k = 0; k < first.length; k++) {
      if (now < this.from[k] || now > this.until[k]) this.look(k, shapesOf(first[k]), shapesOf(second[k]));
      if (first[k] >= 0) steps[first[k]] = Math.min(steps[first[k]], this.step[k]);
      if (second[k] >= 0) steps[second[k]] = Math.min(steps[second[k]], this.step[k]);
    }
  }

  look(k, a, b) {
    const { edges } = this, top = edges[edges.length - 1], apart = boxesApart(a, b);
    const seen = apart > top ? apart : armToArm(a, b).gap;
    const gap = this.bound[k] < edges[0] ? seen : Math.max(this.bound[k], seen);
    this.step[k] = edges.filter((edge) => gap >= edge).length;
    const change = Math.min(...edges.map((edge) => Math.abs(gap - edge)));
    const rest = change / (this.speedOf(this.first[k]) + this.speedOf(this.second[k]));
    this.from[k] = this.model.motion.time - rest;
    this.until[k] = this.model.motion.time + rest;
  }

  speedOf(arm) { return arm < 0 ? 0 : this.fastest[arm]; }
}

// The fastest that any point of each positioner may be [mm/s]; no bound is known of a four-bar arm.
function fastest(model) {
  const { times, angles, offsets, reach, length, bars, n } = model;
  return Float64Array.from({ length: n }, (_, i) => {
    let most = 0;
    for (let k = offsets[i]; k + 1 < offsets[i + 1]; k++) {
      const [alpha, beta] = [0, 1].map((joint) => Math.abs(angles[2 * k + 2 + joint] - angles[2 * k + joint]));
      const travel = alpha * reach[i] + beta * (reach[i] + length[i]);
      if (travel > 0) most = Math.max(most, bars ? Infinity : travel / (times[k + 1] - times[k]));
    }
    return most;
  });
}

function boxAround({ points, radius }) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of points) widen(box, x - radius, y - radius, x + radius, y + radius);
  return box;
}

// A distance that two arms keep at least [mm]: that of the boxes about their bodies.
function boxesApart(first, second) {
  let least = Infinity;
  for (const { box: a, shape } of first) {
    for (const { box: b, shape: other } of second) {
      if (!meet(shape, other)) continue;
      const right = Math.max(0, a[0] - b[2], b[0] - a[2]), up = Math.max(0, a[1] - b[3], b[1] - a[3]);
      least = Math.min(least, Math.hypot(right, up));
    }
  }
  return least;
}
