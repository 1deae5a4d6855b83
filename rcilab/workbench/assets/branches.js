// The branch list of the Target tab: the row under the mouse, or with the focus, is shown in the scene; Enter, Space or
// a click chooses it.
(() => {
  "use strict";
  let sent = null, focused = -1;

  const rows = () => [...document.querySelectorAll(".rl-branch")];
  const rowOf = (node) => node instanceof Element ? node.closest(".rl-branch") : null;

  const choose = (row) => {
    window.dispatchEvent(new CustomEvent("rl-act", { detail: { kind: "branch", index: Number(row.dataset.branch) } }));
  };

  document.addEventListener("click", (event) => {
    const row = rowOf(event.target);
    if (row) { row.focus(); choose(row); }
  });

  document.addEventListener("keydown", (event) => {
    const row = rowOf(event.target);
    if (!row) return;
    const all = rows(), at = all.indexOf(row);
    const to = { ArrowUp: at - 1, ArrowDown: at + 1, Home: 0, End: all.length - 1 }[event.key];
    if (to !== undefined) { const other = all[Math.min(Math.max(to, 0), all.length - 1)]; if (other) other.focus(); }
    else if (event.key === "Enter" || event.key === " ") choose(row);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }, true);

  // The row under the mouse is polled below: the list's HTML is replaced under the mouse, without a mouseleave event.
  document.addEventListener("focusin", (event) => { const row = rowOf(event.target); focused = row ? Number(row.dataset.branch) : -1; });
  document.addEventListener("pointerdown", (event) => { if (!rowOf(event.target)) focused = -1; }, true);
  // Restores the focus in the same task as the replacement, so that no key is lost.
  const keep = () => {
    if (focused < 0 || document.activeElement !== document.body) return;
    const row = document.querySelector(`.rl-branch[data-branch="${focused}"]`);
    if (row && row.getClientRects().length) row.focus({ preventScroll: true });
  };
  new MutationObserver(keep).observe(document.documentElement, { childList: true, subtree: true });

  setInterval(() => {
    keep();
    const seen = document.querySelector(".rl-branch:hover") || rowOf(document.activeElement);
    const branch = seen && seen.getClientRects().length ? Number(seen.dataset.branch) : null;
    if (branch === sent) return;
    sent = branch;
    window.dispatchEvent(new CustomEvent("rl-say", { detail: { kind: "peek", branch } }));
  }, 70);
})();
