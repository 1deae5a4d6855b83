// A path that is drawn by clicks in the scene: Enter ends it, Esc drops it (and is Stop besides, as always).
(() => {
  "use strict";
  let drawing = false;
  window.addEventListener("rl-news", ({ detail }) => {
    if (!("drawing" in detail)) return;
    drawing = detail.drawing;
    document.documentElement.toggleAttribute("data-rl-drawing", drawing);
  });
  window.addEventListener("keydown", (event) => {
    const what = { Enter: "end", Escape: "cancel" }[event.key];
    const isTyping = event.target instanceof Element && event.target.matches("input, textarea, select, button");
    if (!drawing || !what || event.repeat || (what === "end" && isTyping)) return;
    window.dispatchEvent(new CustomEvent("rl-act", { detail: { kind: "draw", what } }));
    event.preventDefault();
  });
})();
