// What is told of one arm: under the pointer in a tip, of the selected in the panel.

function describe(model, arm, scene) {
  if (arm < 0) return describeObstacle(model, model.obstacles[-1 - arm], arm);
  const { classes, of } = scene.colouring;
  const near = nearest(model, arm), outcome = model.outcomeOf(arm), { angles } = model.motion;
  const to = (gap, other) => `${gap} to ${model.armName(other)}`;
  const nearby = near.arm === null ? "no neighbour" : to(millimetres(near.gap), near.arm);
  const always = Number.isFinite(model.proven[arm])
    ? to("\u2265 " + proven(model.proven[arm]), model.provenWith[arm])
    : null;
  const part = model.motion.progress(arm), blockers = model.blockersOf(arm);
  return [
    element("div", { class: "name" }, element("span", {}, named(model, arm)), swatch(classes[of[arm]])),
    element("p", { class: "why" }, outcome.label + (model.lossOf.has(arm) ? ": " + model.causeOf(arm) : "")),
    facts([
      ["alpha", degrees(angles[2 * arm])],
      ["beta", degrees(angles[2 * arm + 1])],
      ["clearance now", nearby, near.gap < model.certificate.margin ? "bad" : ""],
      ["proven at all times", always],
      ["priority", model.hasGoal(arm) ? tidy(model.priority[arm]) : null],
      ["on its way", Number.isNaN(part) ? "does not move" : `${(100 * part).toFixed(0)} %`],
      ["in the way", blockers.length ? blockers.map((other) => model.armName(other)).join(", ") : null],
    ]),
  ];
}

function describeObstacle(model, shape, arm) {
  const far = "arms may lie over or under it: it is at another height than " + (shape.over ?? []).join(", ");
  return [
    element("div", { class: "name" }, element("span", {}, model.armName(arm))),
    element("p", { class: "why" }, shape.category),
    facts([["keeps its distance from", shape.meets === null ? "everything" : shape.meets.join(", ") || "nothing"]]),
    shape.over ? element("p", { class: "why" }, far) : null,
  ].filter(Boolean);
}

class Selected {
  constructor(state, actions) {
    Object.assign(this, { state, actions, told: null });
    this.node = document.getElementById("selected");
  }

  // The buttons outlive a frame, so that they can be pressed while the plan plays.
  show(model, scene) {
    const { state, actions } = this, i = model.index.get(state.selected);
    const key = JSON.stringify([state.selected, state.kept]);
    this.node.hidden = i === undefined;
    if (i === undefined) return (this.told = null);
    if (this.told?.key !== key || this.told.model !== model) {
      this.told = { key, model };
      const kept = state.kept.includes(state.selected);
      const row = [
        button("Zoom in", () => actions.goTo(i)),
        button(kept ? "Forget curves" : "Keep curves", () => actions.keep(model.ids[i]), {
          title: "Keep its angles and speeds while others are chosen, to compare",
        }),
        button("Clear selection", () => actions.clear()),
      ];
      fill("selected", heading("Selected"), element("div"), element("div", { class: "chips" }, ...row));
      document.getElementById("status").textContent = `${model.ids[i]}, ${model.outcomeOf(i).label}`;
    }
    this.node.children[1].replaceChildren(...describe(model, i, scene));
  }
}
