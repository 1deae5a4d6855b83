// Rows that are clicked, or chosen with Enter or the space bar: those of the Check tab, and the entries of the Cell tab.
(() => {
  "use strict";
  const rowOf = (node) => node instanceof Element ? node.closest(".rl-pick :is([data-condition], [data-entry])") : null;
  const nameOf = (row) => row.dataset.condition === undefined ? `[data-entry="${row.dataset.entry}"]` : `[data-condition="${CSS.escape(row.dataset.condition)}"]`;
  let kept = null;  // Every answer exchanges the rows' HTML; the focus stays on the row.

  const choose = (row) => {
    kept = nameOf(row);
    const { condition, entry } = row.dataset;
    const detail = condition === undefined ? { kind: "entry", index: Number(entry) } : { kind: "condition", id: condition };
    window.dispatchEvent(new CustomEvent("rl-act", { detail }));
  };

  document.addEventListener("click", (event) => {
    const row = rowOf(event.target);
    if (row && !String(getSelection())) choose(row);
  });
  document.addEventListener("keydown", (event) => {
    const row = rowOf(event.target);
    if (!row) return;
    const next = { ArrowUp: row.previousElementSibling, ArrowDown: row.nextElementSibling }[event.key];
    if (next && row.dataset.entry !== undefined) { next.focus(); choose(next); }
    else if (event.key === "Enter" || event.key === " ") choose(row);
    else return;
    event.preventDefault();
  });
  document.addEventListener("focusin", (event) => { if (!rowOf(event.target)) kept = null; });
  new MutationObserver(() => {
    if (kept === null || document.activeElement !== document.body) return;
    const row = document.querySelector(`.rl-pick ${kept}`);
    if (row) row.focus({ preventScroll: true });
  }).observe(document.documentElement, { childList: true, subtree: true });
})();
