// Rows that lead somewhere when they are clicked, or chosen with Enter or the space bar: the rows of the Check tab.
(() => {
  "use strict";
  const rowOf = (node) => node instanceof Element ? node.closest(".rl-pick [data-condition]") : null;
  let kept = null;  // Every answer exchanges the rows' HTML; the focus stays on the row.

  const choose = (row) => {
    kept = row.dataset.condition;
    window.dispatchEvent(new CustomEvent("rl-act", { detail: { kind: "condition", id: kept } }));
  };

  document.addEventListener("click", (event) => {
    const row = rowOf(event.target);
    if (row && !String(getSelection())) choose(row);
  });
  document.addEventListener("keydown", (event) => {
    const row = rowOf(event.target);
    if (!row || (event.key !== "Enter" && event.key !== " ")) return;
    choose(row);
    event.preventDefault();
  });
  document.addEventListener("focusin", (event) => { if (!rowOf(event.target)) kept = null; });
  new MutationObserver(() => {
    if (kept === null || document.activeElement !== document.body) return;
    const row = document.querySelector(`.rl-pick [data-condition="${CSS.escape(kept)}"]`);
    if (row) row.focus({ preventScroll: true });
  }).observe(document.documentElement, { childList: true, subtree: true });
})();
