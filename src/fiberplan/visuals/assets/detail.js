// As many points of a shape as can be seen: outlines lose what is smaller than half a pixel (Ramer 1972, Douglas and
// Peucker 1973). One level of detail serves all scales within a factor of two; each is made when it is first asked for.

const UNSEEN = 0.5; // an outline may be off by this [px]

// The shape's points at a scale [px/mm]: `points` of all rows, and `first`, where each row's begin.
function detailed(shape, scale) {
  const level = Math.ceil(Math.log2(scale));
  shape.levels ??= new Map();
  let found = shape.levels.get(level);
  if (!found) shape.levels.set(level, (found = reduced(shape, UNSEEN / 2 ** level)));
  return found;
}

function reduced(shape, tolerance) {
  const rows = shape.points.length / (2 * shape.count), kept = [], first = new Uint32Array(rows + 1);
  for (let row = 0; row < rows; row++) {
    const own = shape.points.subarray(2 * shape.count * row, 2 * shape.count * (row + 1));
    for (const k of corners(own, shape.count, shape.closed, tolerance)) kept.push(own[2 * k], own[2 * k + 1]);
    first[row + 1] = kept.length / 2;
  }
  return { points: Float32Array.from(kept), first };
}

// Which of a line's points matter; a closed line is cut at its first point and the one farthest from that.
function corners(points, count, closed, tolerance) {
  if (count < 3) return Array.from({ length: count }, (_, k) => k);
  const keep = new Uint8Array(count + 1);
  let ends = [0, count - 1];
  if (closed) {
    let far = 0, most = -1;
    for (let k = 1; k < count; k++) {
      const away = Math.hypot(points[2 * k] - points[0], points[2 * k + 1] - points[1]);
      if (away > most) [far, most] = [k, away];
    }
    ends = [0, far, count];
  }
  ends.forEach((k) => (keep[k] = 1));
  const open = ends.slice(1).map((end, k) => [ends[k], end]);
  while (open.length) {
    const [a, b] = open.pop(), end = b % count;
    let worst = tolerance, split = -1;
    for (let k = a + 1; k < b; k++) {
      const { gap } = pointToSegment(
        points[2 * k], points[2 * k + 1], points[2 * a], points[2 * a + 1], points[2 * end], points[2 * end + 1],
      );
      if (gap > worst) [worst, split] = [gap, k];
    }
    if (split < 0) continue;
    keep[split] = 1;
    open.push([a, split], [split, b]);
  }
  return Array.from({ length: count }, (_, k) => k).filter((k) => keep[k]);
}
