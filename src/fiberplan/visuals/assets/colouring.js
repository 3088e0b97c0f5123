// What the colours of arms mean: a few classes, each with a colour and a count, and who is in which. By outcome, by the
// smallest clearance that is proven, by the clearance or by how far along everybody is at the moment shown, or by
// priority.

const NOT_MOVING = "does not move";
const PROGRESS = ["not started", "up to a quarter", "up to half", "up to three quarters", "on its way", "there"];
const STEPS = [0.1, 0.3, 0.6, 1, 2]; // above the margin [mm]: as far as proofs say clearances exactly
const FEW = 6; // so many different priorities have a colour each

// Classes of clearance, from below the margin on, and the edges between them [mm].
function clearanceClasses(model, meaning) {
  const { margin } = model.certificate, edges = [margin, ...STEPS.map((step) => margin + step)];
  const label = (k) => {
    if (k === 0) return `below ${tidy(margin)} mm`;
    return k < edges.length ? `${tidy(edges[k - 1])} to ${tidy(edges[k])} mm` : `above ${tidy(edges[k - 1])} mm`;
  };
  const ramp = ["contact", "ramp-5", "ramp-4", "ramp-3", "ramp-2", "ramp-1", "ramp-0"];
  return { edges, classes: ramp.map((colour, k) => ({ label: label(k), colour, meaning })) };
}

const COLOURINGS = {
  outcome(model) {
    const looks = ({ key }) => ({ colour: key, hollow: key === "offline" });
    const classes = model.outcomes.map((outcome) => ({ ...outcome, ...looks(outcome) }));
    return { classes, of: model.outcome };
  },

  clearance(model) {
    const { edges, classes } = clearanceClasses(model, "smallest clearance of the whole motion");
    const of = Uint8Array.from(model.proven, (gap) => edges.filter((edge) => gap >= edge).length);
    return { classes, of };
  },

  now(model) {
    const { edges, classes } = clearanceClasses(model, "clearance at this moment");
    const of = new Uint8Array(model.n), steps = new ClearanceSteps(model, edges);
    return { classes, of, update: () => steps.update(of) };
  },

  progress(model) {
    const classes = PROGRESS.map((label, k) => ({ label, colour: "ramp-" + k, meaning: "part of its travel" }));
    classes.push({ label: NOT_MOVING, colour: "no-target", meaning: "from beginning to end" });
    const of = new Uint8Array(model.n);
    const update = () => {
      for (let i = 0; i < model.n; i++) {
        const part = model.motion.progress(i);
        of[i] = Number.isNaN(part) ? 6 : part >= 1 ? 5 : part <= 0 ? 0 : 1 + Math.min(3, Math.floor(4 * part));
      }
    };
    return { classes, of, update };
  },

  priority(model) {
    const sorted = Array.from(model.priority).sort((a, b) => a - b), different = [...new Set(sorted)];
    const quantile = (k) => sorted[Math.min(sorted.length - 1, Math.floor((k * sorted.length) / FEW))];
    const lows = different.length <= FEW ? different : [...new Set(Array.from({ length: FEW }, (_, k) => quantile(k)))];
    const label = (k) => {
      if (different.length <= FEW) return tidy(lows[k]);
      return k + 1 < lows.length ? `${tidy(lows[k])} to ${tidy(lows[k + 1])}` : `from ${tidy(lows[k])}`;
    };
    const shade = (k) => "ramp-" + Math.round((5 * k) / Math.max(1, lows.length - 1));
    const meaning = "larger matters more";
    const classes = lows.map((_, k) => ({ label: "priority " + label(k), colour: shade(k), meaning }));
    const of = Uint8Array.from(model.priority, (value) => Math.max(0, lows.filter((low) => value >= low).length - 1));
    return { classes, of };
  },
};

class Colouring {
  constructor(model, by) {
    Object.assign(this, { by, n: model.n, ...COLOURINGS[by](model) });
    this.shown = this.classes.map(() => true);
    this.refresh();
  }

  // Who is in which class now: `members` of each, in order.
  refresh() {
    this.update?.();
    if (this.members && !this.update) return;
    this.members = this.classes.map(() => []);
    for (let i = 0; i < this.n; i++) this.members[this.of[i]].push(i);
  }
}
