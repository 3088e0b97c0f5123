// The picture at a moment. Everything of one outcome and one thickness goes into one path, stroked with round ends as
// wide as the body is thick, so that a frame costs a few dozen draw calls however many positioners there are.

const BATCH = 200; // arms in a path: very long paths take longer to fill than several shorter ones

class Scene {
  constructor(canvas, view, state) {
    Object.assign(this, { canvas, view, state, ink: canvas.getContext("2d") });
    this.contacts = [...plan.certificate.contacts, ...plan.certificate.undecided].map((contact) => {
      const [a, b] = contact.pair.map((arm) => solidsAt(arm, contact.time));
      return { ...contact, ...spotOf(armToArm(a, b), contact.pair) };
    });
    this.readColours();
  }

  readColours() {
    const css = getComputedStyle(document.documentElement);
    const colour = (name) => css.getPropertyValue("--" + name).trim();
    this.font = getComputedStyle(document.body).fontFamily;
    const names = ["contact", "ink", "muted", "paper", "obstacle"];
    this.colours = Object.fromEntries(names.map((name) => [name, colour(name)]));
    this.outcomes = plan.outcomes.map((outcome) => colour(outcome.key));
  }

  draw() {
    const { ink, view, colours } = this;
    const ratio = this.canvas.width / view.width;
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    ink.globalAlpha = 1;
    ink.lineCap = ink.lineJoin = "round";
    ink.fillStyle = colours.paper;
    ink.fillRect(0, 0, view.width, view.height);
    this.visible = this.cull();
    this.obstacles();
    const focus = this.state.hovered ?? this.state.selected;
    if (focus !== null) this.patrol(focus);
    this.alphaLinks();
    groups.forEach((members, o) => this.arms(members, o));
    if (focus !== null) blockersOf(focus).forEach((arm) => this.outline(arm, colours.contact, undefined, 4));
    for (const i of new Set([this.state.hovered, this.state.selected])) if (i !== null) this.outline(i, colours.ink);
    groups.forEach((members, o) => this.goals(members, o));
    this.touching();
    this.names();
    this.ruler();
  }

  cull() {
    const { view } = this, seen = new Uint8Array(n);
    for (let i = 0; i < n; i++) {
      const px = view.right(plan.base[2 * i]), py = view.down(plan.base[2 * i + 1]), far = plan.reach[i] * view.scale;
      seen[i] = px > -far && py > -far && px < view.width + far && py < view.height + far ? 1 : 0;
    }
    return seen;
  }

  // Add a shape's skeleton to a path; a lone point becomes a dash too short to see, whose round ends make the disc.
  trace(path, points, closed) {
    const { view } = this;
    points.forEach(([x, y], k) => path[k ? "lineTo" : "moveTo"](view.right(x), view.down(y)));
    if (points.length === 1) path.lineTo(view.right(points[0][0]) + 0.01, view.down(points[0][1]));
    if (closed && points.length > 2) path.closePath();
  }

  paint(path, width, colour, filled) {
    const { ink } = this;
    ink.strokeStyle = ink.fillStyle = colour;
    ink.lineWidth = Math.max(width, 0.8);
    if (filled) ink.fill(path);
    ink.stroke(path);
  }

  solid({ shape, points, radius }, colour, extra = 0) {
    const path = new Path2D();
    this.trace(path, points, shape.closed);
    this.paint(path, 2 * radius * this.view.scale + extra, colour, shape.closed);
  }

  obstacles() {
    plan.obstacles.forEach((_, k) => {
      for (const solid of solidsNow(-1 - k)) this.solid(solid, this.colours.obstacle);
    });
  }

  alphaLinks() {
    const { ink, view, colours, visible } = this, frames = now.frames;
    const dot = Math.min(4, 0.12 * view.scale + 0.6);
    let links = new Path2D(), count = 0;
    const flush = () => {
      ink.globalAlpha = 0.75;
      this.paint(links, Math.min(4, 0.5 * view.scale), colours.muted, false);
      ink.globalAlpha = 1;
      links = new Path2D();
    };
    for (let i = 0; i < n; i++) {
      if (!visible[i]) continue;
      const at = FRAME * i, px = view.right(frames[at]), py = view.down(frames[at + 1]);
      links.moveTo(px, py);
      links.lineTo(view.right(frames[at + 2]), view.down(frames[at + 3]));
      ink.fillStyle = colours.muted;
      if (dot > 0.8) ink.fillRect(px - dot, py - dot, 2 * dot, 2 * dot);
      if (++count % BATCH === 0) flush();
    }
    flush();
  }

