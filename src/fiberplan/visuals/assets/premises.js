// What the proof is about and rests on, and who was put elsewhere for others' sake. Text only, never markup.

// Idle positioners that end elsewhere than they were wished to: no target is lost by it.
function fillDisplaced(actions) {
  const rows = plan.displaced.map(({ positioner, cause }) =>
    element("div", { class: "item" }, button(plan.ids[positioner], () => actions.goTo(positioner)), element("p", {}, cause)),
  );
  document.getElementById("displaced").hidden = !rows.length;
  fill("displaced", element("h2", {}, `Idle, elsewhere than recorded (${rows.length})`), ...capped(rows));
}

function fillPremises() {
  const { geometry, assumptions, opening } = plan.certificate;
  const pairs = opening.map(({ pair, time, clearance }) => {
    const when = time === null ? "and never reach it" : `and have it from ${time.toFixed(2)} s on`;
    const what = `begin at ${millimetres(clearance)}, nearer than the margin, only come apart ${when}.`;
    return element("p", { class: "why" }, `${pair.map(armName).join(" and ")} ${what}`);
  });
  fill(
    "premises",
    element("h2", {}, "What the proof rests on"),
    geometry && element("p", { class: "key" }, geometry),
    ...capped(pairs),
    assumptions.length
      ? element("ul", { class: "notes" }, ...assumptions.map((text) => element("li", {}, text)))
      : element("p", {}, "No assumptions."),
  );
}
