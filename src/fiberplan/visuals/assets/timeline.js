// Time: a slider, play and pause, and the strips above it.

class Timeline {
  constructor(end, changed) {
    const get = (id) => document.getElementById(id);
    for (const id of ["slider", "speed", "clock"]) this[id] = get(id);
    Object.assign(this, { button: get("play"), changed, end, time: 0, playing: false, strips: [], onRest: () => {} });
    this.slider.max = end || 1;
    this.slider.disabled = this.button.disabled = !end;
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.button.addEventListener("click", () => this.toggle());
  }

  // Draw curves on the canvas of this id.
  add(id, paint) {
    const strip = new Strip(document.getElementById(id), this, paint);
    this.strips.push(strip);
    return strip;
  }

  seek(t, playing = false) {
    this.time = Math.min(this.end, Math.max(0, Number.isFinite(t) ? t : 0));
    if (!playing) {
      this.pause();
      this.onRest();
    }
    this.changed();
  }

  toggle() {
    if (this.playing) return this.seek(this.time);
    if (!this.end) return;
    if (this.time >= this.end) this.time = 0;
    this.playing = true;
    this.button.textContent = "Pause";
    let before = performance.now();
    const tick = (moment) => {
      if (!this.playing) return;
      const passed = Math.max(0, moment - before) / 1000;
      before = moment;
      this.seek(this.time + passed * Number(this.speed.value), true);
      if (this.time >= this.end) this.seek(this.end);
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    this.button.textContent = "Play";
  }

  draw() {
    for (const strip of this.strips) strip.draw();
    this.slider.value = this.time;
    this.slider.setAttribute("aria-valuetext", this.time.toFixed(2) + " s");
    this.clock.value = this.time.toFixed(2) + " s of " + this.end.toFixed(2) + " s";
  }
}
