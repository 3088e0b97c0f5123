// The plan as data: strings from JSON, numbers from base64 of little-endian arrays. An arm is a positioner, by its
// index, or obstacle k, by the number -1 - k, as in plan files.

const plan = JSON.parse(document.getElementById("plan").textContent);
const n = plan.ids.length;

function unpack(text, Type) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Type(bytes.buffer);
}

for (const key of ["base", "proven"]) plan[key] = unpack(plan[key], Float64Array);
for (const key of ["length", "zero", "lower", "upper", "fiber", "reach", "goal", "times", "angles"]) {
  plan[key] = unpack(plan[key], Float32Array);
}
if (plan.bars) for (const key of ["bars", "sliders"]) plan[key] = unpack(plan[key], Float64Array);
plan.outcome = unpack(plan.outcome, Uint8Array);
plan.offsets = unpack(plan.offsets, Uint32Array);
plan.provenWith = unpack(plan.provenWith, Int32Array);
for (const shape of [...plan.bodies, ...plan.obstacles]) {
  shape.points = unpack(shape.points, Float32Array);
  shape.radius = unpack(shape.radius, Float32Array);
}

const groups = plan.outcomes.map((_, o) => plan.ids.map((_, i) => i).filter((i) => plan.outcome[i] === o));
const lost = groups.flat().filter((i) => plan.lost.includes(i) && plan.outcomes[plan.outcome[i]].lost);

const outcomeOf = (i) => plan.outcomes[plan.outcome[i]];
const blockersOf = (i) => plan.blockers[i] ?? [];
const hasGoal = (i) => Number.isFinite(plan.goal[2 * i]);
const armName = (arm) => (arm >= 0 ? plan.ids[arm] : plan.obstacles[-1 - arm]?.name ?? "obstacle " + (-1 - arm));
const radiusOf = (shape, i) => shape.radius[shape.radius.length > 1 ? i : 0];

// A proven bound is rounded down, never up.
const proven = (gap) => (Math.floor(gap * 1e3 + 1e-6) / 1e3).toFixed(3) + " mm";
const millimetres = (gap) => gap.toFixed(3) + " mm";
const degrees = (angle) => ((angle * 180) / Math.PI).toFixed(2) + "\u00b0";
