// The picture of one plan at a moment. What stands still is drawn once a view and kept as a bitmap; what moves goes, by
// class and thickness, into a few long paths, so that a frame costs a few dozen draw calls however many arms there are.

const BATCH = 100; // arms in a path: very long paths take longer to fill than several shorter ones
const FINE = 5; // bodies at least this thick get a rim [px]

class Scene {
  constructor(model, canvas, view, state) {
    Object.assign(this, { model, canvas, view, state, ink: canvas.getContext("2d"), layers: {} });
    this.marks = new Marks(this);
    this.bodies = [...model.bodies].sort((a, b) => (a.link === 2) - (b.link === 2) || a.link - b.link);
    this.colourBy("outcome");
    this.readColours();
  }

  colourBy(by) {
    this.colouring = new Colouring(this.model, by);
    this.layers = {};
  }

  readColours() {
    const css = getComputedStyle(document.documentElement), cache = new Map();
    this.colour = (name) => {
      if (!cache.has(name)) cache.set(name, css.getPropertyValue("--" + name).trim());
      return cache.get(name);
    };
    this.font = getComputedStyle(document.body).fontFamily;
    this.layers = {};
  }

  // The colour of a positioner, as its class has it.
  colourOf(i) { return this.colour(this.colouring.classes[this.colouring.of[i]].colour); }
  isShown(i) { return this.colouring.shown[this.colouring.of[i]]; }

  draw() {
    const { ink, view, model } = this, ratio = this.canvas.width / view.width;
    this.colouring.refresh();
    this.cull();
    ink.setTransform(1, 0, 0, 1, 0, 0);
    ink.globalAlpha = 1;
    ink.drawImage(this.layer("ground", ratio, () => this.ground()), 0, 0);
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    ink.lineCap = ink.lineJoin = "round";
    const focus = this.marks.focus();
    if (focus !== null) this.patrol(focus);
    this.alphaLinks();
    this.colouring.members.forEach((members, k) => this.arms(members, k));
    this.marks.outlines(focus);
    ink.setTransform(1, 0, 0, 1, 0, 0);
    ink.drawImage(this.layer("targets", ratio, () => drawTargets(this)), 0, 0);
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawLeashes(this);
    this.marks.draw(focus);
    this.empty = !model.boxes.some((box) => this.sees(box)) && !this.seesArms();
  }

  // Whether anything of anybody is in view; looked into where so few are near that one may look between them.
  seesArms() {
    const { model, visible, nearby } = this, { goal, motion } = model;
    if (nearby > 20 || this.view.whole) return nearby > 0;
    const inView = (i) => {
      const seen = [Infinity, Infinity, -Infinity, -Infinity], frame = motion.frameNow(i);
      for (const { points, radius } of solidsNow(model, i)) {
        for (const [x, y] of points) widen(seen, x - radius, y - radius, x + radius, y + radius);
      }
      for (const at of [0, 2]) widen(seen, frame[at], frame[at + 1], frame[at], frame[at + 1]);
      const [x, y] = goal.subarray(2 * i, 2 * i + 2);
      return this.sees(seen) || this.sees([x, y, x, y]); // no comparison holds for a target that is not a number
    };
    for (let i = 0; i < model.n; i++) if (visible[i] && inView(i)) return true;
    return false;
  }

  // A bitmap of what does not move, drawn anew when the view or what is shown changes.
  layer(name, ratio, paint) {
    const { view, canvas } = this, key = [view.x, view.y, view.scale, canvas.width, canvas.height].join();
    const kept = (this.layers[name] ??= { canvas: document.createElement("canvas") });
    if (kept.key === key) return kept.canvas;
    const screen = this.ink;
    kept.key = key;
    kept.canvas.width = canvas.width;
    kept.canvas.height = canvas.height;
    this.ink = kept.canvas.getContext("2d");
    this.ink.scale(ratio, ratio);
    this.ink.lineCap = this.ink.lineJoin = "round";
    paint();
    this.ink = screen;
    return kept.canvas;
  }

  cull() {
    const { view, model } = this, { base, reach, n } = model;
    this.visible ??= new Uint8Array(n);
    this.nearby = 0; // how many may be in view
    for (let i = 0; i < n; i++) {
      const px = view.right(base[2 * i]), py = view.down(base[2 * i + 1]), far = reach[i] * view.scale;
      this.visible[i] = px > -far && py > -far && px < view.width + far && py < view.height + far ? 1 : 0;
      this.nearby += this.visible[i];
    }
  }

  sees([left, bottom, right, top]) {
    const { view } = this;
    const beside = view.right(right) > 0 && view.right(left) < view.width;
    return beside && view.down(bottom) > 0 && view.down(top) < view.height;
  }

  stroke(width, colour, path) {
    const { ink } = this;
    ink.strokeStyle = colour;
    ink.lineWidth = Math.max(width, 0.8);
    if (path) ink.stroke(path);
    else ink.stroke();
  }

  // One arm or obstacle on its own, exactly as it is.
  solid({ shape, points, radius }, colour, extra = 0) {
    const { ink, view } = this, path = new Path2D();
    points.forEach(([x, y], k) => path[k ? "lineTo" : "moveTo"](view.right(x), view.down(y)));
    if (points.length === 1) path.lineTo(view.right(points[0][0]) + 0.01, view.down(points[0][1]));
    if (shape.closed && points.length > 2) path.closePath();
    ink.fillStyle = colour;
    if (shape.closed) ink.fill(path);
    this.stroke(2 * radius * view.scale + extra, colour, path);
  }

