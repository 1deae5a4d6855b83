// Rows that lead somewhere when they are clicked, or chosen with Enter or the space bar: the rows of the Check tab. Which
// one it was is written into a hidden field of viser's, so that it comes from this page and no other.
(() => {
  "use strict";
  let serial = Date.now();

  const say = (words) => {
    const field = document.querySelector("div:has(> .rl-saybridge) + div input, div:has(> div > .rl-saybridge) + div input");
    if (!field) return;
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(field, `${++serial}:${words}`);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  };

  const rowOf = (node) => node instanceof Element ? node.closest(".rl-pick [data-say]") : null;
  let kept = null;  // Every answer exchanges the rows' HTML; the focus stays on the row.

  const choose = (row) => { kept = row.dataset.say; say(kept); };

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
    const row = document.querySelector(`.rl-pick [data-say="${CSS.escape(kept)}"]`);
    if (row) row.focus({ preventScroll: true });
  }).observe(document.documentElement, { childList: true, subtree: true });
})();