  // The bodies of one outcome, on a rim in the colour of the paper, so that arms that pass close stay apart to the eye.
  arms(members, o) {
    const { ink, view, colours, visible, state } = this;
    const hollow = plan.outcomes[o].key === "offline";
    ink.globalAlpha = state.shown[o] ? 1 : 0.1;
    for (const body of [...plan.bodies].sort((a, b) => (a.link === 2) - (b.link === 2) || a.link - b.link)) {
      const batches = [], latest = new Map();
      for (const i of members) {
        if (!visible[i]) continue;
        const radius = radiusOf(body, i);
        let batch = latest.get(radius);
        if (!batch || batch.count === BATCH) {
          batch = { radius, count: 0, path: new Path2D() };
          batches.push(batch);
          latest.set(radius, batch);
        }
        batch.count++;
        const points = listed(body, body.shared ? 0 : i, (u, v) => place(body.link, now.frames, FRAME * i, u, v));
        this.trace(batch.path, points, body.closed);
      }
      for (const { radius, path } of batches) {
        const width = 2 * radius * view.scale;
        if (width > 5) this.paint(path, width + 1.6, colours.paper, false);
        this.paint(path, width, body.link === 2 ? this.outcomes[o] : colours.muted, body.closed);
        if (hollow && width > 5) this.paint(path, width - 3, colours.paper, body.closed);
      }
    }
    if (view.scale > 2.5) this.fibers(members);
    ink.globalAlpha = 1;
  }

  fibers(members) {
    const { ink, view, colours, visible } = this, dots = new Path2D(), r = Math.min(4, 0.35 * view.scale);
    for (const i of members) {
      if (!visible[i]) continue;
      const px = view.right(now.fibers[2 * i]), py = view.down(now.fibers[2 * i + 1]);
      dots.moveTo(px + r, py);
      dots.arc(px, py, r, 0, 2 * Math.PI);
    }
    ink.fillStyle = colours.paper;
    ink.fill(dots);
  }

  // Targets: a thin ring (a speck from afar), or a bold cross and a dotted line to its fiber where the target is lost.
  goals(members, o) {
    const { ink, view, colours, visible, state } = this, gone = plan.outcomes[o].lost, afar = view.scale < 1.5;
    const path = new Path2D(), leash = new Path2D(), r = Math.min(7, Math.max(gone ? 4.5 : 1.5, 0.7 * view.scale));
    ink.globalAlpha = state.shown[o] ? 1 : 0.1;
    ink.fillStyle = colours.ink;
    for (const i of members) {
      if (!visible[i] || !hasGoal(i)) continue;
      const px = view.right(plan.goal[2 * i]), py = view.down(plan.goal[2 * i + 1]);
      if (gone) {
        for (const side of [-1, 1]) {
          path.moveTo(px - r, py - side * r);
          path.lineTo(px + r, py + side * r);
        }
        leash.moveTo(view.right(now.fibers[2 * i]), view.down(now.fibers[2 * i + 1]));
        leash.lineTo(px, py);
      } else if (afar) {
        ink.fillRect(px - 0.5, py - 0.5, 1, 1);
      } else {
        path.moveTo(px + r, py);
        path.arc(px, py, r, 0, 2 * Math.PI);
      }
    }
    if (gone) {
      ink.setLineDash([1, 4]);
      this.paint(leash, 1.8, this.outcomes[o], false);
      ink.setLineDash([]);
      this.paint(path, 6, colours.paper, false);
      this.paint(path, 2.8, this.outcomes[o], false);
    } else if (!afar) {
      this.paint(path, view.scale > 2.5 ? 1.3 : 0.9, colours.ink, false);
    }
    ink.globalAlpha = 1;
  }

