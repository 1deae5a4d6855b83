// Legends at the lower left corner of the scene: what its colours mean, and a slider for a plane across the workspace.
(() => {
  "use strict";
  const EDGE = 8, NARROWEST = 215, TOGETHER = 50;  // [px]; [px] of the scene; [ms] between two messages of a drag.
  const scene = window.rcilabScene;
  let corner = null, shown = "", due = null, timer = 0;

  const make = (tag, className, ...inside) => {
    const made = document.createElement(tag);
    made.className = className;
    made.append(...inside);
    return made;
  };
  const send = (axis, at) => {
    due = { kind: "cut", axis, at };
    if (timer) return;
    const flush = () => {
      timer = due ? setTimeout(flush, TOGETHER) : 0;
      if (due) window.dispatchEvent(new CustomEvent("rl-say", { detail: due }));
      due = null;
    };
    flush();
  };

  const bar = (colors) => make("div", "rl-colors", ...colors.map((color) => {
    const cell = make("i", "");
    cell.style.backgroundColor = color;
    return cell;
  }));
  const cutter = (cut) => {
    const buttons = [["none", cut.off], ["x", "x"], ["y", "y"], ["z", "z"]].map(([axis, label]) => {
      const button = make("button", "", label);
      button.type = "button";
      button.setAttribute("aria-pressed", String(axis === cut.axis));
      button.addEventListener("click", () => send(axis, (cut.low + cut.high) / 2));
      return button;
    });
    const rows = [make("div", "rl-cut", make("span", "", cut.label), ...buttons)];
    if (cut.axis !== "none") {
      const slider = Object.assign(document.createElement("input"), { type: "range", min: cut.low, max: cut.high, step: 0.01, value: cut.at });
      slider.setAttribute("aria-label", cut.label);
      slider.addEventListener("input", () => send(cut.axis, Number(slider.value)));
      rows.push(make("div", "rl-cut", slider, make("output", "", cut.shown)));
    }
    return rows;
  };
  const box = ({ id, title, colors, ends, beyond, cut }) => {
    const row = make("div", "rl-color-row", bar(colors)), below = make("div", "rl-color-ends", ...ends.map((end) => make("span", "", end)));
    if (beyond) {
      const swatch = make("i", "rl-beyond");
      swatch.style.backgroundColor = beyond.color;
      row.append(swatch, make("span", "", beyond.label));
    }
    const made = make("section", "rl-overlay rl-scene-legend", make("b", "", title), row, below, ...(cut ? cutter(cut) : []));
    made.dataset.id = id;
    return made;
  };

  // What is being dragged stays; only its number follows.
  const draw = (legends) => {
    const bare = JSON.stringify(legends, (key, value) => (key === "at" || key === "shown" ? undefined : value));
    if (bare === shown) {
      const cut = (legends.find((one) => one.cut) || {}).cut, [slider, output] = corner ? [corner.querySelector("input"), corner.querySelector("output")] : [];
      if (cut && slider) {
        output.textContent = cut.shown;
        if (slider !== document.activeElement) slider.value = cut.at;
      }
      return;
    }
    shown = bare;
    if (!corner) { corner = make("div", ""); corner.id = "rl-legends"; document.body.append(corner); }
    const focused = corner.contains(document.activeElement) ? document.activeElement.textContent : null;
    corner.replaceChildren(...legends.map(box));
    if (focused) [...corner.querySelectorAll("button")].find((button) => button.textContent === focused)?.focus();
    place();
  };
  const place = () => {
    const place = scene.box();
    if (!corner) return;
    corner.hidden = !place || place.width < NARROWEST;
    if (corner.hidden) return;
    corner.style.left = `${place.left + EDGE}px`;
    corner.style.bottom = `${window.innerHeight - place.bottom + EDGE}px`;
  };
  window.addEventListener("rl-news", ({ detail }) => { if (detail.legends) draw(detail.legends); });
  setInterval(place, 300);
})();
