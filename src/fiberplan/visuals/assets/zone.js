// Where the fiber of one positioner can go: swept by alpha between the betas that bring it nearest to and farthest from
// the base. A whole turn makes a ring, less makes a sector whose sides are drawn by beta at the ends of alpha's range.
// The tip of a four-bar arm: a patchwork of small quadrangles of joint angles, less its zone of avoidance.

function patrolZone(model, i, view) {
  if (model.bars) return patchwork(model, i, view);
  const steps = 48;
  const { base, motion } = model, [offsetU, offsetV] = model.fiber.subarray(2 * i, 2 * i + 2);
  const [lowA, lowB] = model.lower.subarray(2 * i, 2 * i + 2), [highA, highB] = model.upper.subarray(2 * i, 2 * i + 2);
  const fiber = (alpha, beta) => place(2, motion.frameAt(i, alpha, beta), 0, offsetU, offsetV);
  let near = lowB, far = lowB, least = Infinity, most = -Infinity;
  for (let k = 0; k <= steps; k++) {
    const beta = lowB + ((highB - lowB) * k) / steps, [x, y] = fiber(lowA, beta);
    const radius = Math.hypot(x - base[2 * i], y - base[2 * i + 1]);
    if (radius < least) [least, near] = [radius, beta];
    if (radius > most) [most, far] = [radius, beta];
  }
  const path = new Path2D(), around = highA - lowA >= 2 * Math.PI - 0.02;
  const alpha = (part) => lowA + part * (around ? 2 * Math.PI : highA - lowA);
  const curve = (count, at, begin = false) => {
    for (let k = 0; k <= count; k++) {
      const [x, y] = at(k / count);
      path[begin && !k ? "moveTo" : "lineTo"](view.right(x), view.down(y));
    }
  };
  curve(4 * steps, (part) => fiber(alpha(part), far), true);
  if (around) path.closePath();
  else curve(steps, (part) => fiber(highA, far + part * (near - far)));
  curve(4 * steps, (part) => fiber(alpha(1 - part), near), around);
  if (!around) curve(steps, (part) => fiber(lowA, near + part * (far - near)));
  path.closePath();
  return path;
}

function patchwork(model, i, view, steps = 90) {
  const path = new Path2D(), corners = [], frame = new Float64Array(FRAME);
  const angle = (k, part) => model.lower[2 * i + k] + part * (model.upper[2 * i + k] - model.lower[2 * i + k]);
  const [shortest, longest] = model.sliders.subarray(2 * i, 2 * i + 2), length = model.bars[4 * i + 2];
  for (let a = 0; a <= steps; a++) {
    for (let b = 0; b <= steps; b++) {
      model.motion.frameAt(i, angle(0, a / steps), angle(1, b / steps), frame);
      const [x, y] = place(2, frame, 0, model.fiber[2 * i], model.fiber[2 * i + 1]), [jx, jy] = place(3, frame, 0, length, 0);
      const slider = Math.hypot(jx - frame[2], jy - frame[3]);
      corners.push(slider >= shortest && slider <= longest ? [view.right(x), view.down(y)] : null);
    }
  }
  for (let a = 0; a < steps; a++) {
    for (let b = 0; b < steps; b++) {
      const at = a * (steps + 1) + b, quad = [at, at + 1, at + steps + 2, at + steps + 1].map((k) => corners[k]);
      if (quad.includes(null)) continue;
      const [p, q, r, s] = quad, area = (r[0] - p[0]) * (s[1] - q[1]) - (s[0] - q[0]) * (r[1] - p[1]);
      const ring = area < 0 ? [s, r, q, p] : quad; // all the same way round: none may cancel another
      ring.forEach((point, k) => path[k ? "lineTo" : "moveTo"](...point));
      path.closePath();
    }
  }
  return path;
}
