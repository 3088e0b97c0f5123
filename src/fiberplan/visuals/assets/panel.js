// The words beside the picture. Everything is set as text, never as markup.

function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "onclick") node.addEventListener("click", value);
    else if (key === "colour") node.style.setProperty("--colour", `var(--${value})`);
    else node.setAttribute(key, value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

const fill = (id, ...children) => document.getElementById(id).replaceChildren(...children.filter(Boolean));
const button = (text, onclick, attributes = {}) => element("button", { type: "button", onclick, ...attributes }, text);

function facts(rows) {
  const list = element("dl", { class: "facts" });
  for (const [name, value, kind] of rows) {
    if (value !== null) list.append(element("dt", {}, name), element("dd", kind ? { class: kind } : {}, value));
  }
  return list;
}

function swatch(outcome) {
  return element("span", { class: outcome.key === "offline" ? "swatch hollow" : "swatch", colour: outcome.key });
}

function fillHeader() {
  const { certificate } = plan, safe = certificate.ok && !certificate.faults.length;
  document.getElementById("verdict").classList.add(safe ? "safe" : "unsafe");
  const mark = element("span", { class: "mark", "aria-hidden": "true" }, safe ? "\u2713" : "\u2715");
  fill("verdict", mark, safe ? "SAFE" : certificate.ok ? "INVALID" : "NOT SAFE");
  fill("name", plan.name);
  fill("summary", plan.summary);
  fill("statement", [certificate.statement, ...certificate.faults].join(". ") + ".");
  const { arrived } = plan, asked = arrived + plan.lost.length;
  const figure = (name, value, unit, kind) => {
    const number = element("dd", {}, value, element("small", {}, unit));
    return element("div", kind ? { class: kind } : {}, element("dt", {}, name), number);
  };
  const least = certificate.ok ? "smallest proven clearance" : "smallest clearance";
  fill(
    "figures",
    figure("arrived", String(arrived), " of " + asked),
    figure("lost", String(plan.lost.length), "", plan.lost.length ? "lost" : ""),
    figure("duration", plan.duration.toFixed(1), " s"),
    certificate.smallest !== null &&
      figure(least, proven(certificate.smallest).slice(0, -3), " mm", certificate.ok ? "" : "bad"),
    figure("margin", String(Number(plan.margin.toPrecision(6))), " mm"),
  );
}

function fillTrouble(actions) {
  const { contacts, undecided, violations, faults } = plan.certificate;
  const section = document.getElementById("trouble");
  section.hidden = !(contacts.length + undecided.length + violations.length + faults.length);
  const gap = ({ clearance }) => (clearance === null ? "" : ", clearance down to " + millimetres(clearance));
  const rows = [
    ...contacts.map((contact) => ["contact", contact]),
    ...undecided.map((contact) => ["undecided", contact]),
  ].map(([kind, contact]) =>
    element(
      "div",
      { class: "item" },
      element("span", { class: "what" }, kind),
      button(contact.pair.map(armName).join(" and "), () => actions.contact(contact)),
      element("p", {}, "from " + contact.time.toFixed(2) + " s on" + gap(contact)),
    ),
  );
  const sentences = [...violations, ...faults].map((text) => element("div", { class: "item" }, element("p", {}, text)));
  const title = plan.certificate.ok ? "Does not hold" : "Not safe";
  fill("trouble", element("h2", {}, title), ...capped([...rows, ...sentences]));
}

// Long lists open with the first hundred.
function capped(rows, most = 100) {
  if (rows.length <= most) return rows;
  const rest = element("div", { class: "rest" });
  const all = () => rest.replaceWith(...rows.slice(most));
  rest.append(button(`Show ${rows.length - most} more`, all, { class: "more" }));
  return [...rows.slice(0, most), rest];
}

function fillLegend(state, actions) {
  const rows = plan.outcomes.map((outcome, o) =>
    groups[o].length
      ? button("", () => actions.toggle(o), { "aria-pressed": String(state.shown[o]), title: outcomeMeaning(o) })
      : null,
  );
  rows.forEach((row, o) => {
    const count = element("span", { class: "count" }, String(groups[o].length));
    row?.append(swatch(plan.outcomes[o]), plan.outcomes[o].label, count);
  });
  fill("legend", ...rows);
}

const outcomeMeaning = (o) => `${plan.outcomes[o].meaning} (press to show or fade)`;

function chips(words, arms, actions) {
  if (!arms.length) return null;
  return element("div", { class: "chips" }, words, ...arms.map((arm) => button(armName(arm), () => actions.goTo(arm))));
}

const why = (i) => plan.causes[i] ?? outcomeOf(i).meaning;

// Who lost a target and why. Pressing one shows it together with those in its way.
function fillLosses(actions) {
  const { losses } = plan.diagnosis;
  const left = ({ priority, distance }) =>
    "priority " + Number(priority.toPrecision(6)) + (distance === null ? "" : ", ends " + millimetres(distance) + " from its target");
  const rows = lost.map((i) =>
    element(
      "div",
      { class: "item", colour: outcomeOf(i).key },
      element("span", { class: "what" }, outcomeOf(i).label),
      button(plan.ids[i], () => actions.blame(i)),
      element("p", {}, why(i)),
      element("p", { class: "left" }, left(losses[i])),
      chips("in the way", blockersOf(i), actions),
    ),
  );
  const none = element("p", {}, groups[0].length ? "None: every target is reached." : "None: no target was asked for.");
  const offline = Object.keys(losses).map(Number).filter((i) => !lost.includes(i));
  fill(
    "losses",
    element("h2", {}, `Lost targets (${plan.lost.length})`),
    ...(rows.length ? capped(rows) : [none]),
    chips("asked of positioners that cannot move", offline.slice(0, 100), actions),
  );
}

// What set the duration, and how smooth the motion is.
function fillDiagnosis(actions) {
  const { boundBy, slowest, pairBounds, reversals } = plan.diagnosis;
  const seconds = (t) => (t === null ? "never" : t.toFixed(2) + " s");
  const who = ({ positioner }) => button(plan.ids[positioner], () => actions.goTo(positioner));
  const rows = slowest.map((one) =>
    element("div", { class: "chips" }, who(one), `stops at ${seconds(one.stops)}, needs ${seconds(one.needed)}`),
  );
  const turns = ({ median, most, positioner }) =>
    `median ${median}, at most ${most}` + (positioner === null ? "" : ` (${plan.ids[positioner]})`);
  fill(
    "diagnosis",
    element("h2", {}, "Diagnosis"),
    facts([
      ["duration", seconds(plan.duration)],
      ["lower bound", seconds(plan.lowerBound)],
      ["reversals of alpha", turns(reversals.alpha)],
      ["reversals of beta", turns(reversals.beta)],
    ]),
    boundBy && element("div", { class: "chips" }, "slowest joints:", who(boundBy), `need ${seconds(boundBy.needed)}`),
    rows.length ? element("p", { class: "key" }, "Last to stop:") : null,
    ...rows,
    ...pairBounds.map((note) => element("p", { class: "key" }, note)),
  );
}

function fillAbout() {
  const { certificate } = plan, parameters = Object.entries(plan.parameters);
  const [a, b] = certificate.pair ?? [];
  fill(
    "about",
    element("h2", {}, "About this plan"),
    facts([
      ["planner", plan.planner + " (settings in rad, mm, s)"],
      ...parameters,
      ["seed", String(plan.seed)],
      ["lower bound", plan.lowerBound.toFixed(2) + " s"],
      ["margin", millimetres(plan.margin)],
      ["smallest clearance", certificate.smallest === null ? null : "\u2265 " + proven(certificate.smallest)],
      ["between", certificate.pair ? armName(a) + " and " + armName(b) : null],
      ["clock error allowed", certificate.jitter ? certificate.jitter + " s" : null],
      ["position error allowed", certificate.positionError ? certificate.positionError + " mm" : null],
      ["contacts at rest", certificate.resting.length ? String(certificate.resting.length) : null],
      ...Object.entries(plan.timings).map(([stage, seconds]) => ["time: " + stage, seconds.toFixed(3) + " s"]),
    ]),
    ...certificate.resting.map(({ pair }) =>
      element("p", { class: "why" }, pair.map(armName).join(" and ") + " touch at rest, and neither can move."),
    ),
    plan.notes.length ? element("ul", { class: "notes" }, ...plan.notes.map((note) => element("li", {}, note))) : null,
  );
}

function describe(i) {
  const near = nearest(i), outcome = outcomeOf(i);
  const to = (gap, arm) => `${gap} to ${armName(arm)}`;
  const nearby = near.arm === null ? "no neighbour" : to(millimetres(near.gap), near.arm);
  const always = Number.isFinite(plan.proven[i]) ? to("\u2265 " + proven(plan.proven[i]), plan.provenWith[i]) : null;
  return [
    element("div", { class: "name" }, element("span", {}, plan.ids[i]), swatch(outcome)),
    element("p", { class: "why" }, outcome.label + (outcome.lost ? ": " + why(i) : "")),
    facts([
      ["alpha", degrees(now.angles[2 * i])],
      ["beta", degrees(now.angles[2 * i + 1])],
      ["clearance now", nearby, near.gap < plan.margin ? "bad" : ""],
      ["proven at all times", always],
      ["in the way", blockersOf(i).length ? blockersOf(i).map(armName).join(", ") : null],
    ]),
  ];
}

function fillSelected(i, actions) {
  const section = document.getElementById("selected");
  section.hidden = i === null;
  if (i === null) return;
  // the buttons outlive a frame, so that they can be pressed while the plan plays
  if (section.dataset.positioner !== String(i)) {
    section.dataset.positioner = String(i);
    const row = [button("Zoom in", () => actions.goTo(i)), button("Let go", () => actions.select(null))];
    fill("selected", element("h2", {}, "Selected"), element("div"), element("div", { class: "chips" }, ...row));
    fill("status", `${plan.ids[i]}, ${outcomeOf(i).label}`);
  }
  section.children[1].replaceChildren(...describe(i));
}

function fillHits(text, actions) {
  const wanted = text.trim().toLowerCase();
  const rank = (id) => (id === wanted ? 0 : id.startsWith(wanted) ? 1 : 2);
  const hits = wanted
    ? plan.ids
        .map((id, i) => [id.toLowerCase(), i])
        .filter(([id]) => id.includes(wanted))
        .sort((a, b) => rank(a[0]) - rank(b[0]) || a[1] - b[1])
        .map(([, i]) => i)
    : [];
  const rows = hits.slice(0, 8).map((i) => element("li", {}, button(plan.ids[i], () => actions.goTo(i))));
  if (wanted && !hits.length) rows.push(element("li", {}, "No positioner of that name."));
  if (hits.length > 8) rows.push(element("li", {}, `and ${hits.length - 8} more`));
  fill("hits", ...rows);
  return hits[0] ?? null;
}
