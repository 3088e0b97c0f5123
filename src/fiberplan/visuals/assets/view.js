// The window on the focal plane: a centre [mm] and a scale [px/mm], y up. Wheel and pinch zoom about the pointer, drag
// pans, a press that does not travel is a click.

class View {
  constructor(canvas, bounds, changed) {
    Object.assign(this, { canvas, bounds, changed, x: 0, y: 0, scale: 1, whole: true, pointers: new Map(), travel: 0 });
    this.onHover = this.onClick = this.onLeave = () => {};
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => this.release(event));
    canvas.addEventListener("pointerleave", () => this.onLeave());
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.canvas.width = Math.max(1, Math.round(this.width * ratio));
    this.canvas.height = Math.max(1, Math.round(this.height * ratio));
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
    const [left, bottom, right, top] = this.bounds;
    return Math.max(1e-3, Math.min((this.width - 40) / (right - left), (this.height - 40) / (top - bottom)));
  }

  right(x) { return this.width / 2 + (x - this.x) * this.scale; }
  down(y) { return this.height / 2 - (y - this.y) * this.scale; }
  across(px) { return this.x + (px - this.width / 2) / this.scale; }
  up(py) { return this.y - (py - this.height / 2) / this.scale; }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const x = this.across(px), y = this.up(py), whole = this.fitting();
    this.scale = Math.min(Math.max(this.scale * factor, whole / 4), Math.max(whole * 4, 400));
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
    this.whole = false;
    this.flight = null;
    this.changed();
  }

  // Glide to a place; at once for those who prefer less motion.
  flyTo(x, y, scale) {
    this.whole = false;
    const from = { x: this.x, y: this.y, scale: this.scale, begin: performance.now() };
    const gentle = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    const flight = (this.flight = () => {
      const part = gentle ? 1 : Math.min(1, (performance.now() - from.begin) / 350);
      const eased = part * part * (3 - 2 * part);
      this.scale = from.scale * (scale / from.scale) ** eased;
      this.x = from.x + (x - from.x) * eased;
      this.y = from.y + (y - from.y) * eased;
      this.changed();
      if (part < 1) requestAnimationFrame(() => this.flight === flight && flight());
    });
    flight();
  }

  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 24 : 1;
    this.zoom(Math.exp(-Math.max(-300, Math.min(300, event.deltaY * lines)) * 0.0018), event.offsetX, event.offsetY);
  }

  press(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (this.pointers.size === 1) this.travel = 0;
    else this.travel = Infinity;
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return this.onHover(event.offsetX, event.offsetY);
    const after = [event.offsetX, event.offsetY];
    const dx = after[0] - before[0], dy = after[1] - before[1];
    this.travel += Math.hypot(dx, dy);
    if (this.travel < 4) return;
    this.canvas.classList.add("dragging");
    this.onLeave();
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    const share = other ? 0.5 : 1;
    this.x -= (dx * share) / this.scale;
    this.y += (dy * share) / this.scale;
    this.whole = false;
    this.flight = null;
    this.pointers.set(event.pointerId, after);
    if (other) {
      const spread = ([x, y]) => Math.max(10, Math.hypot(x - other[0], y - other[1]));
      this.zoom(spread(after) / spread(before), (after[0] + other[0]) / 2, (after[1] + other[1]) / 2);
    }
    this.changed();
  }

  release(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    this.canvas.classList.remove("dragging");
    if (event.type === "pointerup" && this.travel < 4) this.onClick(event.offsetX, event.offsetY);
  }
}
