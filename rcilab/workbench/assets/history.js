// Undo and redo of everything on the page: two buttons in the bar, Ctrl+Z and Ctrl+Y outside of fields and lists.
(() => {
  "use strict";
  const ICONS = { undo: "M9 7 4.5 11.5 9 16M5 11.5h9a5 5 0 0 1 0 10h-3", redo: "m15 7 4.5 4.5L15 16M19 11.5h-9a5 5 0 0 0 0 10h3" };
  const KEYS = { undo: "Ctrl+Z", redo: "Ctrl+Y" };
  let words = null;

  const turn = (what) => window.dispatchEvent(new CustomEvent("rl-say", { detail: { kind: "turn", what } }));

  const show = () => {
    const bar = document.getElementById("rl-bar");
    if (!bar || !words) return;
    for (const what of ["undo", "redo"]) {
      let button = document.getElementById(`rl-${what}`);
      if (!button) {
        button = document.createElement("button");
        button.id = `rl-${what}`;
        button.type = "button";
        button.className = "rl-bar-button";
        button.innerHTML = `<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" stroke-linejoin="round" aria-hidden="true"><path d="${ICONS[what]}"/></svg>`;
        button.addEventListener("click", () => turn(what));
        bar.insertBefore(button, document.getElementById("rl-find") || document.getElementById("rl-home"));
      }
      button.disabled = !words.can[what];
      button.title = `${words[what]} (${KEYS[what]})`;
      button.setAttribute("aria-label", words[what]);
    }
  };
  window.addEventListener("rl-news", ({ detail }) => { if (detail.history) { words = detail.history; show(); } });

  window.addEventListener("keydown", (event) => {
    const at = event.target instanceof Element ? event.target : document.body;
    if (!(event.ctrlKey || event.metaKey) || event.altKey || at.closest("input, textarea, [contenteditable], .rl-steps")) return;
    const name = event.key.toLowerCase();
    const what = name === "y" || (name === "z" && event.shiftKey) ? "redo" : name === "z" ? "undo" : "";
    if (!what) return;
    event.preventDefault();
    turn(what);
  });
})();
