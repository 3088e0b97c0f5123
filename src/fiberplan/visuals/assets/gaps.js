// Gaps between true shapes, for what is under the pointer: polylines and filled outlines, less their radii. The proof
// is elsewhere (the certificate); these numbers are for reading, at the moment shown.

function pointToSegment(px, py, ax, ay, bx, by) {
  const dx = bx - ax, dy = by - ay;
  const square = dx * dx + dy * dy;
  const part = square > 0 ? Math.min(1, Math.max(0, ((px - ax) * dx + (py - ay) * dy) / square)) : 0;
  const x = ax + part * dx, y = ay + part * dy;
  return { gap: Math.hypot(px - x, py - y), x: (px + x) / 2, y: (py + y) / 2 };
}

function segmentToSegment(a, b) {
  const [ax, ay, bx, by] = a, [cx, cy, dx, dy] = b;
  const side = (px, py, qx, qy, rx, ry) => (qx - px) * (ry - py) - (qy - py) * (rx - px);
  const c = side(ax, ay, bx, by, cx, cy), d = side(ax, ay, bx, by, dx, dy);
  const e = side(cx, cy, dx, dy, ax, ay), f = side(cx, cy, dx, dy, bx, by);
  if (c * d < 0 && e * f < 0) {
    const part = e / (e - f);
    return { gap: 0, x: ax + part * (bx - ax), y: ay + part * (by - ay) };
  }
  return [
    pointToSegment(ax, ay, cx, cy, dx, dy),
    pointToSegment(bx, by, cx, cy, dx, dy),
    pointToSegment(cx, cy, ax, ay, bx, by),
    pointToSegment(dx, dy, ax, ay, bx, by),
  ].reduce((best, one) => (one.gap < best.gap ? one : best));
}

function segments(points, closed) {
  const count = points.length;
  if (count === 1) return [[...points[0], ...points[0]]];
  const edges = [];
  for (let k = 0; k + 1 < count; k++) edges.push([...points[k], ...points[k + 1]]);
  if (closed && count > 2) edges.push([...points[count - 1], ...points[0]]);
  return edges;
}

function inside(points, x, y) {
  let odd = false;
  for (let k = 0, j = points.length - 1; k < points.length; j = k++) {
    const [ax, ay] = points[k], [bx, by] = points[j];
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) odd = !odd;
  }
  return odd;
}

// Solid shapes of an arm: its points in focal-plane coordinates beside the shape they belong to.
function solids(model, arm, frame) {
  if (arm < 0) {
    const shape = model.obstacles[-1 - arm];
    return shape ? [{ shape, radius: shape.radius[0], points: pointsOf(shape, 0, (u, v) => [u, v]) }] : [];
  }
  return model.bodies.map((shape) => ({
    shape,
    radius: radiusOf(shape, arm),
    points: pointsOf(shape, shape.shared ? 0 : arm, (u, v) => place(shape.link, frame, 0, u, v)),
  }));
}

function pointsOf(shape, row, at) {
  const points = [];
  for (let k = shape.count * row; k < shape.count * (row + 1); k++) {
    points.push(at(shape.points[2 * k], shape.points[2 * k + 1]));
  }
  return points;
}

const solidsNow = (model, arm) => solids(model, arm, arm >= 0 ? model.motion.frameNow(arm) : null);

function solidsAt(model, arm, t) {
  return solids(model, arm, arm >= 0 ? model.motion.frameAt(arm, ...model.motion.anglesAt(arm, t)) : null);
}

const meet = (a, b) =>
  a.meets === null || b.meets === null || a.meets.includes(b.category) || b.meets.includes(a.category);

function solidToSolid(a, b) {
  let best = { gap: Infinity, x: NaN, y: NaN };
  for (const one of segments(a.points, a.shape.closed)) {
    for (const other of segments(b.points, b.shape.closed)) {
      const found = segmentToSegment(one, other);
      if (found.gap < best.gap) best = found;
    }
  }
  if (a.shape.closed && inside(a.points, ...b.points[0])) best = { gap: 0, x: b.points[0][0], y: b.points[0][1] };
  if (b.shape.closed && inside(b.points, ...a.points[0])) best = { gap: 0, x: a.points[0][0], y: a.points[0][1] };
  return { ...best, gap: best.gap - a.radius - b.radius };
}

function armToArm(first, second) {
  let best = { gap: Infinity, x: NaN, y: NaN };
  for (const a of first) {
    for (const b of second) {
      if (!meet(a.shape, b.shape)) continue;
      const found = solidToSolid(a, b);
      if (found.gap < best.gap) best = found;
    }
  }
  return best;
}

// Where two are nearest at a moment; the first one's place if they have no shapes that meet.
function spotOf(model, pair, t) {
  const [a, b] = pair.map((arm) => solidsAt(model, arm, t)), found = armToArm(a, b);
  if (Number.isFinite(found.x)) return { x: found.x, y: found.y };
  const [x, y] = model.placeOf(pair.find((arm) => arm >= 0) ?? pair[0]);
  return { x, y };
}

const NEAR = 5; // arms that could not come this close are no neighbours [mm]

function neighbours(model, i) {
  const { base, reach, n } = model, x = base[2 * i], y = base[2 * i + 1], far = reach[i] + NEAR, found = [];
  for (let j = 0; j < n; j++) {
    if (j !== i && Math.hypot(base[2 * j] - x, base[2 * j + 1] - y) < far + reach[j]) found.push(j);
  }
  model.boxes.forEach((box, k) => {
    const dx = Math.max(0, box[0] - x, x - box[2]), dy = Math.max(0, box[1] - y, y - box[3]);
    if (Math.hypot(dx, dy) < far) found.push(-1 - k);
  });
  return found;
}

function nearest(model, i) {
  const mine = solidsNow(model, i);
  let best = { gap: Infinity, arm: null };
  for (const arm of neighbours(model, i)) {
    const found = armToArm(mine, solidsNow(model, arm));
    if (found.gap < best.gap) best = { ...found, arm };
  }
  return best;
}

// Distance from a point to the body of an arm, zero inside it.
function pointToArm(model, x, y, arm) {
  let best = Infinity;
  for (const { shape, points, radius } of solidsNow(model, arm)) {
    if (shape.closed && inside(points, x, y)) return 0;
    for (const edge of segments(points, shape.closed)) {
      best = Math.min(best, Math.max(0, pointToSegment(x, y, ...edge).gap - radius));
    }
  }
  return best;
}

// The arm under a place, within `slack` [mm]: the nearest positioner, or one whose target is there, or an obstacle.
function armAt(model, x, y, slack) {
  const { base, reach, goal, n } = model;
  let best = null, least = slack;
  for (let i = 0; i < n; i++) {
    const away = Math.hypot(x - base[2 * i], y - base[2 * i + 1]);
    if (away > reach[i] + slack) continue;
    const gap = Math.min(pointToArm(model, x, y, i), away);
    if (gap < least) [best, least] = [i, gap];
  }
  if (best !== null) return best;
  for (let i = 0; i < n; i++) if (Math.hypot(x - goal[2 * i], y - goal[2 * i + 1]) < 1.6 * slack) return i;
  const fixed = model.boxes.findIndex(
    (box, k) =>
      x > box[0] - slack && x < box[2] + slack && y > box[1] - slack && y < box[3] + slack &&
      pointToArm(model, x, y, -1 - k) < slack,
  );
  return fixed < 0 ? null : -1 - fixed;
}
