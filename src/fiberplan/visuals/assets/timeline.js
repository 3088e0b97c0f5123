// Time: a slider, play and pause, and a strip that counts who moves. The strip and the slider share one scale, and the
// strip marks the moments of contact.

const THUMB = 8; // half the width of a slider's thumb, by which its track is shorter than the slider [px]

class Timeline {
  constructor(changed) {
    const get = (id) => document.getElementById(id);
    for (const id of ["slider", "chart", "speed", "clock", "moving"]) this[id] = get(id);
    this.button = get("play");
    this.changed = changed;
    this.end = plan.times.reduce((latest, t) => Math.max(latest, t), 0); // in single precision, as the knots are
    this.counts = movingCounts();
    this.time = this.end;
    this.playing = false;
    this.slider.max = this.end || 1;
    this.slider.disabled = this.button.disabled = !this.end;
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.button.addEventListener("click", () => this.toggle());
    const scrub = (event) => this.seek((this.end * (event.offsetX - THUMB)) / (this.chart.clientWidth - 2 * THUMB));
    this.chart.addEventListener("pointerdown", (event) => {
      this.chart.setPointerCapture(event.pointerId);
      scrub(event);
    });
    this.chart.addEventListener("pointermove", (event) => event.buttons && scrub(event));
    new ResizeObserver(() => this.draw()).observe(this.chart);
  }

  seek(t, playing = false) {
    this.time = Math.min(this.end, Math.max(0, t));
    if (!playing) this.pause();
    this.changed();
  }

  toggle() {
    if (this.playing) return this.pause();
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
      if (this.time >= this.end) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    this.button.textContent = "Play";
  }

  // The outline of the strip: the most that move within each pixel's time.
  area(width, height) {
    if (this.drawn?.width === width) return this.drawn.path;
    const { times, counts, most } = this.counts, path = new Path2D();
    const down = (count) => height - 1 - ((height - 6) * count) / Math.max(1, most);
    path.moveTo(THUMB, height - 1);
    for (let px = THUMB; px <= width - THUMB; px++) {
      const time = (part) => (this.end * (part - THUMB)) / (width - 2 * THUMB);
      let count = 0;
      for (let k = stepBefore(times, time(px)); k < times.length && times[k] < time(px + 1); k++) {
        count = Math.max(count, counts[k]);
      }
      path.lineTo(px, down(count));
      path.lineTo(px + 1, down(count));
    }
    path.lineTo(width - THUMB, height - 1);
    this.drawn = { width, path };
    return path;
  }

  draw() {
    const { chart, counts, end } = this, ratio = window.devicePixelRatio || 1;
    const width = chart.clientWidth, height = chart.clientHeight;
    if (!width) return;
    chart.width = Math.round(width * ratio);
    chart.height = Math.round(height * ratio);
    const ink = chart.getContext("2d"), css = getComputedStyle(document.documentElement);
    const colour = (name) => css.getPropertyValue("--" + name).trim();
    const right = (t) => THUMB + ((width - 2 * THUMB) * t) / (end || 1);
    ink.scale(ratio, ratio);
    const area = this.area(width, height);
    ink.globalAlpha = 0.3;
    ink.fillStyle = colour("arrived");
    ink.fill(area);
    ink.globalAlpha = 1;
    ink.strokeStyle = colour("arrived");
    ink.lineWidth = 1.4;
    ink.stroke(area);
    for (const contact of [...plan.certificate.contacts, ...plan.certificate.undecided]) {
      ink.fillStyle = colour("contact");
      ink.fillRect(right(contact.time) - 1, 0, 2, height);
    }
    ink.fillStyle = colour("ink");
    ink.fillRect(right(this.time) - 0.75, 0, 1.5, height);
    const count = counts.counts[stepBefore(counts.times, this.time)];
    this.slider.value = this.time;
    this.slider.setAttribute("aria-valuetext", this.time.toFixed(2) + " s");
    this.clock.value = this.time.toFixed(2) + " s of " + end.toFixed(2) + " s";
    this.moving.textContent = count + " moving (at most " + counts.most + ")";
  }
}
