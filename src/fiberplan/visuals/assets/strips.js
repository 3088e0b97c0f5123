// Strips: curves over the time of the motion, all on one scale with the slider. Each marks the moment shown; a click or
// a drag goes to a moment.

const THUMB = 8; // half the width of a slider's thumb, by which its track is shorter than the slider [px]
const CURVES = ["arrived", "deadlocked", "safe", "infeasible"]; // colours of curves, in order of use

class Strip {
  // `paint(strip)` draws the curves; `strip.right` and `strip.down` map seconds and values to pixels.
  constructor(canvas, timeline, paint) {
    Object.assign(this, { canvas, timeline, paint, low: 0, high: 1 });
    const scrub = (event) => timeline.seek(this.timeAt(event.offsetX));
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      scrub(event);
    });
    canvas.addEventListener("pointermove", (event) => event.buttons && scrub(event));
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  timeAt(px) { return (this.timeline.end * (px - THUMB)) / (this.width - 2 * THUMB); }
  right(t) { return THUMB + ((this.width - 2 * THUMB) * t) / (this.timeline.end || 1); }
  down(value) {
    const top = this.height < 30 ? 3 : 15; // below the words
    return this.height - 3 - ((this.height - 3 - top) * (value - this.low)) / (this.high - this.low || 1);
  }

  draw() {
    const { canvas } = this, ratio = window.devicePixelRatio || 1;
    this.width = canvas.clientWidth;
    this.height = canvas.clientHeight;
    if (!this.width || !this.timeline.colour) return;
    const [width, height] = [Math.round(this.width * ratio), Math.round(this.height * ratio)];
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    this.ink = canvas.getContext("2d");
    this.ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.ink.clearRect(0, 0, this.width, this.height);
    this.ink.lineJoin = "round";
    this.written = THUMB + 2;
    this.paint(this);
    this.upright(this.timeline.time, "ink", 1.5);
  }

  upright(t, colour, width) {
    this.ink.fillStyle = this.timeline.colour(colour);
    this.ink.fillRect(this.right(t) - width / 2, 0, width, this.height);
  }

  level(value, colour) {
    this.curve([0, this.timeline.end], [value, value], colour, { dash: [4, 3], width: 1 });
  }

  curve(times, values, colour, { dash = [], width = 1.4, steps = false, fill = false } = {}) {
    const { ink } = this;
    ink.beginPath();
    for (let k = 0; k < times.length; k++) {
      const px = this.right(times[k]), py = this.down(values[k]);
      if (k && steps) ink.lineTo(px, this.down(values[k - 1]));
      if (k) ink.lineTo(px, py);
      else ink.moveTo(px, py);
    }
    ink.strokeStyle = ink.fillStyle = this.timeline.colour(colour);
    ink.lineWidth = width;
    ink.setLineDash(dash);
    ink.stroke();
    ink.setLineDash([]);
    if (!fill) return;
    ink.lineTo(this.right(times[times.length - 1]), this.height);
    ink.lineTo(this.right(times[0]), this.height);
    ink.globalAlpha = 0.18;
    ink.fill();
    ink.globalAlpha = 1;
  }

  // Words at one side; those on the left follow each other.
  note(words, py, align = "right", colour = "muted") {
    const { ink } = this;
    ink.font = "11px " + this.timeline.font;
    ink.textAlign = align;
    ink.strokeStyle = this.timeline.colour("paper");
    ink.lineWidth = 3;
    const px = align === "right" ? this.width - THUMB - 2 : this.written;
    if (align === "left") this.written += ink.measureText(words).width + 8;
    ink.strokeText(words, px, py);
    ink.fillStyle = this.timeline.colour(colour);
    ink.fillText(words, px, py);
  }
}

function letters(models, strip) {
  if (models.length > 1) models.forEach((_, m) => strip.note("AB"[m], 11, "left", CURVES[m]));
}

