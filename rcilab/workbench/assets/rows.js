// The list of the Program tab: rows that are chosen, moved and deleted by mouse and keyboard, and the button that copies
// the script.
(() => {
  "use strict";
  const LATE = 1500;  // [ms] A choice: for so long the list may still come as it was before the last choice.
  const ROW = 25, PAUSE = 60;  // [px] Height of a row; [ms] A choice: between two requests for other rows.
  let had = false, dragged = null, picked = null, since = 0, revealed = null, top = 0, scrolling = 0;

  const listOf = (node) => node instanceof Element ? node.closest(".rl-steps") : null;
  const rows = (list) => [...list.querySelectorAll("[data-key]")];
  const find = (list, holds) => rows(list).findIndex(holds);
  const chosen = (list) => {
    const mine = performance.now() - since < LATE ? find(list, (row) => row.dataset.key === picked) : -1;
    return mine >= 0 ? mine : find(list, (row) => row.dataset.key === list.dataset.selected);
  };

  const say = (what, key, index = 0) => {
    if (what === "select") { picked = key; since = performance.now(); }
    if (!["select", "up", "down", "move"].includes(what)) picked = null;  // Another row will be chosen for us.
    window.dispatchEvent(new CustomEvent("rl-act", { detail: { kind: "edit", what, key: Number(key), index: Number(index) } }));
  };

  const choose = (list, index) => {
    const all = rows(list), row = all[Math.min(Math.max(index, 0), all.length - 1)];
    if (!row) return;
    rows(list).forEach((other) => other.classList.remove("rl-marked"));
    mark(list, row);
    say("select", row.dataset.key);
  };

  const mark = (list, row) => {
    rows(list).forEach((other) => other.setAttribute("aria-selected", other === row || other.classList.contains("rl-marked") ? "true" : "false"));
    list.setAttribute("aria-activedescendant", row.id);
    if (row.dataset.key !== revealed) reveal(row);
    revealed = row.dataset.key;
  };

  const reveal = (row) => {
    const list = listOf(row), top = row.offsetTop - list.offsetTop;
    if (top < list.scrollTop) list.scrollTop = top;
    else if (top + row.offsetHeight > list.scrollTop + list.clientHeight) list.scrollTop = top + row.offsetHeight - list.clientHeight;
  };

  document.addEventListener("click", (event) => {
    const copy = event.target instanceof Element && event.target.closest("[data-rl-copy]");
    if (copy) {
      const code = copy.parentElement.querySelector("pre");
      navigator.clipboard.writeText(code.textContent).then(() => { copy.textContent = copy.dataset.done; }, () => {
        getSelection().selectAllChildren(code);  // A page that may not write: Ctrl+C copies it.
      });
      return;
    }
    const list = listOf(event.target), row = list && event.target.closest("[data-key]");
    if (!row) return;
    list.focus();
    had = true;
    if (event.shiftKey || event.ctrlKey || event.metaKey) say(event.shiftKey ? "extend" : "toggle", row.dataset.key);
    else choose(list, rows(list).indexOf(row));
  });

  document.addEventListener("keydown", (event) => {
    const lost = had && event.target === document.body;  // The list has just been exchanged.
    const list = lost ? document.querySelector(".rl-steps") : listOf(event.target);
    if (!list) return;
    const at = chosen(list), row = rows(list)[at], key = row ? row.dataset.key : list.dataset.selected, control = event.ctrlKey || event.metaKey;
    const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (event.altKey && (name === "ArrowUp" || name === "ArrowDown")) say(name === "ArrowUp" ? "up" : "down", key);
    else if (control && name === "z") say(event.shiftKey ? "redo" : "undo", 0);
    else if (control && name === "y") say("redo", 0);
    else if (control && name === "d") say("duplicate", key);
    else if (control && "acxv".includes(name)) say({ a: "all", c: "copy", x: "cut", v: "paste" }[name], key);
    else if (event.shiftKey && (name === "ArrowUp" || name === "ArrowDown")) {
      const other = rows(list)[at + (name === "ArrowUp" ? -1 : 1)];
      if (other) say("extend", other.dataset.key);
    }
    else if (control || event.altKey) return;
    else if (at < 0 && ["ArrowUp", "ArrowDown"].includes(name)) say("select", list.dataset.selected);  // It was scrolled away.
    else if (name === "ArrowUp") choose(list, at - 1);
    else if (name === "ArrowDown") choose(list, at + 1);
    else if (name === "Home") say("select", list.dataset.first);
    else if (name === "End") say("select", list.dataset.last);
    else if (name === "Delete") say("delete", key);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }, true);

  // Every change exchanges the list's HTML; whoever was in it stays in it.
  document.addEventListener("focusin", (event) => { had = listOf(event.target) !== null; });
  document.addEventListener("pointerdown", (event) => { if (!listOf(event.target)) had = false; }, true);
  let seen = null;
  new MutationObserver(() => {
    const list = document.querySelector(".rl-steps");
    if (list === seen) return;
    seen = list;
    if (!list) return;
    list.scrollTop = top;
    if (had && document.activeElement === document.body) list.focus({ preventScroll: true });
    const row = rows(list)[chosen(list)];
    if (row) mark(list, row);
  }).observe(document.documentElement, { childList: true, subtree: true });

  // A long program has only some of its rows here: those that are scrolled to are asked for.
  document.addEventListener("scroll", (event) => {
    const list = listOf(event.target);
    if (!list || list !== event.target) return;
    top = list.scrollTop;
    if (scrolling || !list.querySelector(".rl-steps-room")) return;
    scrolling = setTimeout(() => {
      scrolling = 0;
      if (!list.isConnected) return;
      const all = rows(list), first = Math.floor(list.scrollTop / ROW) - 1, last = first + Math.ceil(list.clientHeight / ROW);
      const has = (index) => Number(all[0].dataset.index) <= index && index <= Number(all[all.length - 1].dataset.index);
      const count = Number(all[0].getAttribute("aria-setsize"));
      if (has(Math.max(first, 0)) && has(Math.min(last, count - 1))) return;
      window.dispatchEvent(new CustomEvent("rl-say", { detail: { kind: "rows", index: Math.max(0, Math.round((first + last) / 2)) } }));
    }, PAUSE);
  }, true);

  const clear = () => document.querySelectorAll(".rl-over").forEach((row) => row.classList.remove("rl-over"));
  document.addEventListener("dragstart", (event) => {
    const row = listOf(event.target) && event.target.closest("[data-key]");
    if (!row) return;
    dragged = row.dataset.key;
    event.dataTransfer.effectAllowed = "move";
    event.dataTransfer.setData("text/plain", "");
  });
  document.addEventListener("dragover", (event) => {
    const row = dragged && listOf(event.target) && event.target.closest("[data-key]");
    if (!row) return;
    event.preventDefault();
    clear();
    row.classList.add("rl-over");
  });
  document.addEventListener("drop", (event) => {
    const row = dragged && listOf(event.target) && event.target.closest("[data-key]");
    if (row) { event.preventDefault(); say("move", dragged, row.dataset.index); }
    dragged = null;
    clear();
  });
  document.addEventListener("dragend", () => { dragged = null; clear(); });
})();
