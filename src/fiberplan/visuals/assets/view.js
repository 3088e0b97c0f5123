// The window on the focal plane: a middle [mm] and a scale [px/mm], y up; canvases side by side share it. Wheel and pinch
// zoom about the pointer, drag pans, a press that does not travel is a click. The middle never leaves what there is.

class View {
  constructor(bounds, changed) {
    Object.assign(this, { bounds, changed, x: 0, y: 0, scale: 1, width: 1, height: 1, whole: true, canvases: [] });
  }

  // Watch a canvas; `heard` has click, hover and leave, told in pixels of it.
  attach(canvas, heard) {
    const hand = { canvas, heard, pointers: new Map(), travel: 0 };
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.press(hand, event));
    canvas.addEventListener("pointermove", (event) => this.drag(hand, event));
    const release = (event) => this.release(hand, event);
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, release);
    canvas.addEventListener("pointerleave", () => heard.leave());
    this.canvases.push(canvas);
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.width = Math.min(...this.canvases.map((canvas) => canvas.clientWidth));
    this.height = Math.min(...this.canvases.map((canvas) => canvas.clientHeight));
    for (const canvas of this.canvases) {
      canvas.width = Math.max(1, Math.round(this.width * ratio));
      canvas.height = Math.max(1, Math.round(this.height * ratio));
    }
    if (this.whole) this.reset();
    this.changed();
  }

  reset() {
    const [left, bottom, right, top] = this.bounds;
    this.x = (left + right) / 2;
    this.y = (bottom + top) / 2;
    this.scale = this.fitting();
    this.whole = true;
    this.flight = null;
    this.changed();
  }

  fitting() {
    const [left, bottom, right, top] = this.bounds, edge = Math.min(40, 0.08 * Math.min(this.width, this.height));
    return Math.max(1e-3, Math.min((this.width - edge) / (right - left), (this.height - edge) / (top - bottom)));
  }

  right(x) { return this.width / 2 + (x - this.x) * this.scale; }
  down(y) { return this.height / 2 - (y - this.y) * this.scale; }
  across(px) { return this.x + (px - this.width / 2) / this.scale; }
  up(py) { return this.y - (py - this.height / 2) / this.scale; }

  // Look at a place; the middle stays within what there is, so that nobody gets lost.
  aim(x, y) {
    const [left, bottom, right, top] = this.bounds;
    this.x = Math.min(right, Math.max(left, x));
    this.y = Math.min(top, Math.max(bottom, y));
    this.whole = false;
    this.changed();
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const x = this.across(px), y = this.up(py), whole = this.fitting();
    this.scale = Math.min(Math.max(this.scale * factor, whole / 2), Math.max(whole * 4, 400));
    this.flight = null;
    this.aim(x - (px - this.width / 2) / this.scale, y + (py - this.height / 2) / this.scale);
  }

  // Glide to a place so that `reach` [mm] about it is seen; at once for those who prefer less motion.
  flyTo(x, y, reach) {
    const scale = Math.max(1e-3, Math.min(this.width, this.height) / (5 * reach));
    const from = { x: this.x, y: this.y, scale: this.scale, begin: performance.now() };
    const gentle = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    const flight = (this.flight = () => {
      const part = gentle ? 1 : Math.min(1, (performance.now() - from.begin) / 350);
      const eased = part * part * (3 - 2 * part);
      this.scale = from.scale * (scale / from.scale) ** eased;
      this.aim(from.x + (x - from.x) * eased, from.y + (y - from.y) * eased);
      if (part < 1) requestAnimationFrame(() => this.flight === flight && flight());
    });
    flight();
  }

  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 24 : 1;
    this.zoom(Math.exp(-Math.max(-300, Math.min(300, event.deltaY * lines)) * 0.0018), event.offsetX, event.offsetY);
  }

  press(hand, event) {
    hand.canvas.setPointerCapture(event.pointerId);
    hand.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    hand.travel = hand.pointers.size === 1 ? 0 : Infinity;
  }

  drag(hand, event) {
    const before = hand.pointers.get(event.pointerId), after = [event.offsetX, event.offsetY];
    if (!before) return hand.heard.hover(...after);
    const dx = after[0] - before[0], dy = after[1] - before[1];
    hand.travel += Math.hypot(dx, dy);
    if (hand.travel < 4) return;
    hand.canvas.classList.add("dragging");
    hand.heard.leave();
    const other = [...hand.pointers].find(([id]) => id !== event.pointerId)?.[1], share = other ? 0.5 : 1;
    this.flight = null;
    this.aim(this.x - (dx * share) / this.scale, this.y + (dy * share) / this.scale);
    hand.pointers.set(event.pointerId, after);
    if (other) {
      const spread = ([x, y]) => Math.max(10, Math.hypot(x - other[0], y - other[1]));
      this.zoom(spread(after) / spread(before), (after[0] + other[0]) / 2, (after[1] + other[1]) / 2);
    }
  }

  release(hand, event) {
    if (!hand.pointers.delete(event.pointerId)) return;
    hand.canvas.classList.remove("dragging");
    if (event.type === "pointerup" && hand.travel < 4) hand.heard.click(event);
  }
}
