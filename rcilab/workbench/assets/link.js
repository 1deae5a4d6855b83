// A link to a view: the fragment of the address, #rcilab=..., has arm, cell and program. It is taken out of the address, so
// that loading the page again does not open it again, and sent once this page has the controls.
(() => {
  "use strict";
  const MARK = "#rcilab=";
  const PATIENCE = 5000;  // [ms] A choice: a page that is loaded again gets the controls back only after a moment.
  let me = null, holder, text = "", waiting = 0;
  const take = () => {  // At once: viser writes addresses without a fragment.
    if (!location.hash.startsWith(MARK)) return;
    text = location.hash.slice(MARK.length);
    history.replaceState(null, "", location.pathname + location.search);
    open();
  };
  const open = (isOver = false) => {
    if (!text || !me || holder === undefined) return;
    if (holder !== me.page && !isOver) {
      if (!waiting) waiting = setTimeout(() => { waiting = 0; open(true); }, PATIENCE);
      return;
    }
    clearTimeout(waiting);
    waiting = 0;
    window.dispatchEvent(new CustomEvent("rl-say", { detail: { kind: "link", text } }));
    text = "";
  };
  window.addEventListener("rl-me", ({ detail }) => { me = detail; open(); });
  window.addEventListener("rl-news", ({ detail }) => { if ("holder" in detail) { holder = detail.holder; open(); } });
  window.addEventListener("hashchange", take);
  take();

  // The token of an address belongs to its reader: it is no part of the link.
  window.rcilabLink = ({ link, text: said, tone }) => {
    const say = () => window.dispatchEvent(new CustomEvent("rl-toast", { detail: { text: said, tone } }));
    if (!link) return say();
    const address = location.origin + location.pathname + MARK + link;
    const ask = () => window.prompt(said, address);  // A page that may not write to the clipboard.
    if (!navigator.clipboard) ask();
    else navigator.clipboard.writeText(address).then(say, ask);
  };
})();