// How many positioners move; of two plans, the second is dashed.
function movingStrip(models) {
  const counts = models.map((model) => model.moves);
  return (strip) => {
    [strip.low, strip.high] = [0, Math.max(1, ...counts.map(({ most }) => most))];
    counts.forEach(({ times, counts: values }, m) => {
      const look = { steps: true, fill: !m, dash: m ? [4, 3] : [] };
      strip.curve([...times, models[m].end], [...values, 0], CURVES[m], look);
    });
    strip.note("moving", 11, "left");
    letters(models, strip);
  };
}

// The smallest clearance of any two, the margin, and the moments of contacts.
function clearanceStrip(models) {
  return (strip) => {
    const margins = models.map((model) => model.certificate.margin);
    const all = models.flatMap((model) => Array.from(model.clearances.gaps));
    if (!all.length) return strip.note("nothing comes within 2 mm of the margin", 14, "left");
    const least = all.reduce((a, b) => Math.min(a, b)), most = all.reduce((a, b) => Math.max(a, b));
    const bottom = Math.min(least, ...margins), top = Math.max(most, ...margins), room = 0.15 * (top - bottom) + 0.02;
    [strip.low, strip.high] = [bottom - room, top + 2 * room];
    margins.forEach((margin, m) => (m && margin === margins[0] ? null : strip.level(margin, "contact")));
    models.forEach(({ clearances, certificate }, m) => {
      strip.curve(clearances.times, clearances.gaps, CURVES[m], { fill: !m, dash: m ? [4, 3] : [] });
      for (const { time } of [...certificate.contacts, ...certificate.undecided]) strip.upright(time, "contact", 2);
    });
    strip.note("smallest clearance [mm], sampled; dashed red: margin", 11, "left");
    letters(models, strip);
    strip.note(strip.high.toFixed(2), 11);
    margins.forEach((margin, m) => (m && margin === margins[0] ? null : noteMargin(strip, margin)));
  };
}

// Its value above its line, or below where there is no room.
function noteMargin(strip, margin) {
  const line = strip.down(margin), above = line - 3;
  strip.note(tidy(margin), above > 22 ? above : line + 11, "right", "contact");
}

// Joint angles or speeds of the chosen: alpha full, beta dashed, a colour each.
function jointStrip(chosen, speeds) {
  return (strip) => {
    const who = chosen();
    const both = ({ model, i }, k) => [0, 1].map((joint) => ({ joint, k, ...jointCurve(model, i, joint, speeds) }));
    const curves = who.flatMap(both);
    const values = curves.flatMap((curve) => curve.values);
    [strip.low, strip.high] = [Math.min(0, ...values), Math.max(...values, Math.min(0, ...values) + 1)];
    if (speeds) strip.level(0, "line");
    for (const { joint, k, times, values: ys } of curves) {
      strip.curve(times, ys, CURVES[k], { steps: speeds, dash: joint ? [5, 3] : [] });
    }
    strip.note(speeds ? "speeds [\u00b0/s]" : "angles [\u00b0], beta dashed", 11, "left");
    who.forEach(({ model, i, letter }, k) => strip.note(model.ids[i].slice(0, 16) + letter, 11, "left", CURVES[k]));
    strip.note(strip.high.toFixed(0), 11);
    strip.note(strip.low.toFixed(0), strip.height - 4);
  };
}

// Times [s] and angles [deg], or speeds [deg/s] from each knot on, of one joint.
function jointCurve(model, i, joint, speeds) {
  const { times, angles, offsets, end } = model, first = offsets[i], last = offsets[i + 1] - 1;
  const out = { times: [], values: [] };
  const degree = 180 / Math.PI, at = (k) => angles[2 * k + joint] * degree;
  const add = (t, value) => {
    out.times.push(t);
    out.values.push(value);
  };
  if (times[first] > 0 || speeds) add(0, speeds ? 0 : at(first));
  for (let k = first; k <= last; k++) {
    add(times[k], !speeds ? at(k) : k < last ? (at(k + 1) - at(k)) / (times[k + 1] - times[k]) : 0);
  }
  add(end, speeds ? 0 : at(last));
  return out;
}
