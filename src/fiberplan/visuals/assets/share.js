// A moment to pass on: as a link (#t=3.2&id=R0C1&colour=clearance&plan=B) or as a picture.

// What an address asks for; what it does not say is left out.
function readLink(hash = location.hash) {
  const said = new URLSearchParams(hash.slice(1)), found = {};
  if (said.has("t") && Number.isFinite(Number(said.get("t")))) found.t = Number(said.get("t"));
  if (said.has("id")) found.ids = said.getAll("id");
  if (said.get("colour") in COLOURINGS) found.colour = said.get("colour");
  if (/^[AB]$/.test(said.get("plan") ?? "")) found.plan = "AB".indexOf(said.get("plan"));
  return found;
}

// Browsers refuse addresses that change too often, so it follows when things rest.
const writeLink = (() => {
  let waiting = null;
  return (time, ids, colour, plan) => {
    clearTimeout(waiting);
    waiting = setTimeout(() => {
      const said = new URLSearchParams();
      said.set("t", String(Number(time.toFixed(3))));
      ids.forEach((id) => said.append("id", id.toWellFormed?.() ?? id));
      if (colour !== "outcome") said.set("colour", colour);
      if (plan) said.set("plan", "AB"[plan]);
      const wanted = "#" + said;
      if (wanted === location.hash || location.protocol === "about:") return; // a frame of a notebook has no address
      history.replaceState(null, "", wanted);
    }, 250);
  };
})();

// The picture as it is, with a line that says of what and when, as a PNG file.
function savePicture(panes, time) {
  const [first] = panes, ratio = first.canvas.width / first.scene.view.width, line = 44 * ratio;
  const whole = document.createElement("canvas");
  whole.width = panes.reduce((sum, { canvas }) => sum + canvas.width, 0);
  whole.height = first.canvas.height + line;
  const ink = whole.getContext("2d");
  ink.fillStyle = first.scene.colour("paper");
  ink.fillRect(0, 0, whole.width, whole.height);
  let left = 0;
  for (const { canvas, model, scene } of panes) {
    ink.drawImage(canvas, left, line);
    ink.fillStyle = scene.colour("ink");
    ink.font = `600 ${14 * ratio}px ${scene.font}`;
    ink.fillText(`${model.title}, ${time.toFixed(2)} s`, left + 12 * ratio, 18 * ratio, canvas.width - 24 * ratio);
    ink.fillStyle = scene.colour("muted");
    ink.font = `${12 * ratio}px ${scene.font}`;
    ink.fillText(`${verdictOf(model)}: ${model.summary}`, left + 12 * ratio, 36 * ratio, canvas.width - 24 * ratio);
    left += canvas.width;
  }
  const name = `${panes[0].model.title}-${time.toFixed(2)}s.png`.replace(/[^\w.+-]+/g, "_");
  whole.toBlob((blob) => {
    const link = element("a", { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}
