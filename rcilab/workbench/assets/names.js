// Names for controls that viser leaves without one: its sliders say aria-label="" and the labels of its text boxes point
// nowhere. A name is the label of the row, with the heading above where there is one; a box without a label is that of
// the control before it. Folders open with a mouse only: they become buttons. The hint of a button lies in its icon
// (views/icons.py), since viser shows none. All of it again whenever viser redraws.
// Unnecessary once viser names sliders, text boxes and picture buttons, shows hints, and makes folders buttons.
(() => {
  "use strict";
  const PAUSE = 200;  // [ms] A choice: between two looks, whatever changes meanwhile.
  const labelOf = (box) => {
    const label = box && box.querySelector("label");
    return label ? label.textContent.trim() : "";
  };
  const lineOf = (control) => {
    let box = control.closest(".mantine-Flex-root");
    while (box && box.parentElement && box.parentElement.children.length < 2) box = box.parentElement;
    return box;
  };
  const headingOf = (line) => {
    for (let box = line && line.previousElementSibling; box; box = box.previousElementSibling) {
      const heading = box.querySelector(".rl-rowname");
      if (heading) return heading.textContent.trim();
    }
    return "";
  };
  const nameOf = (control) => {
    const line = lineOf(control);
    let name = labelOf(control.closest(".mantine-Flex-root"));
    for (let box = line; box && !name; box = box.previousElementSibling) name = labelOf(box);
    const heading = headingOf(line);
    return heading && name ? `${heading}: ${name}` : name;
  };
  const hasName = (control) => {
    const labelled = (control.getAttribute("aria-labelledby") || "").split(/\s+/).some((id) => id && document.getElementById(id));
    return labelled || (control.labels && control.labels.length > 0 && [...control.labels].some((label) => label.textContent.trim()));
  };
  const sweep = () => {
    document.querySelectorAll('#root [role="slider"], #root input:not([type="hidden"]):not([type="file"]), #root textarea').forEach((control) => {
      if (control.dataset.rlName === undefined && (hasName(control) || control.getAttribute("aria-label"))) return;
      const name = nameOf(control);
      if (name && control.getAttribute("aria-label") !== name) control.setAttribute("aria-label", name);
      if (name && control.dataset.rlName === undefined) control.dataset.rlName = "";  // Written again it would be drawn again.
    });
  };
  // The one button of viser's that has only a picture: scene tree, connection, its own settings.
  const sweepButtons = () => {
    const name = document.documentElement.dataset.rlViser || "";
    document.querySelectorAll("#root button.mantine-ActionIcon-root").forEach((button) => {
      if (name && !button.textContent.trim() && (!button.getAttribute("aria-label") || button.dataset.rlName !== undefined)) {
        if (button.dataset.rlName === undefined) button.dataset.rlName = "";
        if (button.getAttribute("aria-label") !== name) button.setAttribute("aria-label", name);
      }
    });
  };
  const sweepHints = () => {
    document.querySelectorAll("#root button svg[data-rl-hint]").forEach((icon) => {
      const button = icon.closest("button"), hint = icon.dataset.rlHint;
      if (button.title !== hint) button.title = hint;
    });
  };
  const FOLDER = "#root .mantine-Paper-root > .mantine-Paper-root:first-child:has(> svg.tabler-icon)";
  const sweepFolders = () => {
    document.querySelectorAll(FOLDER).forEach((head) => {
      const icon = head.querySelector("svg"), open = icon.classList.contains("tabler-icon-chevron-up");
      if (head.getAttribute("role") !== "button") { head.setAttribute("role", "button"); head.tabIndex = 0; }
      if (head.getAttribute("aria-expanded") !== String(open)) head.setAttribute("aria-expanded", String(open));
    });
  };
  document.addEventListener("keydown", (event) => {
    const head = (event.key === "Enter" || event.key === " ") && event.target instanceof Element && event.target.closest(FOLDER);
    if (!head || head !== event.target) return;
    event.preventDefault();
    head.click();
  });
  let timer = 0;
  const later = () => { if (!timer) timer = setTimeout(() => { timer = 0; sweep(); sweepButtons(); sweepHints(); sweepFolders(); }, PAUSE); };
  const watch = () => {
    new MutationObserver(later).observe(document.body, { childList: true, subtree: true, characterData: true, attributes: true, attributeFilter: ["aria-label"] });
    later();
  };
  if (document.body) watch(); else document.addEventListener("DOMContentLoaded", watch);
})();
