// A finger in the scene turns the camera, so that no touch moves a target, an obstacle or a link by accident: what is
// under it reacts after a long press only. A short tap is a click.
(() => {
  "use strict";
  const LONG = 500;  // [ms] A choice: as long as for a context menu.
  const STILL = 8;  // [px]
  const scene = window.rcilabScene;
  let finger = null, timer = 0;

  const again = (kind, from) => from.target.dispatchEvent(new PointerEvent(kind, {
    bubbles: true, cancelable: true, composed: true, pointerId: from.pointerId, pointerType: "touch", isPrimary: true,
    clientX: from.clientX, clientY: from.clientY, button: 0, buttons: kind === "pointerdown" ? 1 : 0,
  }));
  const press = () => {
    scene.stopCamera();
    scene.block("touch", false);
    again("pointerdown", finger);
  };

  window.addEventListener("pointerdown", (event) => {
    if (!event.isTrusted || event.pointerType !== "touch" || event.target !== scene.canvas()) return;
    clearTimeout(timer);
    finger = event.isPrimary ? event : null;
    scene.block("touch", true);
    if (finger) timer = setTimeout(() => { press(); if (navigator.vibrate) navigator.vibrate(20); finger = null; }, LONG);
  }, true);
  window.addEventListener("pointermove", (event) => {
    if (!finger || event.pointerId !== finger.pointerId) return;
    if (Math.hypot(event.clientX - finger.clientX, event.clientY - finger.clientY) <= STILL) return;
    clearTimeout(timer);
    finger = null;
  }, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    window.addEventListener(kind, (event) => {
      if (!event.isTrusted || event.pointerType !== "touch") return;
      setTimeout(() => scene.block("touch", false));  // A mouse may come next.
      if (!finger || event.pointerId !== finger.pointerId) return;
      clearTimeout(timer);
      if (kind === "pointerup") press();  // The release follows.
      finger = null;
    }, true);
  }
})();
