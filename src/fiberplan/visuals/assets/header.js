// The top of the page: of each plan the verdict, what it is and where it comes from, and what its proof rests on.

function fillHeader(models) {
  fill("plans", ...models.map((model, m) => summaryOf(model, models.length > 1 ? "AB"[m] : null)));
}

function summaryOf(model, letter) {
  const { certificate } = model;
  const mark = element("span", { class: "mark", "aria-hidden": "true" }, model.safe ? "\u2713" : "\u2715");
  const verdict = element("div", { class: `verdict ${model.safe ? "safe" : "unsafe"}` }, mark, verdictOf(model));
  const said = [certificate.statement, ...certificate.faults].join(". ") + ".";
  return element(
    "article",
    { class: "plan" },
    verdict,
    element(
      "div",
      { class: "heading" },
      element("h1", {}, letter ? element("span", { class: "letter" }, letter) : null, model.title),
      element("p", { class: "summary" }, model.summary + ". "),
      element("p", { class: "statement" }, said),
      origin(model),
    ),
    figures(model),
    premises(model),
  );
}

function verdictOf({ certificate, safe }) {
  return safe ? "SAFE" : certificate.ok ? "INVALID" : "NOT SAFE";
}

// Design, files, start, date and version, each if it is known.
function origin(model) {
  const parts = model.origin.map(([name, value]) =>
    element("div", {}, element("dt", {}, name), element("dd", {}, value)),
  );
  return element("dl", { class: "origin" }, ...parts);
}

function figures(model) {
  const { arrived, certificate } = model, losses = model.lost?.length;
  const figure = (name, value, unit, kind) => {
    const number = element("dd", {}, value, element("small", {}, unit));
    return element("div", kind ? { class: kind } : {}, element("dt", {}, name), number);
  };
  const least = certificate.ok ? "smallest proven clearance" : "smallest clearance";
  return element(
    "dl",
    { class: "figures" },
    arrived !== undefined && figure("arrived", String(arrived), " of " + (arrived + losses)),
    arrived !== undefined && figure("lost", String(losses), "", losses ? "lost" : ""),
    figure("duration", model.duration.toFixed(1), " s"),
    certificate.smallest !== null &&
      figure(least, proven(certificate.smallest).slice(0, -3), " mm", certificate.ok ? "" : "bad"),
    figure("margin", tidy(model.margin), " mm"),
  );
}

// What the proof is about and rests on: in a line, and all of it when opened.
function premises(model) {
  const { geometry, assumptions, opening } = model.certificate, count = assumptions.length + opening.length;
  const pairs = opening.map(({ pair, time, clearance }) => {
    const when = time === null ? "and never reach it" : `and have it from ${time.toFixed(2)} s on`;
    const what = `begin at ${millimetres(clearance)}, nearer than the margin, only come apart ${when}.`;
    return `${pair.map((arm) => model.armName(arm)).join(" and ")} ${what}`;
  });
  const all = [...assumptions, ...pairs];
  const short = count ? `${count} assumption${count > 1 ? "s" : ""}: ${all[0]}` : "these shapes alone: no assumptions";
  return element(
    "details",
    { class: "premises" },
    element("summary", {}, element("b", {}, "The proof rests on "), element("span", {}, short)),
    geometry && element("p", { class: "key" }, geometry),
    count ? list(all) : element("p", {}, "No assumptions."),
  );
}
