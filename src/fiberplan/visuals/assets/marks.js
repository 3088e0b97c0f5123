// What is drawn on top of a scene: those who are looked at and who is in their way, contacts, names, and the ruler.

class Marks {
  constructor(scene) {
    Object.assign(this, { scene });
    const { model } = scene, { contacts, undecided } = model.certificate;
    this.contacts = [...contacts, ...undecided].map((one) => ({ ...one, ...spotOf(model, one.pair, one.time) }));
  }

  // The positioner that all is told of: under the pointer, or selected.
  focus() {
    const { model, state } = this.scene, hovered = state.hovered?.model === model ? state.hovered.arm : null;
    return hovered !== null && hovered >= 0 ? hovered : this.chosen()[0] ?? null;
  }

  // Indices of the selected positioner and of those that are kept.
  chosen() {
    const { model, state } = this.scene;
    const ids = [...new Set([state.selected, ...state.kept])];
    return ids.map((id) => model.index.get(id)).filter((i) => i !== undefined);
  }

  outlines(focus) {
    const { scene } = this, { model, state } = scene, ink = scene.colour("ink");
    const blame = (arm) => this.outline(arm, scene.colour("contact"), undefined, 4);
    if (focus !== null) model.blockersOf(focus).forEach(blame);
    for (const i of this.chosen()) this.outline(i, ink);
    const hovered = state.hovered?.model === model ? state.hovered.arm : null;
    if (hovered !== null) this.outline(hovered, ink);
  }

  // An arm again, on top and with a rim.
  outline(arm, rim, colour, wider = 0) {
    const { scene } = this, { model, view } = scene;
    if (!model.knows(arm)) return;
    const bodies = solidsNow(model, arm), extra = wider + Math.min(5, 1 + view.scale);
    const shade = colour ?? (arm < 0 ? scene.colour("obstacle") : scene.colourOf(arm));
    for (const solid of bodies) scene.solid(solid, rim, extra);
    for (const solid of bodies) scene.solid(solid, shade);
    if (arm >= 0 && view.scale > 2.5) scene.fibers([arm]);
  }

  draw(focus) {
    this.touching();
    this.names(focus);
    this.ruler();
  }

  // Contacts: their place and time at all times, and both arms in red for as long as they are too close.
  touching() {
    const { scene } = this, { view, model } = scene, few = this.contacts.length <= 12 || view.scale > 4;
    const seen = this.contacts.filter(({ pair }) => pair.some((arm) => arm < 0 || scene.visible[arm]));
    const margin = model.certificate.margin;
    const close = seen.filter(({ pair }) => armToArm(...pair.map((arm) => solidsNow(model, arm))).gap < margin);
    const red = scene.colour("contact");
    for (const arm of new Set(close.flatMap(({ pair }) => pair))) this.outline(arm, scene.colour("ink"), red);
    for (const contact of seen) {
      const px = view.right(contact.x), py = view.down(contact.y);
      const r = (close.includes(contact) ? 13 : 9) * (few ? 1 : 0.6);
      for (const [width, colour] of [[few ? 6 : 4, "paper"], [few ? 3 : 2, "contact"]]) {
        const circle = new Path2D();
        circle.arc(px, py, r, 0, 2 * Math.PI);
        scene.stroke(width, scene.colour(colour), circle);
      }
      if (few) this.text(contact.time.toFixed(1) + " s", px + r + 5, py + 4, "contact", "600 12px");
    }
  }

  // The pair that an entry of a list led to: a ring about the place where the two are nearest.
  ring() {
    const { scene } = this, { state, view, model } = scene;
    if (state.pair?.model !== model || Math.abs(model.motion.time - state.pair.time) > 1e-3) return;
    const circle = new Path2D();
    circle.arc(view.right(state.pair.x), view.down(state.pair.y), 16, 0, 2 * Math.PI);
    scene.stroke(2, scene.colour("ink"), circle);
  }

  text(words, px, py, colour, weight, align = "left") {
    const { scene } = this, { ink } = scene;
    ink.font = weight + " " + scene.font;
    ink.textAlign = align;
    ink.strokeStyle = scene.colour("paper");
    ink.lineWidth = 3.5;
    ink.strokeText(words, px, py);
    ink.fillStyle = scene.colour(colour);
    ink.fillText(words, px, py);
  }

  // Ids: of everybody from near by; of those that are looked at, and who is in their way, from anywhere.
  names(focus) {
    const { scene } = this, { view, model, visible, state } = scene;
    this.ring();
    const near = view.scale >= 9, told = new Set(this.chosen());
    if (focus !== null) [focus, ...model.blockersOf(focus)].forEach((arm) => told.add(arm));
    if (state.pair?.model === model) state.pair.pair.forEach((arm) => told.add(arm));
    if (near) for (let i = 0; i < model.n; i++) if (visible[i]) told.add(i);
    const taken = [];
    for (const arm of told) {
      if (!model.knows(arm)) continue;
      const [x, y] = model.placeOf(arm), word = model.armName(arm).slice(0, 24);
      const px = view.right(x), wide = 7 * word.length;
      let py = view.down(y) + 18;
      const meets = ([qx, qy, other]) => Math.abs(qy - py) < 14 && Math.abs(qx - px) < (wide + other) / 2 + 4;
      while (!near && taken.some(meets)) py += 14; // one below the other where they would overlap
      taken.push([px, py, wide]);
      this.text(word, px, py, "ink", near ? "500 11px" : "600 12px", "center");
    }
  }

  ruler() {
    const { scene } = this, { view } = scene, wanted = 110 / view.scale, unit = 10 ** Math.floor(Math.log10(wanted));
    const long = [5, 2, 1].map((k) => k * unit).find((k) => k <= wanted);
    const right = view.width - 16, left = right - long * view.scale, py = view.height - 16, path = new Path2D();
    path.moveTo(left, py - 5);
    path.lineTo(left, py);
    path.lineTo(right, py);
    path.lineTo(right, py - 5);
    scene.stroke(1.5, scene.colour("muted"), path);
    this.text(Number(long.toPrecision(2)) + " mm", (left + right) / 2, py - 7, "muted", "500 12px", "center");
  }
}
