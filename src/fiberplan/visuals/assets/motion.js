// Where everything is at a moment. Knots are linear in between and held outside; each positioner keeps a cursor to its
// last knot, so that playing costs a step or two per frame. Beta is measured from the alpha link: pi is folded; that of a
// four-bar arm turns its rocker, and its second link points from the elbow, J3, to the rocker's end, J4.

const FRAME = 12; // base x, y, elbow x, y, cos and sin of alpha and beta link, rocker's pivot x, y, its cos and sin
const ORIGIN = [0, 0, 2, 8], TURN = [4, 4, 6, 10]; // where in it a link's origin and direction are
const STILL = 1e-7; // [rad] a joint that turns less between two knots rests there

class Motion {
  constructor(model) {
    this.model = model;
    this.time = -1;
    this.angles = new Float64Array(2 * model.n);
    this.frames = new Float64Array(FRAME * model.n);
    this.fibers = new Float64Array(2 * model.n);
    this.cursor = model.offsets.slice(0, model.n);
  }

  // The knot before time t, and how far from it to the next: written to `found`, so that playing allocates nothing.
  locate(i, t, from, found) {
    const { times, offsets } = this.model, first = offsets[i], last = offsets[i + 1] - 1;
    let k = from;
    while (k > first && times[k] > t) k--;
    while (k < last && times[k + 1] <= t) k++;
    const span = k < last ? times[k + 1] - times[k] : 0;
    found.knot = k;
    found.part = span > 0 ? Math.min(1, Math.max(0, (t - times[k]) / span)) : 0;
  }

  anglesAt(i, t) {
    const found = {}, { angles, offsets } = this.model;
    this.locate(i, t, offsets[i], found);
    const k = found.knot, next = Math.min(k + 1, offsets[i + 1] - 1);
    const between = (a, b) => a + found.part * (b - a);
    return [0, 1].map((joint) => between(angles[2 * k + joint], angles[2 * next + joint]));
  }

  moveTo(t) {
    if (this.time === t) return;
    this.time = t;
    const { model, frames, fibers, cursor } = this, { angles, offsets, fiber } = model, found = {};
    for (let i = 0; i < model.n; i++) {
      this.locate(i, t, cursor[i], found);
      const k = (cursor[i] = found.knot), next = k + 1 < offsets[i + 1] ? k + 1 : k, at = FRAME * i;
      this.angles[2 * i] = angles[2 * k] + found.part * (angles[2 * next] - angles[2 * k]);
      this.angles[2 * i + 1] = angles[2 * k + 1] + found.part * (angles[2 * next + 1] - angles[2 * k + 1]);
      this.frameAt(i, this.angles[2 * i], this.angles[2 * i + 1], frames, at);
      const c = frames[at + 6], s = frames[at + 7], u = fiber[2 * i], v = fiber[2 * i + 1];
      fibers[2 * i] = frames[at + 2] + c * u - s * v;
      fibers[2 * i + 1] = frames[at + 3] + s * u + c * v;
    }
  }

  frameAt(i, alpha, beta, frame = new Float64Array(FRAME), at = 0) {
    const { base, length, zero, bars } = this.model;
    const first = alpha + zero[2 * i], second = first + beta + zero[2 * i + 1];
    const c = Math.cos(first), s = Math.sin(first);
    frame[at] = base[2 * i];
    frame[at + 1] = base[2 * i + 1];
    frame[at + 2] = base[2 * i] + length[i] * c;
    frame[at + 3] = base[2 * i + 1] + length[i] * s;
    frame[at + 4] = c;
    frame[at + 5] = s;
    frame[at + 6] = Math.cos(second);
    frame[at + 7] = Math.sin(second);
    if (bars) this.linkage(i, alpha, beta, frame, at);
    return frame;
  }

  linkage(i, alpha, beta, frame, at) {
    const { base, length: lengths, zero, bars } = this.model;
    const [pivotX, pivotY, length, orientation] = bars.subarray(4 * i, 4 * i + 4);
    const first = orientation + alpha + zero[2 * i], third = orientation + Math.PI - beta - zero[2 * i + 1];
    const c1 = Math.cos(first), s1 = Math.sin(first), c3 = Math.cos(third), s3 = Math.sin(third);
    const x = base[2 * i] + lengths[i] * c1, y = base[2 * i + 1] + lengths[i] * s1;
    const alongX = pivotX + length * c3 - x, alongY = pivotY + length * s3 - y, slider = Math.hypot(alongX, alongY);
    frame.set([x, y, c1, s1, alongX / slider, alongY / slider, pivotX, pivotY, c3, s3], at + 2);
  }

  frameNow(i) { return this.frames.subarray(FRAME * i, FRAME * (i + 1)); }

  // Travel of both joints up to each knot [rad], from the positioner's first.
  get travel() {
    if (this.travelled) return this.travelled;
    const { times, angles, offsets, n } = this.model, out = new Float32Array(times.length);
    for (let i = 0; i < n; i++) {
      for (let k = offsets[i] + 1; k < offsets[i + 1]; k++) {
        const turn = Math.abs(angles[2 * k] - angles[2 * k - 2]) + Math.abs(angles[2 * k + 1] - angles[2 * k - 1]);
        out[k] = out[k - 1] + turn;
      }
    }
    return (this.travelled = out);
  }

  // Part of its travel that a positioner has behind it now; NaN: it never moves.
  progress(i) {
    const { offsets, times } = this.model, { travel } = this, k = this.cursor[i], last = offsets[i + 1] - 1;
    if (!(travel[last] > STILL)) return NaN;
    if (k === last) return 1;
    const part = Math.min(1, Math.max(0, (this.time - times[k]) / (times[k + 1] - times[k])));
    return (travel[k] + part * (travel[k + 1] - travel[k])) / travel[last];
  }

  // How many positioners move: a step function, as times and the counts from each on.
  movingCounts() {
    const { times: knots, angles, offsets, n } = this.model, starts = [], stops = [];
    for (let i = 0; i < n; i++) {
      let moving = false;
      for (let k = offsets[i]; k + 1 < offsets[i + 1]; k++) {
        const moves = angles[2 * k] !== angles[2 * k + 2] || angles[2 * k + 1] !== angles[2 * k + 3];
        if (moves !== moving) (moves ? starts : stops).push(knots[k]);
        moving = moves;
      }
      if (moving) stops.push(knots[offsets[i + 1] - 1]);
    }
    const begun = Float32Array.from(starts).sort(), ended = Float32Array.from(stops).sort(), times = [0], counts = [0];
    for (let a = 0, b = 0, count = 0; b < ended.length; ) {
      const t = a < begun.length ? Math.min(begun[a], ended[b]) : ended[b];
      while (a < begun.length && begun[a] === t) a++, count++;
      while (b < ended.length && ended[b] === t) b++, count--;
      if (t > times[times.length - 1]) {
        times.push(t);
        counts.push(count);
      } else counts[counts.length - 1] = count;
    }
    return { times, counts, most: counts.reduce((a, b) => Math.max(a, b), 0) };
  }
}

// A point of a link's frame (0 fixed to the base, 1 alpha, 2 beta, 3 rocker) in focal-plane coordinates [mm].
function place(link, frames, at, u, v) {
  if (link === 0) return [frames[at] + u, frames[at + 1] + v];
  const c = frames[at + TURN[link]], s = frames[at + TURN[link] + 1], origin = at + ORIGIN[link];
  return [frames[origin] + c * u - s * v, frames[origin + 1] + s * u + c * v];
}

// The last index whose time is at or before t.
function stepBefore(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}
