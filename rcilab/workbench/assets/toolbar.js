// The toolbar in the scene, at its upper right corner: views of the camera, what the scene shows besides, and tools.
(() => {
  "use strict";
  const svg = (path) => `<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="1.8" stroke-linecap="round" stroke-linejoin="round" aria-hidden="true">${path}</svg>`;
  const CUBE = '<path d="M12 3 20 7.5v9L12 21l-8-4.5v-9z M12 12v9 M12 12 4 7.5 M12 12l8-4.5"/>';
  const face = (points) => svg(CUBE + `<path d="${points}" fill="currentColor" fill-opacity=".55"/>`);
  const ICONS = {
    home: svg('<path d="M4 9V4h5 M15 4h5v5 M20 15v5h-5 M9 20H4v-5"/><circle cx="12" cy="12" r="2.5"/>'),
    top: face("M12 3 20 7.5 12 12 4 7.5z"), front: face("M4 7.5 12 12v9l-8-4.5z"), side: face("M20 7.5 12 12v9l8-4.5z"),
    elbow: svg('<circle cx="12" cy="12" r="8"/><circle cx="12" cy="4" r="2" fill="currentColor"/>'),
    frames: svg('<path d="M7 17V5 M7 17h12 M7 17l-3.5 3.5 M5 7l2-2 2 2 M17 15l2 2-2 2"/>'),
    ellipsoid: svg('<ellipse cx="12" cy="12" rx="9" ry="5" transform="rotate(-30 12 12)"/><path d="M12 12l6-3.5"/>'),
    cloud: svg('<path d="M4 18a9 9 0 0 1 16 0" stroke-dasharray="1.5 3"/><path d="M7 18a5.5 5.5 0 0 1 10 0" stroke-dasharray="1.5 3"/>'),
    swept: svg('<path d="M5 19V9 M5 9l5-3 M9 19a14 14 0 0 1 10-9 M12 20a10 10 0 0 1 8-6"/>'),
    measure: svg('<path d="M3 15 15 3l6 6L9 21z M7 11l2 2 M10 8l3 3 M13 5l2 2"/>'),
    picture: svg('<path d="M4 8h3l1.5-2.5h7L17 8h3v11H4z"/><circle cx="12" cy="13" r="3.5"/>'),
    spacemouse: svg('<ellipse cx="12" cy="9" rx="5.5" ry="4"/><path d="M6.5 9v3.5c0 5 11 5 11 0V9 M3.5 16.5c1 5 16 5 17 0"/>'),
    film: svg('<path d="M3 7h12v10H3z M15 11l6-3v8l-6-3"/>'),
  };
  let bar = null, views = [], extras = [], tools = [];
  const can = { film: false };  // Tools that cannot be used now.
  const running = {};  // Tools that are on.
  const say = (detail) => window.dispatchEvent(new CustomEvent("rl-say", { detail }));

  const button = (icon, label, press, pressed, disabled = false) => {
    const made = document.createElement("button");
    made.type = "button";
    made.innerHTML = ICONS[icon] || "";
    made.title = label;
    made.setAttribute("aria-label", label);
    if (pressed !== undefined) made.setAttribute("aria-pressed", String(pressed));
    made.disabled = disabled;
    made.addEventListener("click", press);
    return made;
  };

  const draw = () => {
    if (!bar) {
      bar = document.createElement("div");
      bar.id = "rl-toolbar";
      bar.setAttribute("role", "toolbar");
      document.body.append(bar);
    }
    const focused = bar.contains(document.activeElement) ? [...bar.children].indexOf(document.activeElement) : -1;
    bar.replaceChildren(
      ...views.map(({ view, label }) => button(view, label, () => say({ kind: "home", view }))),
      ...extras.map(({ name, label, on }) => button(name, label, () => window.dispatchEvent(new CustomEvent("rl-act", { detail: { kind: "extra", name, on: !on } })), on)),
      ...tools.filter(({ name }) => name !== "spacemouse" || navigator.hid).map(({ name, label }) => button(name, label, () => window.dispatchEvent(new CustomEvent("rl-tool", { detail: { name } })), running[name], can[name] === false)),
    );
    if (focused >= 0 && bar.children[focused]) bar.children[focused].focus();
    place();
  };

  // Over the scene, wherever the panels have left it.
  const place = () => {
    const canvas = document.querySelector("#root canvas[data-engine]"), scene = canvas && canvas.getBoundingClientRect();
    if (!bar) return;
    bar.hidden = !scene || scene.width < 140;
    if (!bar.hidden) bar.style.right = `${window.innerWidth - scene.right + 8}px`;
  };
  window.addEventListener("rl-news", ({ detail }) => {
    if (detail.views) views = detail.views;
    if (detail.extras) extras = detail.extras;
    if (detail.tools) tools = detail.tools;
    const film = "preview" in detail ? detail.preview !== null : can.film, isNew = film !== can.film;
    can.film = film;
    if (detail.views || detail.extras || detail.tools || isNew) draw();
  });
  window.addEventListener("rl-tool-on", ({ detail }) => { running[detail.name] = detail.on; draw(); });
  setInterval(place, 300);
})();
