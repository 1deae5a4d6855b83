// The command palette: Ctrl+K lists what the page can do, by the page's own controls, and uses the one that is chosen.
// A button is clicked, a tab opened, an option chosen as by hand, so that all that holds for the control holds here, too.
(() => {
  "use strict";
  const MOST = 60;  // Tuning value: entries that are drawn; typing narrows them.
  const PAUSE = 30, PATIENCE = 10000;  // [ms] Between two looks for a control of a tab that is being opened, and for how long.
  let words = {}, box = null, input = null, list = null, entries = [], shown = [], at = 0, before = null;
  window.addEventListener("rl-news", ({ detail }) => { if (detail.palette) { words = detail.palette; label(); } });

  const textOf = (node) => node ? node.textContent.trim() : "";
  const tabs = () => [...document.querySelectorAll('#root [role="tab"]')];
  // viser's tabs react to keys and pointers, not to click().
  const openTab = (tab) => tab && tab.getAttribute("aria-selected") !== "true" && tab.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
  const headOf = (control) => {
    const folder = control.parentElement.closest(".mantine-Paper-root:has(> .mantine-Paper-root:first-child > svg.tabler-icon)");
    return folder && folder.querySelector(":scope > .mantine-Paper-root:first-child");
  };
  // Only an open tab has its controls in the page.
  const use = (id, place, act) => {
    openTab(tabs().find((tab) => textOf(tab) === place[0]));
    const until = performance.now() + PATIENCE;
    const look = () => {
      const control = document.getElementById(id);
      if (!control) { if (performance.now() < until) setTimeout(look, PAUSE); return; }
      const head = headOf(control), icon = head && head.querySelector(":scope > svg");
      if (icon && !icon.classList.contains("tabler-icon-chevron-up")) head.click();
      control.scrollIntoView({ block: "center" });
      control.focus({ preventScroll: true });
      act(control);
    };
    look();
  };
  const choose = (option) => (field) => {
    field.click();
    const until = performance.now() + PATIENCE;
    const look = () => {
      const found = [...document.querySelectorAll('[role="option"]')].find((row) => textOf(row) === option && row.getClientRects().length && !row.closest("#rl-palette"));
      if (found) found.click();
      else if (performance.now() < until) setTimeout(look, PAUSE);
    };
    look();
  };
  const collect = (controls) => {
    const found = tabs().map((tab) => ({ name: textOf(tab), place: words.tab, hint: "", run: () => openTab(tab) }));
    for (const { id, name, hint, place, off, options } of controls) {
      const entry = { place: place.join(" › "), hint, off };
      if (options.length) options.forEach((option) => found.push({ ...entry, name: `${name}: ${option}`, run: () => use(id, place, choose(option)) }));
      else found.push({ ...entry, name, run: () => use(id, place, (control) => control.click()) });
    }
    document.querySelectorAll("#rl-toolbar button").forEach((button, index) => found.push({ name: button.title, place: words.scene, hint: "", off: button.disabled, run: () => document.querySelectorAll("#rl-toolbar button")[index].click() }));
    return found.filter((entry) => entry.name);
  };
  // The answer of the server to the palette that has just been opened.
  window.rcilabCommands = (controls) => {
    if (!box) return;
    entries = collect(controls);
    draw();
  };

  const matches = (entry, parts) => parts.every((part) => `${entry.name} ${entry.place} ${entry.hint}`.toLowerCase().includes(part));
  const rank = (entry, typed) => {
    const name = entry.name.toLowerCase();
    return (name.startsWith(typed) ? 0 : name.includes(typed) ? 1 : 2) + (entry.off ? 0.5 : 0);
  };
  const draw = () => {
    const typed = input.value.trim().toLowerCase(), parts = typed.split(/\s+/).filter(Boolean);
    const found = entries.filter((entry) => matches(entry, parts)).sort((a, b) => rank(a, typed) - rank(b, typed));
    shown = found.slice(0, MOST);
    at = Math.min(at, Math.max(shown.length - 1, 0));
    list.replaceChildren(...shown.map((entry, index) => {
      const row = document.createElement("div"), name = document.createElement("b"), place = document.createElement("small");
      row.setAttribute("role", "option");
      row.id = `rl-command-${index}`;
      row.setAttribute("aria-selected", String(index === at));
      if (entry.off) row.setAttribute("aria-disabled", "true");
      if (entry.hint) row.title = entry.hint;
      name.textContent = entry.name;
      place.textContent = entry.place;
      row.append(name, place);
      row.addEventListener("click", () => { at = index; run(); });
      return row;
    }));
    if (!shown.length) list.append(Object.assign(document.createElement("p"), { textContent: words.none }));
    select(at);
  };
  const select = (index) => {
    if (!shown.length) return;
    at = (index + shown.length) % shown.length;
    [...list.children].forEach((row, i) => row.setAttribute("aria-selected", String(i === at)));
    input.setAttribute("aria-activedescendant", `rl-command-${at}`);
    list.children[at].scrollIntoView({ block: "nearest" });
  };
  const run = () => {
    const entry = shown[at];
    if (!entry || entry.off) return;
    close();
    entry.run();
  };

  const open = () => {
    if (box || !words.find) return close();
    before = document.activeElement;
    entries = collect([]);
    window.dispatchEvent(new CustomEvent("rl-say", { detail: { kind: "commands" } }));
    at = 0;
    box = document.createElement("div");
    box.id = "rl-palette";
    box.setAttribute("role", "dialog");
    box.setAttribute("aria-label", words.title);
    input = document.createElement("input");
    input.type = "text";
    input.placeholder = words.find;
    for (const [name, value] of Object.entries({ role: "combobox", "aria-expanded": "true", "aria-controls": "rl-commands", "aria-label": words.find, autocomplete: "off" })) input.setAttribute(name, value);
    list = document.createElement("div");
    list.id = "rl-commands";
    list.setAttribute("role", "listbox");
    list.setAttribute("aria-label", words.title);
    input.addEventListener("input", () => { at = 0; draw(); });
    input.addEventListener("keydown", (event) => {
      const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 }[event.key];
      if (step) select(Math.abs(step) > 1 ? Math.min(Math.max(at + step, 0), shown.length - 1) : at + step);
      else if (event.key === "Enter") run();
      else if (event.key !== "Tab") return;
      event.preventDefault();
    });
    box.append(input, list);
    box.addEventListener("focusout", (event) => { if (box && !box.contains(event.relatedTarget)) setTimeout(() => { if (box && !box.contains(document.activeElement)) close(); }, 0); });
    list.addEventListener("mousedown", (event) => event.preventDefault());  // The focus stays in the field.
    document.body.append(box);
    input.focus();
    draw();
  };
  const close = () => {
    if (!box) return;
    const gone = box;
    box = null;
    gone.remove();
    if (before && before.isConnected) before.focus({ preventScroll: true });
  };

  // The button in the bar.
  const label = () => {
    const bar = document.getElementById("rl-bar");
    if (!bar) return;
    let button = document.getElementById("rl-find");
    if (!button) {
      button = document.createElement("button");
      button.id = "rl-find";
      button.type = "button";
      button.innerHTML = '<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" aria-hidden="true"><circle cx="10.5" cy="10.5" r="6"/><path d="m15 15 5.5 5.5"/></svg>';
      button.addEventListener("click", open);
      bar.insertBefore(button, document.getElementById("rl-home"));
    }
    button.title = `${words.title} (Ctrl+K)`;
    button.setAttribute("aria-label", words.title);
  };
  window.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && !event.altKey && !event.shiftKey && event.key.toLowerCase() === "k") { event.preventDefault(); event.stopPropagation(); open(); }
    else if (event.key === "Escape") close();
  }, true);
})();
