// Lists that lead somewhere: the pairs that come closest, lost targets by cause, and what a search finds.

// Pressing one goes to the moment and the place at which the two are nearest.
function fillClosest(model, actions) {
  const rows = model.closest.map((one) => {
    const names = one.pair.map((arm) => model.armName(arm)).join(", ");
    const gap = one.proven === null ? millimetres(one.clearance) : "\u2265 " + proven(one.proven);
    return element(
      "li",
      {},
      button(names, () => actions.pair(one), { title: `${names}: go to the moment and the place` }),
      element("span", {}, gap),
      element("span", {}, one.time.toFixed(2) + " s"),
    );
  });
  const few = element("ol", { class: "closest" }, ...rows.slice(0, 8));
  const more = rows.length > 8 && button(`Show ${rows.length - 8} more`, () => {
    few.append(...rows.slice(8));
    more.remove();
  }, { class: "more" });
  const none = element("p", {}, "Nothing comes within 2 mm of the margin.");
  fill("closest", heading("Closest pairs"), rows.length ? few : none, more);
}

const ORDERS = {
  priority: ["highest priority first", (a, b) => b.priority - a.priority],
  distance: ["farthest from its target first", (a, b) => (b.distance ?? Infinity) - (a.distance ?? Infinity)],
  id: ["by id", () => 0],
};

// Who is not at its target and why, by cause. Pressing one shows it together with those in its way.
function fillLosses(model, actions, order = "priority") {
  if (!model.lost) return fill("losses"); // a motion without targets
  const { losses } = model, compare = ORDERS[order][1];
  const names = new Intl.Collator("en", { numeric: true });
  const byId = (a, b) => names.compare(model.ids[a.positioner], model.ids[b.positioner]);
  const sorted = [...losses].sort((a, b) => compare(a, b) || byId(a, b));
  const causes = [...new Set(sorted.map(({ group }) => group))];
  const groups = causes.map((cause) => {
    const members = sorted.filter(({ group }) => group === cause);
    const total = members.reduce((sum, { priority }) => sum + priority, 0);
    return element(
      "details",
      { open: true, class: "cause" },
      element("summary", {}, `${cause} (${members.length}), priority ${tidy(total)} in all`),
      ...capped(members.map((loss) => lossItem(model, loss, actions))),
    );
  });
  const none = model.arrived ? "None: every target is reached." : "None: no target was asked for.";
  const choices = Object.entries(ORDERS).map(([key, [words]]) =>
    element("option", { value: key, selected: key === order }, words),
  );
  const choose = (event) => {
    fillLosses(model, actions, event.target.value);
    document.querySelector("#losses select").focus();
  };
  fill(
    "losses",
    heading(`Lost targets (${model.lost.length})`),
    losses.length > 1
      ? element("label", { class: "order" }, "Order ", element("select", { onchange: choose }, ...choices))
      : null,
    ...groups,
    groups.length ? null : element("p", {}, none),
  );
}

function lossItem(model, loss, actions) {
  const { positioner: i, priority, distance, cause, blockers } = loss;
  const left = distance === null ? "" : `, ends ${millimetres(distance)} from its target`;
  return element(
    "div",
    { class: "item", colour: model.outcomeOf(i).key },
    element("span", { class: "what" }, model.outcomeOf(i).label),
    button(model.ids[i], () => actions.blame(i)),
    element("p", {}, cause),
    element("p", { class: "left" }, `priority ${tidy(priority)}${left}`),
    chips("in the way", blockers, model, actions),
  );
}

// Positioners whose id contains the text, best first; the first one's index, or null.
function fillHits(model, text, actions) {
  const wanted = text.trim().toLowerCase();
  const rank = (id) => (id === wanted ? 0 : id.startsWith(wanted) ? 1 : 2);
  const second = (i) => model.aliases?.[i] ?? "";
  const hits = wanted
    ? model.ids
        .map((id, i) => [id.toLowerCase(), i, second(i).toLowerCase()])
        .filter(([id, , alias]) => id.includes(wanted) || alias.includes(wanted))
        .sort((a, b) => rank(a[0]) - rank(b[0]) || a[1] - b[1])
        .map(([, i]) => i)
    : [];
  const rows = hits.slice(0, 8).map((i) => element("li", {}, button(named(model, i), () => actions.goTo(i))));
  const clear = () => button("Clear search", () => actions.clearSearch());
  if (wanted && !hits.length) rows.push(element("li", {}, "No positioner of that name. ", clear()));
  if (hits.length > 8) rows.push(element("li", {}, `and ${hits.length - 8} more`));
  fill("hits", ...rows);
  return hits[0] ?? null;
}

const named = (model, i) => model.ids[i] + (model.aliases?.[i] ? ` (${model.aliases[i]})` : "");
