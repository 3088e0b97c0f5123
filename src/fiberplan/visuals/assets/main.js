// One state, one redraw per frame at most. Hovering looks, clicking keeps; every list entry leads to its place.

const models = JSON.parse(document.getElementById("plan").textContent).plans.map((data) => new Model(data));
for (const model of models) model.motion = new Motion(model);

const state = { hovered: null, selected: null, kept: [], pair: null, active: 0, pointer: [0, 0], colour: "outcome" };
const box = [Infinity, Infinity, -Infinity, -Infinity];
for (const model of models) widen(box, ...model.bounds);

const byId = (id) => document.getElementById(id);
const view = new View(box, redraw);
const timeline = new Timeline(Math.max(...models.map((model) => model.end)), redraw);
let pending = false;
let panes = [];
let ready = false;

const pane = () => panes[state.active];
const here = () => models[state.active];

function redraw() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => {
    pending = false;
    if (ready) draw();
  });
}

function draw() {
  for (const { model, scene } of panes) {
    model.motion.moveTo(timeline.time);
    scene.draw();
  }
  timeline.draw();
  byId("nothing").hidden = !panes.every(({ scene }) => scene.empty);
  const { counts, times } = here().moves;
  byId("moving").textContent = counts[stepBefore(times, timeline.time)] + " moving";
  showNearest();
  showTip();
  selected.show(here(), pane().scene);
  if (pane().scene.colouring.update) countLegend(pane().scene.colouring);
}

// The two that were sampled nearest about now, with their clearance now, as a button that leads to them.
function showNearest() {
  const model = here(), { times, first, second } = model.clearances, node = byId("nearest"), now = timeline.time;
  const k = times.length ? stepBefore(times, now) : -1;
  const there = (m) => m >= 0 && m < times.length && first[m] !== second[m];
  const pairs = [k, k + 1].filter(there).map((m) => [first[m], second[m]]);
  const gaps = pairs.map((pair) => armToArm(...pair.map((arm) => solidsNow(model, arm))).gap);
  const best = gaps.indexOf(Math.min(...gaps));
  node.hidden = best < 0;
  if (node.hidden) return;
  const names = pairs[best].map((arm) => model.armName(arm)).join(" and ");
  node.textContent = `closest: ${millimetres(gaps[best])}, ${names}`;
  node.onclick = () => actions.pair({ pair: pairs[best], time: now });
}

function showTip() {
  const tip = byId("tip"), { hovered } = state;
  tip.hidden = hovered === null;
  if (hovered === null) return;
  const { model, arm } = hovered, { canvas, scene } = panes[models.indexOf(model)];
  tip.replaceChildren(...describe(model, arm, scene));
  canvas.parentElement.append(tip);
  const [px, py] = state.pointer;
  const right = px + 18 + tip.offsetWidth > view.width, low = py + 18 + tip.offsetHeight > view.height;
  tip.style.left = Math.max(4, right ? px - 14 - tip.offsetWidth : px + 18) + "px";
  tip.style.top = Math.max(4, low ? py - 14 - tip.offsetHeight : py + 18) + "px";
}

function remember() {
  const ids = new Set([state.selected, ...state.kept].filter((id) => id !== null));
  writeLink(timeline.time, [...ids], state.colour, state.active);
}

const lettered = (model) => (models.length > 1 ? " " + "AB"[models.indexOf(model)] : "");

// Selection changed: curves come and go, and with them the height of the picture.
function chosen() {
  const some = state.selected !== null || state.kept.length > 0;
  byId("joints").hidden = !some;
  remember();
  redraw();
}

// On a small screen the picture may be out of sight where a list is.
function look(x, y, reach) {
  const stage = byId("fields"), { top, bottom } = stage.getBoundingClientRect();
  if (top < -40 || bottom > window.innerHeight + 40) stage.scrollIntoView({ block: "start" });
  view.flyTo(x, y, reach);
}

