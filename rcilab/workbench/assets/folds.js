// Groups stay folded or open as they were left: viser builds them anew with the page, and with another language.
// Unnecessary once viser keeps the state of a folder in the browser, by its label.
(() => {
  "use strict";
  const KEY = "rcilab.folds", PAUSE = 120;  // [ms] Between two looks, whatever changes meanwhile.
  const HEAD = "#root .mantine-Paper-root > .mantine-Paper-root:first-child:has(> svg.tabler-icon)";
  const seen = new WeakSet();
  let folds = {}, isOurs = false;
  try { folds = JSON.parse(localStorage.getItem(KEY)) || {}; } catch { /* A browser that keeps nothing forgets. */ }
  const keep = () => { try { localStorage.setItem(KEY, JSON.stringify(folds)); } catch { /* As above. */ } };
  const nameOf = (head) => head.textContent.trim();
  const isOpen = (head) => head.querySelector("svg").classList.contains("tabler-icon-chevron-up");
  const sweep = () => {
    document.querySelectorAll(HEAD).forEach((head) => {
      if (seen.has(head) || head.getClientRects().length === 0) return;  // In a tab that is not open, viser opens it with height 0.
      seen.add(head);
      const name = nameOf(head);
      if (!(name in folds) || folds[name] === isOpen(head)) return;
      isOurs = true;
      head.click();
      isOurs = false;
    });
  };
  document.addEventListener("click", (event) => {
    const head = !isOurs && event.target instanceof Element && event.target.closest(HEAD);
    if (!head) return;
    seen.add(head);
    folds[nameOf(head)] = !isOpen(head);
    keep();
  }, true);  // Before viser's own listener: a choice counts however soon another tab or another arm follows.
  let timer = 0;
  const later = () => { if (!timer) timer = setTimeout(() => { timer = 0; sweep(); }, PAUSE); };
  const watch = () => { new MutationObserver(later).observe(document.body, { childList: true, subtree: true, attributes: true, attributeFilter: ["aria-selected"] }); later(); };
  if (document.body) watch(); else document.addEventListener("DOMContentLoaded", watch);
})();
