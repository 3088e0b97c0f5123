// One plan as data: strings from JSON, numbers from base64 of little-endian arrays. An arm is a positioner, by its
// index, or obstacle k, by the number -1 - k, as in plan files.

const ARRAYS = {
  base: Float64Array, proven: Float64Array, bars: Float64Array, sliders: Float64Array,
  length: Float32Array, zero: Float32Array, lower: Float32Array, upper: Float32Array, fiber: Float32Array,
  reach: Float32Array, goal: Float32Array, priority: Float32Array, times: Float32Array, angles: Float32Array,
  outcome: Uint8Array, offsets: Uint32Array, provenWith: Int32Array,
};

function unpack(text, Type) {
  if (Uint8Array.fromBase64) return new Type(Uint8Array.fromBase64(text).buffer); // quicker, in newer browsers
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Type(bytes.buffer);
}

class Model {
  constructor(data) {
    Object.assign(this, data);
    for (const [key, Type] of Object.entries(ARRAYS)) if (data[key] !== undefined) this[key] = unpack(data[key], Type);
    this.n = this.ids.length;
    for (const shape of [...this.bodies, ...this.obstacles]) {
      shape.points = unpack(shape.points, Float32Array);
      shape.radius = unpack(shape.radius, Float32Array);
    }
    const { times, gaps, first, second } = data.clearances;
    this.clearances = {
      times: unpack(times, Float32Array), gaps: unpack(gaps, Float32Array),
      first: unpack(first, Int32Array), second: unpack(second, Int32Array),
    };
    this.near = {
      first: unpack(data.near.first, Int32Array), second: unpack(data.near.second, Int32Array),
      bound: unpack(data.near.bound, Float64Array),
    };
    this.index = new Map(this.ids.map((id, i) => [id, i]));
    this.lossOf = new Map(this.losses.map((loss) => [loss.positioner, loss]));
    this.end = this.times.reduce((latest, t) => Math.max(latest, t), 0); // in single precision, as the knots are
    this.boxes = this.obstacles.map(boxOf);
    this.bounds = this.extent();
    this.safe = this.certificate.ok && !this.certificate.faults.length;
  }

  outcomeOf(i) { return this.outcomes[this.outcome[i]]; }
  isLost(i) { return this.lossOf.has(i) && this.outcomeOf(i).lost; }
  blockersOf(i) { return this.lossOf.get(i)?.blockers ?? []; }
  causeOf(i) { return this.lossOf.get(i)?.cause ?? this.outcomeOf(i).meaning; }
  hasGoal(i) { return Number.isFinite(this.goal[2 * i]); }
  knows(arm) { return arm < this.n && arm >= -this.obstacles.length; }

  armName(arm) {
    return arm >= 0 ? this.ids[arm] : this.obstacles[-1 - arm]?.name ?? "obstacle " + (-1 - arm);
  }

  // The id of what an address calls a positioner: its id, also with the blank that becomes of a plus sign there, or its
  // second name; undefined if there is none.
  known(name) {
    const alias = this.aliases?.indexOf(name) ?? -1;
    return [name, name.replaceAll(" ", "+")].find((id) => this.index.has(id)) ?? this.ids[alias];
  }

  // Middle and size of the place where an arm is at work.
  placeOf(arm) {
    if (arm >= 0) return [this.base[2 * arm], this.base[2 * arm + 1], this.reach[arm]];
    const [left, bottom, right, top] = this.boxes[-1 - arm];
    return [(left + right) / 2, (bottom + top) / 2, Math.max(right - left, top - bottom, 20) / 2];
  }

  extent() {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    for (let i = 0; i < this.n; i++) {
      const x = this.base[2 * i], y = this.base[2 * i + 1], r = this.reach[i];
      widen(box, x - r, y - r, x + r, y + r);
    }
    this.boxes.forEach((other) => widen(box, ...other));
    return box;
  }
}

function widen(box, left, bottom, right, top) {
  box[0] = Math.min(box[0], left);
  box[1] = Math.min(box[1], bottom);
  box[2] = Math.max(box[2], right);
  box[3] = Math.max(box[3], top);
}

function boxOf(shape) {
  const box = [Infinity, Infinity, -Infinity, -Infinity], r = shape.radius[0];
  for (let k = 0; k < shape.count; k++) {
    const x = shape.points[2 * k], y = shape.points[2 * k + 1];
    widen(box, x - r, y - r, x + r, y + r);
  }
  return box;
}

const radiusOf = (shape, i) => shape.radius[shape.radius.length > 1 ? i : 0];

// A proven bound is rounded down, never up.
const proven = (gap) => (Math.floor(gap * 1e3 + 1e-6) / 1e3).toFixed(3) + " mm";
const millimetres = (gap) => gap.toFixed(3) + " mm";
const degrees = (angle) => ((angle * 180) / Math.PI).toFixed(2) + "\u00b0";
const tidy = (value) => String(Number(value.toPrecision(6)));
