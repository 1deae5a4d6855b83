// Groups stay folded or open as somebody left them: viser builds them anew with the page, and with another language.
// Unnecessary once viser keeps the state of a folder in the browser, by its label.
(() => {
  "use strict";
  const KEY = "rcilab.folds", PAUSE = 120;  // [ms] A choice: between two looks, whatever changes meanwhile.
  const HEAD = "#root .mantine-Paper-root > .mantine-Paper-root:first-child:has(> svg.tabler-icon)";
  const seen = new WeakMap();
  let folds = {};
  try { folds = JSON.parse(localStorage.getItem(KEY)) || {}; } catch { /* A browser that keeps nothing forgets. */ }
  const keep = () => { try { localStorage.setItem(KEY, JSON.stringify(folds)); } catch { /* As above. */ } };
  const sweep = () => {
    document.querySelectorAll(HEAD).forEach((head) => {
      const name = head.textContent.trim(), open = head.querySelector("svg").classList.contains("tabler-icon-chevron-up");
      if (!seen.has(head)) {
        if (head.getClientRects().length === 0) return;  // Of a tab that is not open: viser would open it with height 0.
        const wanted = name in folds ? folds[name] : open;
        seen.set(head, wanted);
        if (wanted !== open) head.click();
      } else if (seen.get(head) !== open) {
        seen.set(head, open);
        folds[name] = open;
        keep();
      }
    });
  };
  let timer = 0;
  const later = () => { if (!timer) timer = setTimeout(() => { timer = 0; sweep(); }, PAUSE); };
  const watch = () => { new MutationObserver(later).observe(document.body, { childList: true, subtree: true, attributes: true, attributeFilter: ["aria-selected"] }); later(); };
  if (document.body) watch(); else document.addEventListener("DOMContentLoaded", watch);
})();
