// Measuring in the scene: two picked points, with their distance and the angle between the picked faces. Points stay on
// what they were picked on while it moves. A third pick begins again; Esc or the button ends it, and so does drawing a
// path, which takes the clicks.
(() => {
  "use strict";
  const STILL = 4;  // [px] A pointer that moves farther between down and up turns the camera.
  const AWAY = 14, EDGE = 8;  // [px] Of the card from the middle of the line, and from the edges of the scene.
  const scene = window.rcilabScene, NS = "http://www.w3.org/2000/svg";
  let words = null, on = false, isDrawing = false, picks = [], lines = null, card = null, down = null, shown = "";

  const shape = (name, at) => {
    const made = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(at)) made.setAttribute(key, value);
    return made;
  };
  const build = () => {
    lines = shape("svg", { id: "rl-measure", class: "rl-overlay" });
    lines.append(shape("line", {}), shape("circle", { r: 4 }), shape("circle", { r: 4 }));
    card = document.createElement("div");
    card.id = "rl-measured";
    card.className = "rl-overlay";
    card.setAttribute("role", "status");
    document.body.append(lines, card);
  };

  const nameOf = (owner) => {
    const obstacle = /^\/cell\/obstacle(\d+)/.exec(owner), link = (owner.match(/\/joint\d/g) || []).length;
    if (obstacle) return words.obstacles[Number(obstacle[1])] || "";
    if (owner === "/ground") return words.floor;
    return owner.endsWith("/carried") ? words.tool : link ? words.link.replace("#", link) : words.base;
  };
  const number = (value, { factor, digits }) => (Math.round(value * factor * 10 ** digits) / 10 ** digits + 0).toFixed(digits);
  const line = (kind, text) => Object.assign(document.createElement("div"), { className: "rl-measured-" + kind, textContent: text });

  const say = () => {
    if (picks.length < 2) return [line("hint", picks.length ? words.second : words.first)];
    const base = scene.node("/base_axes"), [a, b] = picks.map(({ object, point }) => base.worldToLocal(object.localToWorld(point.clone())));
    const [n, m] = picks.map(({ object, normal }) => normal.clone().transformDirection(object.matrixWorld));
    const step = b.clone().sub(a), angle = Math.acos(Math.min(1, Math.abs(n.dot(m))));
    const [dx, dy, dz] = step.toArray().map((value) => number(value, words.length));
    return [
      line("distance", `${number(step.length(), words.length)}${words.length.unit}`),
      line("steps", `dx ${dx}  dy ${dy}  dz ${dz}`),
      line("angle", words.angle.replace("#", number(angle, words.angles) + words.angles.unit)),
      line("hint", picks.map(({ owner }) => nameOf(owner)).join(" → ")),
    ];
  };

  const follow = () => {
    if (!on) return;
    requestAnimationFrame(follow);
    const place = scene.box();
    if (!place) return;
    if (!picks.every(({ object }) => scene.isIn(object))) picks = [];
    const seen = picks.map(({ object, point }) => scene.project(object.localToWorld(point.clone())));
    const said = say(), now = JSON.stringify([seen, said.map((one) => one.textContent), place]);
    if (now === shown) return;
    shown = now;
    const [segment, ...dots] = lines.children;
    dots.forEach((dot, k) => {
      dot.style.display = seen[k] ? "" : "none";
      if (seen[k]) { dot.setAttribute("cx", seen[k][0]); dot.setAttribute("cy", seen[k][1]); }
    });
    const both = seen[0] && seen[1];
    segment.style.display = both ? "" : "none";
    if (both) ["x1", "y1", "x2", "y2"].forEach((key, k) => segment.setAttribute(key, seen.flat()[k]));
    card.replaceChildren(...said);
    const at = both ? [0, 1].map((k) => (seen[0][k] + seen[1][k]) / 2 + AWAY) : seen[0] ? seen[0].map((x) => x + AWAY) : [place.left + EDGE, place.top + EDGE];
    const inside = (x, low, high) => Math.max(low + EDGE, Math.min(x, high - EDGE));
    card.style.left = `${inside(at[0], place.left, place.right - card.offsetWidth)}px`;
    card.style.top = `${inside(at[1], place.top, place.bottom - card.offsetHeight)}px`;
  };

  const turn = (wanted) => {
    if (wanted === on || (wanted && (!words || isDrawing))) return;
    on = wanted;
    picks = [];
    shown = "";
    scene.block("measure", on);
    document.documentElement.classList.toggle("rl-measuring", on);
    window.dispatchEvent(new CustomEvent("rl-tool-on", { detail: { name: "measure", on } }));
    if (on) { build(); follow(); } else { lines.remove(); card.remove(); }
  };

  window.addEventListener("rl-news", ({ detail }) => {
    if (detail.measure) { words = detail.measure; shown = ""; }
    if ("drawing" in detail) isDrawing = detail.drawing;
    if (isDrawing) turn(false);
  });
  window.addEventListener("rl-tool", ({ detail }) => { if (detail.name === "measure") turn(!on); });
  window.addEventListener("keydown", (event) => { if (event.key === "Escape") turn(false); });
  window.addEventListener("pointerdown", (event) => { down = on && event.target === scene.canvas() && event.button === 0 ? event : null; }, true);
  window.addEventListener("pointerup", (event) => {
    const is = down && event.pointerId === down.pointerId && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) <= STILL;
    down = null;
    const hit = is && on ? scene.pick(event.clientX, event.clientY) : null;
    if (hit) picks = picks.length < 2 ? [...picks, hit] : [hit];
  }, true);
})();