  // Paper, and what is fixed to the focal plane; what parts of arms may lie over is pale.
  ground() {
    const { ink, view, model } = this;
    ink.fillStyle = this.colour("paper");
    ink.fillRect(0, 0, view.width, view.height);
    model.obstacles.forEach((obstacle, k) => {
      if (!this.sees(model.boxes[k])) return;
      const [solid] = solidsNow(model, -1 - k);
      ink.globalAlpha = obstacle.over ? 0.45 : 1;
      this.solid(solid, this.colour("obstacle"));
    });
    ink.globalAlpha = 1;
  }

  alphaLinks() {
    const { ink, view, model, visible } = this, { frames } = model.motion, { x, y, scale } = view;
    const dot = Math.min(4, 0.12 * scale + 0.6), middle = view.width / 2, centre = view.height / 2;
    if (Math.max(...model.length.subarray(0, 50)) * scale < 4) return; // too short to tell from the arms
    ink.globalAlpha = 0.75;
    ink.fillStyle = this.colour("muted");
    for (let begin = 0; begin < model.n; begin += BATCH) {
      ink.beginPath();
      for (let i = begin; i < Math.min(model.n, begin + BATCH); i++) {
        if (!visible[i]) continue;
        const at = FRAME * i, px = middle + (frames[at] - x) * scale, py = centre - (frames[at + 1] - y) * scale;
        ink.moveTo(px, py);
        ink.lineTo(middle + (frames[at + 2] - x) * scale, centre - (frames[at + 3] - y) * scale);
        if (dot > 0.8) ink.fillRect(px - dot, py - dot, 2 * dot, 2 * dot);
      }
      this.stroke(Math.min(4, 0.5 * scale), this.colour("muted"));
    }
    ink.globalAlpha = 1;
  }

  // The bodies of one class, on a rim in the colour of the paper, so that arms that pass close stay apart to the eye.
  arms(members, k) {
    const { ink, view, colouring } = this, { colour, hollow } = colouring.classes[k];
    if (!members.length) return;
    ink.globalAlpha = colouring.shown[k] ? 1 : 0.1;
    for (const body of this.bodies) {
      const shade = body.link === 2 ? this.colour(colour) : this.colour("muted"), detail = detailed(body, view.scale);
      for (let begin = 0; begin < members.length; ) {
        ink.beginPath();
        const radius = radiusOf(body, members[begin]), width = 2 * radius * view.scale;
        let count = 0;
        for (; begin < members.length && count < BATCH && radiusOf(body, members[begin]) === radius; begin++) {
          if (!this.visible[members[begin]]) continue;
          this.trace(body, detail, members[begin], body.closed && (width > 0.5 || hollow));
          count++;
        }
        if (!count) continue;
        if (width > FINE) this.stroke(width + 1.6, this.colour("paper"));
        if (body.closed) {
          ink.fillStyle = shade;
          ink.fill();
        }
        if (!body.closed || width > 0.5) this.stroke(width, shade);
        if (hollow && width > FINE) {
          this.stroke(width - 3, this.colour("paper"));
          ink.fillStyle = this.colour("paper");
          if (body.closed) ink.fill();
        }
      }
    }
    if (view.scale > 2.5) this.fibers(members);
    ink.globalAlpha = 1;
  }

  // Add a body's skeleton to the path; a lone point becomes a dash too short to see, whose round ends make the disc.
  trace(body, { points, first }, i, close) {
    const { ink, view } = this, { frames } = this.model.motion, { scale } = view;
    const at = FRAME * i, row = body.shared ? 0 : i;
    const origin = at + ORIGIN[body.link], turn = at + TURN[body.link];
    const c = body.link ? frames[turn] * scale : scale, s = body.link ? frames[turn + 1] * scale : 0;
    const px = view.width / 2 + (frames[origin] - view.x) * scale;
    const py = view.height / 2 - (frames[origin + 1] - view.y) * scale;
    const begin = first[row], end = first[row + 1];
    for (let k = begin; k < end; k++) {
      const u = points[2 * k], v = points[2 * k + 1], right = px + c * u - s * v, down = py - s * u - c * v;
      if (k === begin) ink.moveTo(right, down);
      else ink.lineTo(right, down);
      if (end - begin === 1) ink.lineTo(right + 0.01, down);
    }
    if (close && end - begin > 2) ink.closePath(); // a filled path closes by itself, and faster
  }

  fibers(members) {
    const { ink, view, model, visible } = this, r = Math.min(4, 0.35 * view.scale);
    ink.beginPath();
    for (const i of members) {
      if (!visible[i]) continue;
      const px = view.right(model.motion.fibers[2 * i]), py = view.down(model.motion.fibers[2 * i + 1]);
      ink.moveTo(px + r, py);
      ink.arc(px, py, r, 0, 2 * Math.PI);
    }
    ink.fillStyle = this.colour("paper");
    ink.fill();
  }

  patrol(i) {
    const { ink, view, model } = this, path = patrolZone(model, i, view);
    ink.globalAlpha = 0.13;
    ink.fillStyle = this.colourOf(i);
    ink.fill(path, model.bars ? "nonzero" : "evenodd"); // a patchwork overlaps itself, a ring has a hole
    if (!model.bars) {
      ink.globalAlpha = 0.5;
      ink.setLineDash([4, 4]);
      this.stroke(1, this.colour("muted"), path);
      ink.setLineDash([]);
    }
    ink.globalAlpha = 1;
  }
}
