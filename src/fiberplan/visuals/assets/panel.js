// The panel beside the picture: what the colours mean, what is not safe, shapes and heights, diagnosis, and settings.

function fillTrouble(model, actions) {
  const { contacts, undecided, violations, faults, ok } = model.certificate;
  const gap = ({ clearance }) => (clearance === null ? "" : ", clearance down to " + millimetres(clearance));
  const row = (kind) => (contact) =>
    element(
      "div",
      { class: "item" },
      element("span", { class: "what" }, kind),
      button(contact.pair.map((arm) => model.armName(arm)).join(" and "), () => actions.pair(contact)),
      element("p", {}, "from " + contact.time.toFixed(2) + " s on" + gap(contact)),
    );
  const sentences = [...violations, ...faults].map((text) => element("div", { class: "item" }, element("p", {}, text)));
  const rows = [...contacts.map(row("contact")), ...undecided.map(row("undecided")), ...sentences];
  fill("trouble", rows.length ? heading(ok ? "Does not hold" : "Not safe") : null, ...capped(rows));
}

// The classes of the colouring; pressing one shows or fades its positioners.
function fillLegend(colouring, actions) {
  const rows = colouring.classes.map((one, k) => {
    const count = colouring.members[k].length;
    if (!count && !colouring.update) return null;
    const number = element("span", { class: "count" }, String(count));
    const title = `${one.meaning} (press to show or fade)`;
    const pressed = String(colouring.shown[k]);
    const node = button("", () => actions.toggle(k), { "aria-pressed": pressed, title, "data-class": k });
    node.append(swatch(one), element("span", {}, one.label), number);
    return node;
  });
  if (colouring.shown.includes(false)) rows.push(button("Show all", () => actions.showAll(), { class: "all" }));
  fill("legend", ...rows);
}

// While it plays only the counts change, so that a button can be pressed.
function countLegend(colouring) {
  for (const row of document.querySelectorAll("#legend [data-class]")) {
    row.querySelector(".count").textContent = colouring.members[row.dataset.class].length;
  }
}

function fillShapes(model) {
  const rows = model.heights.map(({ name, count, meets, over }) =>
    element(
      "li",
      {},
      element("b", {}, name),
      count > 1 ? ` (${count})` : null,
      meets.length ? " keeps the margin from " + meets.join(", ") : " can touch nothing",
      over.length ? "; may lie over or under " + over.join(", ") : null,
    ),
  );
  const crossing = model.heights.some(({ over }) => over.length);
  const why = "What may lie over or under another shape is at another height, or out of reach: it is not tested.";
  const pale = model.obstacles.some(({ over }) => over) ? " Obstacles that parts of arms may lie over are pale." : "";
  fill(
    "shapes",
    rows.length ? heading("Shapes and heights") : null,
    element("ul", { class: "notes" }, ...rows),
    crossing ? element("p", { class: "key" }, why + pale) : null,
  );
}

// Idle positioners that end elsewhere than they were wished to: no target is lost by it.
function fillDisplaced(model, actions) {
  const rows = model.displaced.map(({ positioner, cause }) =>
    element(
      "div",
      { class: "item" },
      button(model.ids[positioner], () => actions.goTo(positioner)),
      element("p", {}, cause),
    ),
  );
  fill("displaced", rows.length ? heading(`Idle, elsewhere than recorded (${rows.length})`) : null, ...capped(rows));
}

// What set the duration, and how smooth the motion is.
function fillDiagnosis(model, actions) {
  if (!model.diagnosis) return fill("diagnosis");
  const { boundBy, slowest, pairBounds, reversals } = model.diagnosis;
  const seconds = (t) => (t === null ? "never" : t.toFixed(2) + " s");
  const who = ({ positioner }) => button(model.ids[positioner], () => actions.goTo(positioner));
  const rows = slowest.map((one) =>
    element("div", { class: "chips" }, who(one), `stops at ${seconds(one.stops)}, needs ${seconds(one.needed)}`),
  );
  const turns = ({ median, most, positioner }) =>
    `median ${median}, at most ${most}` + (positioner === null ? "" : ` (${model.ids[positioner]})`);
  fill(
    "diagnosis",
    heading("Diagnosis"),
    facts([
      ["duration", seconds(model.duration)],
      ["lower bound", seconds(model.lowerBound)],
      ["reversals of alpha", turns(reversals.alpha)],
      ["reversals of beta", turns(reversals.beta)],
    ]),
    boundBy && element("div", { class: "chips" }, "slowest joints:", who(boundBy), `need ${seconds(boundBy.needed)}`),
    rows.length ? element("p", { class: "key" }, "Last to stop:") : null,
    ...rows,
    ...pairBounds.map((note) => element("p", { class: "key" }, note)),
  );
}

function fillAbout(model) {
  const { certificate } = model, [a, b] = certificate.pair ?? [];
  fill(
    "about",
    heading(model.planner ? "About this plan" : "About this motion"),
    facts([
      ...(model.planner ? [["planner", model.planner], ...model.parameters, ["seed", String(model.seed)]] : []),
      ["lower bound", model.lowerBound === undefined ? null : model.lowerBound.toFixed(2) + " s"],
      ["margin", millimetres(model.margin)],
      ["smallest clearance", certificate.smallest === null ? null : "\u2265 " + proven(certificate.smallest)],
      ["between", certificate.pair ? model.armName(a) + " and " + model.armName(b) : null],
      ["clock error allowed", certificate.jitter ? certificate.jitter + " s" : null],
      ["position error allowed", certificate.positionError ? certificate.positionError + " mm" : null],
      ["contacts at rest", certificate.resting.length ? String(certificate.resting.length) : null],
      ...Object.entries(model.timings ?? {}).map(([stage, seconds]) => ["time: " + stage, seconds.toFixed(3) + " s"]),
    ]),
    ...certificate.resting.map(({ pair }) => {
      const names = pair.map((arm) => model.armName(arm)).join(" and ");
      return element("p", { class: "why" }, names + " touch at rest, and neither can move.");
    }),
    list(model.notes),
  );
}
