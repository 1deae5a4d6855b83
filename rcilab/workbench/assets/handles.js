// Handles in the scene are faint until the pointer is near them, so that they do not hide the arm. Pointing at the
// elbow's handle, or at the elbow's group in the Target tab, shows the elbow's circle.
(() => {
  "use strict";
  const LOOK = 300, SOON = 40;  // [ms] Between two looks for handles that came or moved; after the pointer moved.
  // Names of nodes, the distance from a handle's centre within which it is pointed at, [m], and its opacity otherwise.
  const HANDLES = [[/^\/target$|^\/cell_handles$|^\/setup_box$|\/handles_\w+$/, 0.3, 0.45], [/^\/elbow_handle$|^\/safety_box\/handle\d$/, 0.07, 0.55]];
  const scene = window.rcilabScene;
  let pointer = null, isHeld = false, edited = false, timer = 0;

  const isPointedAt = (node, reach) => {
    const centre = node.getWorldPosition(node.position.clone()), at = pointer && scene.project(centre);
    return Boolean(at) && Math.hypot(at[0] - pointer[0], at[1] - pointer[1]) <= reach * scene.scale(centre);
  };
  // The server makes them faint, too, but not all parts of viser's gizmo follow it.
  const light = (node, opacity) => {
    let changed = false;
    node.traverse(({ material }) => {
      if (!material || material.opacity === undefined) return;
      if (material.opacity !== opacity) { material.opacity = opacity; changed = true; }
    });
    return changed;
  };
  const groupOf = (element) => (element instanceof Element ? element.closest('#root [data-rl~="elbow"]') : null);
  let group = null;  // That the pointer is in.

  const look = () => {
    timer = 0;
    if (isHeld || !scene.box()) return;
    let changed = false, isElbow = Boolean(group) || Boolean(groupOf(document.activeElement) && document.activeElement.matches(":focus-visible"));
    for (const [name, node] of scene.nodes()) {
      const handle = HANDLES.find(([pattern]) => pattern.test(name));
      if (!handle || !scene.isShown(node)) continue;
      const on = isPointedAt(node, handle[1]);
      changed = light(node, on ? 1 : handle[2]) || changed;
      if (on && name === "/elbow_handle") isElbow = true;
    }
    if (changed) scene.draw();
    if (isElbow === edited) return;
    edited = isElbow;
    window.dispatchEvent(new CustomEvent("rl-say", { detail: { kind: "elbow", on: edited } }));
  };
  const soon = () => { if (!timer) timer = setTimeout(look, SOON); };
  const point = (event) => {
    pointer = event.target === scene.canvas() ? [event.clientX, event.clientY] : null;
    group = groupOf(event.target);
    soon();
  };
  window.addEventListener("pointermove", point, true);
  window.addEventListener("pointerdown", (event) => { point(event); isHeld = event.target === scene.canvas(); }, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    window.addEventListener(kind, (event) => {
      isHeld = false;
      if (event.pointerType === "touch") pointer = group = null;
      soon();
    }, true);
  }
  document.addEventListener("pointerleave", () => { pointer = group = null; soon(); });
  window.addEventListener("focusin", soon);
  setInterval(look, LOOK);
})();
