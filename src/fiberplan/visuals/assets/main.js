// One state, one redraw per frame at most. Hovering looks, clicking keeps; every list entry leads to its place.

const state = { hovered: null, selected: null, shown: plan.outcomes.map(() => true), pointer: [0, 0] };
const canvas = document.getElementById("field");
const tip = document.getElementById("tip");
let pending = false;
let scene = null;
let timeline = null;

function redraw() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => {
    pending = false;
    if (!scene) return;
    moveTo(timeline.time);
    scene.draw();
    timeline.draw();
    showTip();
    fillSelected(state.selected, actions);
  });
}

function bounds() {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const grow = (left, bottom, right, top) => {
    box[0] = Math.min(box[0], left);
    box[1] = Math.min(box[1], bottom);
    box[2] = Math.max(box[2], right);
    box[3] = Math.max(box[3], top);
  };
  for (let i = 0; i < n; i++) {
    const x = plan.base[2 * i], y = plan.base[2 * i + 1], r = plan.reach[i];
    grow(x - r, y - r, x + r, y + r);
  }
  obstacleBoxes.forEach((obstacle) => grow(...obstacle));
  return box;
}

function placeOf(arm) {
  if (arm >= 0) return [plan.base[2 * arm], plan.base[2 * arm + 1], plan.reach[arm]];
  const [left, bottom, right, top] = obstacleBoxes[-1 - arm];
  return [(left + right) / 2, (bottom + top) / 2, Math.max(right - left, top - bottom, 20) / 2];
}

function closeUp(x, y, reach) {
  view.flyTo(x, y, Math.max(1e-3, Math.min(view.width, view.height) / (5 * reach)));
}

const actions = {
  select(i) {
    state.selected = i;
    redraw();
  },
  goTo(arm) {
    if (arm >= 0) state.selected = arm;
    closeUp(...placeOf(arm));
  },
  // A positioner together with those in its way, all of them in the picture.
  blame(i) {
    state.selected = i;
    const known = (arm) => arm < n && arm >= -plan.obstacles.length;
    const places = [i, ...blockersOf(i).filter(known)].map(placeOf);
    const side = (k, sign) => Math.max(...places.map((place) => sign * place[k] + place[2]));
    const [right, left, top, bottom] = [side(0, 1), -side(0, -1), side(1, 1), -side(1, -1)];
    closeUp((left + right) / 2, (bottom + top) / 2, Math.max(right - left, top - bottom) / 2.5);
  },
  contact(contact) {
    const arm = contact.pair.find((k) => k >= 0) ?? contact.pair[0];
    state.selected = arm >= 0 ? arm : null;
    timeline.seek(contact.time);
    const spot = scene.contacts.find((one) => one.pair === contact.pair);
    closeUp(spot.x, spot.y, placeOf(arm)[2]);
  },
  toggle(o) {
    state.shown[o] = !state.shown[o];
    fillLegend(state, actions);
    document.getElementById("legend").children[groups.slice(0, o).filter((g) => g.length).length].focus();
    redraw();
  },
};

// The positioner under a place on the canvas: the nearest arm, or one whose target is there.
function under(px, py) {
  const x = view.across(px), y = view.up(py), slack = 5 / view.scale;
  let best = null, least = slack;
  for (let i = 0; i < n; i++) {
    const away = Math.hypot(x - plan.base[2 * i], y - plan.base[2 * i + 1]);
    if (away > plan.reach[i] + slack) continue;
    const gap = Math.min(pointToArm(x, y, i), away);
    if (gap < least) [best, least] = [i, gap];
  }
  if (best !== null) return best;
  const onGoal = (i) => Math.hypot(x - plan.goal[2 * i], y - plan.goal[2 * i + 1]) < 1.6 * slack;
  const goal = plan.ids.findIndex((_, i) => onGoal(i));
  return goal < 0 ? null : goal;
}

function hover(i) {
  canvas.classList.toggle("over", i !== null);
  if (i === state.hovered && i === null) return;
  state.hovered = i;
  redraw();
}

function showTip() {
  const i = state.hovered;
  tip.hidden = i === null;
  if (i === null) return;
  tip.replaceChildren(...describe(i));
  const [px, py] = state.pointer;
  const right = px + 18 + tip.offsetWidth > view.width, low = py + 18 + tip.offsetHeight > view.height;
  tip.style.left = Math.max(4, right ? px - 14 - tip.offsetWidth : px + 18) + "px";
  tip.style.top = Math.max(4, low ? py - 14 - tip.offsetHeight : py + 18) + "px";
}

const view = new View(canvas, bounds(), redraw);
timeline = new Timeline(redraw);
moveTo(timeline.time);
scene = new Scene(canvas, view, state);

view.onHover = (px, py) => {
  state.pointer = [px, py];
  hover(under(px, py));
};
view.onLeave = () => hover(null);
view.onClick = (px, py) => actions.select(under(px, py));
document.getElementById("zoom-in").addEventListener("click", () => view.zoom(1.5));
document.getElementById("zoom-out").addEventListener("click", () => view.zoom(1 / 1.5));
document.getElementById("reset").addEventListener("click", () => view.reset());

const search = document.getElementById("search");
search.addEventListener("input", () => fillHits(search.value, actions));
search.addEventListener("keydown", (event) => {
  if (event.key !== "Enter") return;
  const first = fillHits(search.value, actions);
  if (first !== null) actions.goTo(first);
});

const step = (event, sign) => timeline.seek(timeline.time + (sign * (event.shiftKey ? 10 : 1) * timeline.end) / 100);
const KEYS = {
  " ": () => timeline.toggle(),
  ArrowLeft: (event) => step(event, -1),
  ArrowRight: (event) => step(event, 1),
  Home: () => timeline.seek(0),
  End: () => timeline.seek(timeline.end),
  "+": () => view.zoom(1.25),
  "=": () => view.zoom(1.25),
  "-": () => view.zoom(0.8),
  0: () => view.reset(),
  "/": () => search.focus(),
  Escape: () => actions.select(null),
};
document.addEventListener("keydown", (event) => {
  const typing = event.target === search || event.target.tagName === "SELECT";
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (typing && event.key === "Escape") event.target.blur();
  if (typing || (event.key === " " && event.target.tagName === "BUTTON")) return;
  const act = KEYS[event.key];
  if (!act) return;
  event.preventDefault();
  act(event);
});

window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  scene.readColours();
  redraw();
});

canvas.setAttribute("aria-label", `${plan.name}: ${plan.summary}. ${plan.certificate.statement}.`);
fillHeader();
fillTrouble(actions);
fillLegend(state, actions);
fillLosses(actions);
fillDisplaced(actions);
fillDiagnosis(actions);
fillPremises();
fillAbout();
redraw();
