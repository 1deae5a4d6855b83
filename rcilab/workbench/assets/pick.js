// Rows that are clicked, or chosen with Enter or the space bar: those of the Check tab, the entries of the
// Cell tab, and recorded runs.
(() => {
  "use strict";
  const rowOf = (node) => node instanceof Element ? node.closest(".rl-pick :is([data-condition], [data-entry], [data-run])") : null;
  const KINDS = ["condition", "entry", "run"], kindOf = (row) => KINDS.find((kind) => row.dataset[kind] !== undefined);
  const nameOf = (row) => `[data-${kindOf(row)}="${CSS.escape(row.dataset[kindOf(row)])}"]`;
  let kept = null;  // Every answer exchanges the rows' HTML; the focus stays on the row.

  const choose = (row) => {
    kept = nameOf(row);
    const { condition, entry, run } = row.dataset;
    const detail = {
      condition: { kind: "condition", id: condition }, entry: { kind: "entry", index: Number(entry) }, run: { kind: "recorded", name: run },
    }[kindOf(row)];
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
    else if (next && row.dataset.run !== undefined) next.focus();  // It takes a while to open: Enter does.
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
