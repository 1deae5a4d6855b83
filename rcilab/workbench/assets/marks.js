// What viser's boxes hold, written on them as data-rl, so that the style sheet can tell them apart. It could ask with
// :has(), but with a hundred such questions the browser looks at the whole page again whenever a piece of HTML changes,
// which took 45 ms instead of half of one. Done in the same breath as viser's change, before anything is drawn.
// Unnecessary once viser gives its controls classes of the application's own.
(() => {
  "use strict";
  // .rl-NAME, an element of ours: "NAME" is the box around the one it is in, as viser wraps every control; "in-NAME" that.
  const NAMES = new Set(["across", "anyone", "axes", "bare", "buttons", "choices", "elbow", "exports", "held", "jogset", "joints",
    "pairs", "poses", "ring", "rows", "setup-head", "signals", "strip", "tools", "trios", "triples", "under", "wall", "wide", "worded"]);
  const MARKERS = [...NAMES].map((name) => ".rl-" + name).join();
  const MANY = 7;  // Tabs: the main panel has eight, the others one or two.
  let root = null, marked = new Map();

  const look = () => {
    const found = new Map();
    const mark = (box, word) => {
      if (!box) return;
      if (!found.has(box)) found.set(box, new Set());
      found.get(box).add(word);
    };
    root.querySelectorAll(MARKERS).forEach((marker) => {
      const inner = marker.parentElement, outer = inner.parentElement;
      marker.classList.forEach((name) => {
        name = name.slice(3);
        if (!NAMES.has(name)) return;
        mark(inner, "in-" + name);
        mark(outer, name);
        const mates = { triples: [".mantine-TextInput-root", "box"], trios: ["button", "button"], buttons: [".rl-verdict", "verdict"] };
        const mate = mates[name];
        if (mate) for (const child of outer.children) if (child.querySelector(mate[0])) mark(child, mate[1]);
        if (name === "bare") mark(outer.parentElement.closest(".mantine-Paper-root"), "around-bare");
      });
    });
    root.querySelectorAll(".mantine-Flex-root > div:first-child").forEach((box) => { 
      if (box.querySelector("label")) mark(box, "label");
      if (box.parentElement.querySelector(".mantine-Checkbox-root")) mark(box, "of-tick");
    });
    root.querySelectorAll("div > p > label:empty").forEach((label) => mark(label.parentElement.parentElement, "nameless"));
    root.querySelectorAll(".mantine-Paper-root").forEach((group) => {
      let before = group.previousElementSibling;
      while (before && !before.childElementCount) before = before.previousElementSibling;  // A piece of HTML that says nothing.
      const last = before && before.lastElementChild;
      if (last && last.matches(".rl-verdict, .rl-note, .rl-table, .rl-meter, .rl-problem, .rl-slot")) mark(before, "above-group");
    });
    root.querySelectorAll('[role="tablist"]').forEach((tabs) => {
      mark(tabs.parentElement, "tabs");
      if (tabs.children.length < MANY) return;
      mark(tabs, "many");
      mark(tabs.closest(".mantine-ScrollArea-root"), "tabbed");
    });
    root.querySelectorAll(".mantine-Paper-root > svg.tabler-icon-chevron-down").forEach((icon) => {
      const head = icon.parentElement;
      mark(head, "in-folded");
      if (head.matches(".mantine-Paper-root > :first-child")) mark(head.parentElement, "folded");
    });
    for (const box of marked.keys()) if (!found.has(box)) delete box.dataset.rl;
    for (const [box, words] of found) {
      const said = [...words].join(" ");
      if (box.dataset.rl !== said) box.dataset.rl = said;
    }
    marked = found;
  };

  const isElement = (node) => node.nodeType === Node.ELEMENT_NODE;
  const watch = () => {
    root = document.getElementById("root");
    new MutationObserver((changes) => {
      if (changes.some((change) => [...change.addedNodes, ...change.removedNodes].some(isElement))) look();
    }).observe(root, { childList: true, subtree: true });
    look();
  };
  if (document.body) watch(); else document.addEventListener("DOMContentLoaded", watch);
})();
