// Builds the page: unpacks the arrays, creates scene, plots and tables, and drives them by one clock.
(async () => {
  "use strict";
  const $ = (id) => document.getElementById(id);
  const { words, run, charts: kinds, arm, path, facts } = JSON.parse($("content").textContent);
  const packed = Uint8Array.from(atob($("arrays").textContent), (c) => c.charCodeAt(0));
  const bytes = await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  const types = { "<f4": Float32Array, "<u4": Uint32Array, "u1": Uint8Array };
  const array = (ref) => new types[ref.kind](bytes, ref.at, ref.count);
  const rows = run.arrays.t.count, pieces = (ref, n) => {
    const all = array(ref);
    return Array.from({ length: n }, (_, j) => all.subarray(j * rows, (j + 1) * rows));
  };

  const t = array(run.arrays.t), signals = {};
  for (const name of ["q", "dq", "tau", "error", "q_plan", "dq_plan", "dq_lowest", "dq_highest"]) if (run.arrays[name]) signals[name] = pieces(run.arrays[name], run.n);
  const limits = run.limits || {}, tool = array(run.arrays.tool);
  signals.tool = [tool];
  const charts = kinds.filter(({ name }) => name !== "tool" || tool.some((x) => x === x)).map((kind) => ({
    ...kind, actual: signals[kind.name], plan: signals[`${kind.name}_plan`], limits: signals[`${kind.name}_lowest`] ? [signals[`${kind.name}_lowest`], signals[`${kind.name}_highest`]] : limits[kind.name],
    error: kind.name === "error" || kind.name === "tool", positive: kind.name === "tool",
  }));
  const perRadian = kinds.find(({ name }) => name === "q").factor;

  let now = 0, playing = false, last = 0;
  const end = rows ? t[rows - 1] : 0, radians = (set, i) => set.map((column) => column[i] / perRadian);
  const plots = new Plots($("plots"), charts, t, array(run.arrays.fault), (time) => { playing = false; go(time); });
  let scene = null;
  if (arm) {
    try { scene = new Scene($("scene"), arm, path, array); } catch { $("missing").hidden = false; $("missing").textContent = words["scene.missing"]; }
  }
  $("scene").hidden = !scene;

  const go = (time) => {
    now = Math.min(Math.max(time, 0), end);
    const i = Math.max(0, Math.min(plots.first(now), rows - 1));
    if (scene && rows) scene.show(radians(signals.q, i), signals.q_plan ? radians(signals.q_plan, i) : null);
    plots.show(now);
    $("clock").innerHTML = `<b>${now.toFixed(3)}</b> / ${end.toFixed(3)} s`;
    $("scrub").value = end ? Math.round(now / end * 10000) : 0;
    $("scrub").setAttribute("aria-valuetext", `${now.toFixed(3)} s`);
    $("play").textContent = words[playing ? "pause" : "play"];
  };
  const tick = (stamp) => {
    if (!playing) return;
    const next = now + (stamp - last) / 1000 * Number($("rate").value);
    last = stamp;
    playing = next < end;
    go(next);
    requestAnimationFrame(tick);
  };
  const play = () => {
    playing = !playing;
    if (playing && now >= end) now = 0;
    last = performance.now();
    go(now);
    requestAnimationFrame(tick);
  };

  $("play").addEventListener("click", play);
  $("scrub").setAttribute("aria-label", words.time);
  $("scrub").addEventListener("input", () => { playing = false; go($("scrub").value / 10000 * end); });
  $("rate-word").textContent = words.rate; $("joint-word").textContent = words.joint;
  for (const option of $("rate").options) { option.value = option.textContent; option.textContent += "×"; }
  const names = [words["joint.all"], ...Array.from({ length: run.n }, (_, j) => `J${j + 1}`)];
  names.forEach((name, j) => $("joint").append(new Option(name, j)));
  $("joint").addEventListener("change", () => { plots.choose(Number($("joint").value)); });
  $("scene").setAttribute("aria-label", words.scene); $("scene").title = words.scene;
  $("plots").setAttribute("aria-label", words.plots); $("plots").setAttribute("role", "img");
  const step = (event) => {
    const dt = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (dt) { event.preventDefault(); playing = false; go(now + dt * (event.shiftKey ? 0.1 : 0.001)); }
  };
  $("plots").addEventListener("keydown", step);
  window.addEventListener("keydown", (event) => {
    if (event.key === " " && !/^(BUTTON|SELECT|INPUT)$/.test(document.activeElement.tagName)) { event.preventDefault(); play(); }
  });

  const element = (tag, text, parent) => { const e = document.createElement(tag); if (text !== undefined) e.textContent = text; parent.append(e); return e; };
  const table = (title, head, body, look) => {
    const box = element("table", undefined, $("tables")); box.className = look;
    element("caption", title, box);
    if (head) { const line = element("tr", undefined, element("thead", undefined, box)); head.forEach((text) => element("th", text, line)); }
    const lines = element("tbody", undefined, box);
    body.forEach((cells, i) => {
      const line = element("tr", undefined, lines);
      cells.forEach((text, k) => { const cell = element(k ? "td" : "th", text, line); if (!k && i < run.n) cell.style.setProperty("--c", COLORS[i % COLORS.length]); });
    });
  };
  table(words["table.title"], [words["table.where"], facts.head.rms, facts.head.max], facts.errors, "numbers");
  if (facts.notes.length) { const cell = element("td", facts.notes.join(" "), element("tr", undefined, element("tfoot", undefined, $("tables").lastChild))); cell.colSpan = 3; }
  table(words["facts.title"], null, facts.rows, "facts");
  $("ended").textContent = facts.rows.map(([, value]) => value).slice(0, 2).join(" · ") + " — " + words.foot;
  if (scene && path) $("key").innerHTML = `${words.path}: 0<i></i>${path.worst_text}` + (signals.q_plan ? `<br>${words.ghost}` : "");
  const sign = (text, color, look = "") => { const s = element("span", "", $("legend")); const i = element("i", undefined, s); i.className = look; if (look !== "area") i.style.borderColor = color; s.append(text); };
  COLORS.slice(0, run.n).forEach((color, j) => sign(`J${j + 1}`, color));
  if (signals.q_plan) sign(words["legend.plan"], "#111827", "dash");
  sign(words["legend.limit"], "#d1392b", "dash"); sign(words["legend.fault"], "", "area");
  document.body.dataset.ready = "yes";
  go(0);
})();