  patrol(i) {
    const { ink, view, colours } = this, path = patrolZone(i, view);
    ink.globalAlpha = 0.13;
    ink.fillStyle = this.outcomes[plan.outcome[i]];
    ink.fill(path, "evenodd");
    ink.globalAlpha = 0.5;
    ink.setLineDash([4, 4]);
    this.paint(path, 1, colours.muted, false);
    ink.setLineDash([]);
    ink.globalAlpha = 1;
  }

  // An arm again, on top and with a rim: the one looked at, those in its way, those in contact.
  outline(arm, rim, colour = arm < 0 ? this.colours.obstacle : this.outcomes[plan.outcome[arm]], wider = 0) {
    if (arm < -plan.obstacles.length || arm >= n) return;
    const bodies = solidsNow(arm), extra = wider + Math.min(5, 1 + this.view.scale);
    for (const solid of bodies) this.solid(solid, rim, extra);
    for (const solid of bodies) this.solid(solid, colour);
    if (arm >= 0 && this.view.scale > 2.5) this.fibers([arm]);
  }

  // Contacts: their place and time at all times, and both arms in red for as long as they are too close.
  touching() {
    const { view, colours } = this, few = this.contacts.length <= 12 || view.scale > 4;
    const seen = this.contacts.filter(({ pair }) => pair.some((arm) => arm < 0 || this.visible[arm]));
    const close = seen.filter(({ pair }) => armToArm(solidsNow(pair[0]), solidsNow(pair[1])).gap < plan.margin);
    for (const arm of new Set(close.flatMap(({ pair }) => pair))) this.outline(arm, colours.ink, colours.contact);
    for (const contact of seen) {
      const px = view.right(contact.x), py = view.down(contact.y);
      const r = (close.includes(contact) ? 13 : 9) * (few ? 1 : 0.6);
      for (const [width, colour] of [[few ? 6 : 4, colours.paper], [few ? 3 : 2, colours.contact]]) {
        const circle = new Path2D();
        circle.arc(px, py, r, 0, 2 * Math.PI);
        this.paint(circle, width, colour, false);
      }
      if (few) this.text(contact.time.toFixed(1) + " s", px + r + 5, py + 4, colours.contact, "600 12px");
    }
  }

  text(words, px, py, colour, weight, align = "left") {
    const { ink, colours } = this;
    ink.font = weight + " " + this.font;
    ink.textAlign = align;
    ink.strokeStyle = colours.paper;
    ink.lineWidth = 3.5;
    ink.strokeText(words, px, py);
    ink.fillStyle = colour;
    ink.fillText(words, px, py);
  }

  names() {
    const { view, colours, visible } = this;
    if (view.scale < 9) return;
    for (let i = 0; i < n; i++) {
      if (!visible[i]) continue;
      const px = view.right(plan.base[2 * i]), py = view.down(plan.base[2 * i + 1]) + 18;
      this.text(plan.ids[i].slice(0, 24), px, py, colours.ink, "500 11px", "center");
    }
  }

  ruler() {
    const { view, colours } = this, wanted = 110 / view.scale, unit = 10 ** Math.floor(Math.log10(wanted));
    const long = [5, 2, 1].map((k) => k * unit).find((k) => k <= wanted);
    const right = view.width - 16, left = right - long * view.scale, py = view.height - 16, path = new Path2D();
    path.moveTo(left, py - 5);
    path.lineTo(left, py);
    path.lineTo(right, py);
    path.lineTo(right, py - 5);
    this.paint(path, 1.5, colours.muted, false);
    this.text(Number(long.toPrecision(2)) + " mm", (left + right) / 2, py - 7, colours.muted, "500 12px", "center");
  }
}

// Where a contact is: between the two, or at the first's base if they have no shapes that meet.
function spotOf(found, pair) {
  if (Number.isFinite(found.x)) return { x: found.x, y: found.y };
  const arm = pair.find((k) => k >= 0) ?? 0;
  return { x: plan.base[2 * arm], y: plan.base[2 * arm + 1] };
}