const actions = {
  select(id) {
    state.selected = id;
    state.pair = null;
    chosen();
  },
  clear() {
    state.kept = [];
    this.select(null);
  },
  keep(id) {
    state.kept = state.kept.includes(id) ? state.kept.filter((one) => one !== id) : [...state.kept, id].slice(-3);
    chosen();
  },
  goTo(arm) {
    if (arm >= 0) this.select(here().ids[arm]);
    look(...here().placeOf(arm));
  },
  // A positioner together with those in its way, all of them in the picture.
  blame(i) {
    this.select(here().ids[i]);
    const around = [Infinity, Infinity, -Infinity, -Infinity];
    for (const arm of [i, ...here().blockersOf(i)].filter((one) => here().knows(one))) {
      const [x, y, r] = here().placeOf(arm);
      widen(around, x - r, y - r, x + r, y + r);
    }
    const [left, bottom, right, top] = around;
    look((left + right) / 2, (bottom + top) / 2, Math.max(right - left, top - bottom) / 2.5);
  },
  // Two that are near each other: the moment and the place.
  pair({ pair, time }) {
    const arm = pair.find((one) => one >= 0) ?? pair[0], model = here();
    this.select(arm >= 0 ? model.ids[arm] : null);
    timeline.seek(time);
    state.pair = { model, pair, time: timeline.time, ...spotOf(model, pair, time) };
    look(state.pair.x, state.pair.y, model.placeOf(arm)[2]);
  },
  closest() {
    if (here().closest.length) this.pair(here().closest[0]);
  },
  toggle(k) {
    const { scene } = pane();
    scene.colouring.shown[k] = !scene.colouring.shown[k];
    scene.layers = {};
    fillLegend(scene.colouring, actions);
    document.querySelector(`#legend [data-class="${k}"]`).focus();
    redraw();
  },
  showAll() {
    this.colour(state.colour);
  },
  colour(by) {
    state.colour = byId("colour").value = by;
    for (const { scene } of panes) scene.colourBy(by);
    fillLegend(pane().scene.colouring, actions);
    remember();
    redraw();
  },
  clearSearch() {
    byId("search").value = "";
    fillHits(here(), "", actions);
    byId("search").focus();
  },
  // Tell of this plan in the panel.
  activate(m) {
    state.active = m;
    fillPanel();
    remember();
    redraw();
  },
};

function fillPanel() {
  const model = here(), tabs = models.length < 2 ? [] : models.map(({ title }, m) =>
    button(`${"AB"[m]} ${title}`, () => actions.activate(m), { "aria-pressed": String(m === state.active) }),
  );
  fill("tabs", ...tabs);
  panes.forEach(({ canvas }, k) => canvas.parentElement.classList.toggle("active", k === state.active));
  fillTrouble(model, actions);
  fillLegend(pane().scene.colouring, actions);
  fillHits(model, byId("search").value, actions);
  fillClosest(model, actions);
  fillLosses(model, actions);
  fillDisplaced(model, actions);
  fillShapes(model);
  fillDiagnosis(model, actions);
  fillAbout(model);
}

// A canvas for each plan, side by side.
function makePane(model, m) {
  const label = `${model.title}: ${model.summary}. ${model.certificate.statement}.`;
  const canvas = element("canvas", { class: "field-picture", tabindex: "0", role: "img", "aria-label": label });
  canvas.id = m ? "field-B" : "field";
  const letter = models.length > 1 && element("span", { class: "letter" }, "AB"[m]);
  byId("fields").append(element("div", { class: "field" }, canvas, letter));
  const under = (px, py) => armAt(model, view.across(px), view.up(py), 5 / view.scale);
  const hover = (arm) => {
    canvas.classList.toggle("over", arm !== null);
    if (state.hovered === null && arm === null) return;
    state.hovered = arm === null ? null : { model, arm };
    redraw();
  };
  view.attach(canvas, {
    hover(px, py) {
      state.pointer = [px, py];
      hover(under(px, py));
    },
    leave: () => hover(null),
    click(event) {
      const arm = under(event.offsetX, event.offsetY), id = arm === null || arm < 0 ? null : model.ids[arm];
      if (state.active !== m) actions.activate(m);
      const keeps = event.shiftKey && state.selected !== null && id !== null;
      if (keeps && !state.kept.includes(state.selected)) actions.keep(state.selected);
      actions.select(id);
    },
  });
  return { model, canvas, scene: new Scene(model, canvas, view, state) };
}

function follow({ t, ids, colour, plan }) {
  if (plan !== undefined && plan < models.length) actions.activate(plan);
  if (t !== undefined) timeline.seek(t);
  const known = (ids ?? []).map((id) => models.map((model) => model.known(id)).find(Boolean)).filter(Boolean);
  if (known.length) [state.selected, ...state.kept] = known;
  if (colour !== undefined && colour !== state.colour) actions.colour(colour);
  chosen();
}

for (const model of models) model.moves = model.motion.movingCounts();
const selected = new Selected(state, actions);
document.body.classList.toggle("compare", models.length > 1);
fillHeader(models);
panes = models.map(makePane);
timeline.colour = panes[0].scene.colour;
timeline.font = panes[0].scene.font;
timeline.add("moves", movingStrip(models));
timeline.add("clearances", clearanceStrip(models));
const curvesOf = ({ model, scene }) => scene.marks.chosen().map((i) => ({ model, i, letter: lettered(model) }));
const curves = () => panes.flatMap(curvesOf).slice(0, CURVES.length);
timeline.add("angles", jointStrip(curves, false));
timeline.add("speeds", jointStrip(curves, true));
timeline.onRest = remember;
fillPanel();
ready = true;
listen();
follow(readLink());
draw();
performance.mark("first picture");
