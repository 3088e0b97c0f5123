// Where everything is at a moment. Knots are linear in between and held outside; each positioner keeps a cursor to its
// last knot, so that playing costs a step or two per frame. Beta is measured from the alpha link: pi is folded; that of a
// four-bar arm turns its rocker, and its second link points from the elbow, J3, to the rocker's end, J4.

const FRAME = 12; // base x, y, elbow x, y, cos and sin of alpha and beta link, rocker's pivot x, y, its cos and sin
const cursor = plan.offsets.slice(0, n);

function anglesAt(i, t, from = plan.offsets[i]) {
  const { times, angles } = plan;
  const first = plan.offsets[i], last = plan.offsets[i + 1] - 1;
  let k = from;
  while (k > first && times[k] > t) k--;
  while (k < last && times[k + 1] <= t) k++;
  const next = Math.min(k + 1, last);
  const span = times[next] - times[k];
  const part = span > 0 ? Math.min(1, Math.max(0, (t - times[k]) / span)) : 0;
  return [
    angles[2 * k] + part * (angles[2 * next] - angles[2 * k]),
    angles[2 * k + 1] + part * (angles[2 * next + 1] - angles[2 * k + 1]),
    k,
  ];
}

function frameAt(i, alpha, beta, frame = new Float64Array(FRAME), at = 0) {
  const first = alpha + plan.zero[2 * i];
  const second = first + beta + plan.zero[2 * i + 1];
  const c = Math.cos(first), s = Math.sin(first);
  frame[at] = plan.base[2 * i];
  frame[at + 1] = plan.base[2 * i + 1];
  frame[at + 2] = plan.base[2 * i] + plan.length[i] * c;
  frame[at + 3] = plan.base[2 * i + 1] + plan.length[i] * s;
  frame[at + 4] = c;
  frame[at + 5] = s;
  frame[at + 6] = Math.cos(second);
  frame[at + 7] = Math.sin(second);
  if (plan.bars) linkage(i, alpha, beta, frame, at);
  return frame;
}

function linkage(i, alpha, beta, frame, at) {
  const [pivotX, pivotY, length, orientation] = plan.bars.subarray(4 * i, 4 * i + 4);
  const first = orientation + alpha + plan.zero[2 * i], third = orientation + Math.PI - beta - plan.zero[2 * i + 1];
  const c1 = Math.cos(first), s1 = Math.sin(first), c3 = Math.cos(third), s3 = Math.sin(third);
  const x = plan.base[2 * i] + plan.length[i] * c1, y = plan.base[2 * i + 1] + plan.length[i] * s1;
  const alongX = pivotX + length * c3 - x, alongY = pivotY + length * s3 - y, slider = Math.hypot(alongX, alongY);
  frame.set([x, y, c1, s1, alongX / slider, alongY / slider, pivotX, pivotY, c3, s3], at + 2);
}

const now = {
  time: -1,
  angles: new Float64Array(2 * n),
  frames: new Float64Array(FRAME * n),
  fibers: new Float64Array(2 * n),
};

function moveTo(t) {
  if (now.time === t) return;
  now.time = t;
  for (let i = 0; i < n; i++) {
    const [alpha, beta, k] = anglesAt(i, t, cursor[i]);
    cursor[i] = k;
    now.angles[2 * i] = alpha;
    now.angles[2 * i + 1] = beta;
    frameAt(i, alpha, beta, now.frames, FRAME * i);
    const [x, y] = place(2, now.frames, FRAME * i, plan.fiber[2 * i], plan.fiber[2 * i + 1]);
    now.fibers[2 * i] = x;
    now.fibers[2 * i + 1] = y;
  }
}

// A point of a link's frame (0 fixed to the base, 1 alpha, 2 beta, 3 rocker) in focal-plane coordinates [mm].
function place(link, frames, at, u, v) {
  if (link === 2) {
    const c = frames[at + 6], s = frames[at + 7];
    return [frames[at + 2] + c * u - s * v, frames[at + 3] + s * u + c * v];
  }
  if (link === 3) {
    const c = frames[at + 10], s = frames[at + 11];
    return [frames[at + 8] + c * u - s * v, frames[at + 9] + s * u + c * v];
  }
  if (link === 1) {
    const c = frames[at + 4], s = frames[at + 5];
    return [frames[at] + c * u - s * v, frames[at + 1] + s * u + c * v];
  }
  return [frames[at] + u, frames[at + 1] + v];
}

// How many positioners move: a step function, as times and the counts from each on.
function movingCounts() {
  const changes = [];
  for (let i = 0; i < n; i++) {
    for (let k = plan.offsets[i]; k + 1 < plan.offsets[i + 1]; k++) {
      const still = plan.angles[2 * k] === plan.angles[2 * k + 2] && plan.angles[2 * k + 1] === plan.angles[2 * k + 3];
      if (!still) changes.push([plan.times[k], 1], [plan.times[k + 1], -1]);
    }
  }
  changes.sort((a, b) => a[0] - b[0]);
  const times = [0], counts = [0];
  for (const [t, step] of changes) {
    if (t > times[times.length - 1]) {
      times.push(t);
      counts.push(counts[counts.length - 1]);
    }
    counts[counts.length - 1] += step;
  }
  return { times, counts, most: counts.reduce((a, b) => Math.max(a, b), 0) };
}

function stepBefore(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}
