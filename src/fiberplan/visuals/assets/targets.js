// Targets on the picture, and what became of them.

// Targets: a thin ring (a speck from afar), or a bold cross where the target is lost.
function drawTargets(scene) {
  const { ink, view, model, visible } = scene, afar = view.scale < 1.5, r = Math.min(7, 0.7 * view.scale);
  const rings = new Path2D(), fades = !scene.colouring.update; // targets are drawn once, so not with what changes
  ink.fillStyle = scene.colour("ink");
  const there = (i) => [view.right(model.goal[2 * i]), view.down(model.goal[2 * i + 1])];
  for (let i = 0; i < model.n; i++) {
    if (!visible[i] || !model.hasGoal(i) || model.isLost(i) || (fades && !scene.isShown(i))) continue;
    const [px, py] = there(i);
    if (afar) ink.fillRect(px - 0.5, py - 0.5, 1, 1);
    else {
      rings.moveTo(px + r, py);
      rings.arc(px, py, r, 0, 2 * Math.PI);
    }
  }
  if (!afar) scene.stroke(view.scale > 2.5 ? 1.3 : 0.9, scene.colour("ink"), rings);
  for (const { positioner: i } of model.losses) {
    if (!visible[i] || !model.hasGoal(i) || !model.isLost(i)) continue;
    const [px, py] = there(i), cross = new Path2D(), arm = Math.min(7, Math.max(4.5, 0.7 * view.scale));
    for (const side of [-1, 1]) {
      cross.moveTo(px - arm, py - side * arm);
      cross.lineTo(px + arm, py + side * arm);
    }
    ink.globalAlpha = scene.isShown(i) ? 1 : 0.1;
    scene.stroke(6, scene.colour("paper"), cross);
    scene.stroke(2.8, scene.colour(model.outcomeOf(i).key), cross);
  }
  ink.globalAlpha = 1;
}

// A dotted line from each lost target to the fiber that was to go there.
function drawLeashes(scene) {
  const { ink, view, model } = scene;
  ink.setLineDash([1, 4]);
  for (const { positioner: i } of model.losses) {
    if (!scene.visible[i] || !model.hasGoal(i) || !model.isLost(i) || !scene.isShown(i)) continue;
    ink.beginPath();
    ink.moveTo(view.right(model.motion.fibers[2 * i]), view.down(model.motion.fibers[2 * i + 1]));
    ink.lineTo(view.right(model.goal[2 * i]), view.down(model.goal[2 * i + 1]));
    scene.stroke(1.8, scene.colour(model.outcomeOf(i).key));
  }
  ink.setLineDash([]);
}
