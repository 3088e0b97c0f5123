// Where the fiber of one positioner can go: swept by alpha between the betas that bring it nearest to and farthest from
// the base. A whole turn makes a ring, less makes a sector whose sides are drawn by beta at the ends of alpha's range.

function patrolZone(i, view) {
  const steps = 48;
  const [lowA, lowB] = plan.lower.subarray(2 * i, 2 * i + 2), [highA, highB] = plan.upper.subarray(2 * i, 2 * i + 2);
  const fiber = (alpha, beta) => place(2, frameAt(i, alpha, beta), 0, plan.fiber[2 * i], plan.fiber[2 * i + 1]);
  let near = lowB, far = lowB, least = Infinity, most = -Infinity;
  for (let k = 0; k <= steps; k++) {
    const beta = lowB + ((highB - lowB) * k) / steps, [x, y] = fiber(lowA, beta);
    const radius = Math.hypot(x - plan.base[2 * i], y - plan.base[2 * i + 1]);
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
