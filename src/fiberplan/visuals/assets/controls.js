// Buttons, fields and keys.

function listen() {
  byId("zoom-in").addEventListener("click", () => view.zoom(1.5));
  byId("zoom-out").addEventListener("click", () => view.zoom(1 / 1.5));
  for (const id of ["reset", "show-everything"]) byId(id).addEventListener("click", () => view.reset());
  byId("save").addEventListener("click", () => savePicture(panes, timeline.time));
  byId("colour").addEventListener("change", (event) => actions.colour(event.target.value));
  // what the address was changed to: the page may have written its own since
  window.addEventListener("hashchange", ({ newURL }) => follow(readLink(new URL(newURL).hash)));

  const search = byId("search");
  search.addEventListener("input", () => fillHits(here(), search.value, actions));
  search.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    const first = fillHits(here(), search.value, actions);
    if (first !== null) actions.goTo(first);
  });

  const step = (event, sign) => timeline.seek(timeline.time + (sign * (event.shiftKey ? 10 : 1) * timeline.end) / 100);
  const keys = {
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
    c: () => actions.closest(),
    Escape: () => actions.clear(),
  };
  document.addEventListener("keydown", (event) => {
    const typing = event.target === search || event.target.tagName === "SELECT";
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (typing && event.key === "Escape") event.target.blur();
    const pressing = event.key === " " && ["BUTTON", "SUMMARY"].includes(event.target.tagName);
    if (typing || pressing || !(event.key in keys)) return;
    event.preventDefault();
    keys[event.key](event);
  });

  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    for (const { scene } of panes) scene.readColours();
    timeline.colour = panes[0].scene.colour;
    redraw();
  });
}
