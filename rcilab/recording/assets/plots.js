// Plots that share one time axis. Every pixel column shows its smallest and largest value, so that no spike is lost.
"use strict";

const COLORS = ["#0b6fc2", "#e07b00", "#1a9850", "#c2357a", "#7b52c7", "#8a6d3b", "#008b9a"];
const LEFT = 58, RIGHT = 14, TITLE = 20, AXIS = 22, BETWEEN = 22;  // [px] BETWEEN: smallest distance of two ticks.

class Plots {
  constructor(box, rows, t, faults, onSeek) {
    Object.assign(this, { box, rows, t, faults, onSeek, joint: 0, cursor: 0 });
    this.end = t.length ? Math.max(t[t.length - 1], 1e-3) : 1;
    this.range = [0, this.end];
    this.canvas = document.createElement("canvas"); this.over = document.createElement("canvas");
    box.append(this.canvas, this.over);
    const seek = (event) => onSeek(this.range[0] + (event.offsetX - LEFT) / (this.over.clientWidth - LEFT - RIGHT) * (this.range[1] - this.range[0]));
    let held = false;
    this.over.addEventListener("pointerdown", (event) => { held = true; this.over.setPointerCapture(event.pointerId); seek(event); });
    this.over.addEventListener("pointermove", (event) => { if (held) seek(event); });
    this.over.addEventListener("pointerup", () => { held = false; });
    this.over.addEventListener("dblclick", () => this.zoom(0, this.end));
    this.over.addEventListener("wheel", (event) => {
      event.preventDefault();
      const [a, b] = this.range, share = Math.min(1, Math.max(0, (event.offsetX - LEFT) / (this.over.clientWidth - LEFT - RIGHT)));
      const pivot = a + share * (b - a), scale = Math.exp(event.deltaY * 0.0015);
      this.zoom(pivot - (pivot - a) * scale, pivot + (b - pivot) * scale);
    }, { passive: false });
    new ResizeObserver(() => this.draw()).observe(box);
  }

  zoom(a, b) {
    const width = Math.min(this.end, Math.max(b - a, 0.02)), start = Math.min(Math.max(a, 0), this.end - width);
    this.range = [start, start + width];
    this.draw();
  }

  choose(joint) { this.joint = joint; this.draw(); }

  first(time) {  // The first sample at or after a time.
    let low = 0, high = this.t.length;
    while (low < high) { const middle = (low + high) >> 1; if (this.t[middle] < time) low = middle + 1; else high = middle; }
    return low;
  }

  curves(row) { return this.joint && row.actual.length > 1 ? [this.joint - 1] : row.actual.map((_, i) => i); }

  draw() {
    const { canvas, over } = this, ratio = window.devicePixelRatio || 1, width = this.box.clientWidth, height = this.box.clientHeight;
    if (!width || !height) return;
    for (const c of [canvas, over]) { c.width = Math.round(width * ratio); c.height = Math.round(height * ratio); }
    const g = canvas.getContext("2d");
    g.scale(ratio, ratio);
    g.font = "11px system-ui, sans-serif"; g.textBaseline = "middle";
    this.columns = Math.max(1, Math.floor(width - LEFT - RIGHT));
    const edges = new Int32Array(this.columns + 1);
    for (let c = 0; c <= this.columns; c++) edges[c] = this.first(this.range[0] + (this.range[1] - this.range[0]) * c / this.columns);
    edges[this.columns] = Math.min(this.t.length, this.first(this.range[1]) + 1);
    const each = (height - AXIS) / this.rows.length;
    this.rows.forEach((row, i) => this.drawRow(g, row, i * each + TITLE, each - TITLE - 5, edges));
    this.drawTimes(g, height - AXIS);
    this.show(this.cursor);
  }

  drawRow(g, row, top, height, edges) {
    const chosen = this.curves(row), [a, b] = [edges[0], edges[this.columns]];
    const sides = this.joint && row.limits ? row.limits.map((side) => side[this.joint - 1]) : null;  // Numbers, or curves.
    const isCurve = Boolean(sides) && typeof sides[0] !== "number";
    const most = (side, pick, from) => side.subarray(a, b).reduce((x, v) => pick(x, v), from);
    const limit = isCurve ? [most(sides[0], Math.min, Infinity), most(sides[1], Math.max, -Infinity)] : sides;
    let low = Infinity, high = -Infinity;
    for (const set of [row.actual, row.plan || []]) for (const j of chosen) if (set[j]) for (let i = a; i < b; i++) {
      const v = set[j][i];
      if (v < low) low = v; if (v > high) high = v;
    }
    if (limit && high - low > 0.25 * (limit[1] - limit[0])) { low = Math.min(low, limit[0]); high = Math.max(high, limit[1]); }
    const { ticks, step } = scale(low, high, row, height);
    low = ticks[0]; high = ticks[ticks.length - 1];
    const y = (v) => top + height * (high - v) / (high - low);
    g.save();
    g.beginPath(); g.rect(LEFT, top - 1, this.columns, height + 2); g.clip();  // Margin for the width of a curve at the edge.
    g.fillStyle = "#fbfcfe"; g.fillRect(LEFT, top, this.columns, height);
    g.lineWidth = 1; g.strokeStyle = "#e6ebf2";
    for (const v of ticks) line(g, LEFT, y(v), LEFT + this.columns, y(v));
    if (limit) {
      g.fillStyle = "rgba(209,57,43,.08)"; g.strokeStyle = "#d1392b";
      for (let c = 0; c < (isCurve ? this.columns : 1); c++) {
        const [low, high] = isCurve ? sides.map((side) => side[edges[c]]) : sides, wide = isCurve ? 1 : this.columns;
        g.fillRect(LEFT + c, top, wide, y(high) - top); g.fillRect(LEFT + c, y(low), wide, top + height - y(low));
      }
      g.setLineDash([5, 4]);
      for (const side of sides) if (isCurve) this.curve(g, side, edges, y, "#d1392b", 1); else line(g, LEFT, y(side), LEFT + this.columns, y(side));
      g.setLineDash([]);
    }
    g.fillStyle = "rgba(214,48,38,.30)";
    for (let c = 0; c < this.columns; c++) for (let i = edges[c]; i < edges[c + 1]; i++) if (this.faults[i]) { g.fillRect(LEFT + c - 1, top, 3, height); break; }
    for (const j of chosen) {
      if (row.plan) { g.setLineDash([4, 3]); g.globalAlpha = 0.55; this.curve(g, row.plan[j], edges, y, row.actual.length > 1 ? "#111827" : "#51607a", 1); g.setLineDash([]); g.globalAlpha = 1; }
      this.curve(g, row.actual[j], edges, y, row.actual.length > 1 ? COLORS[j % COLORS.length] : "#0f1c2e", 1.6);
    }
    g.restore();
    g.strokeStyle = "#d4dce6"; g.strokeRect(LEFT + 0.5, Math.round(top) + 0.5, this.columns, Math.round(height));
    g.fillStyle = "#6b7a90"; g.textAlign = "right";
    for (const v of ticks) g.fillText(label(v, step), LEFT - 6, y(v));
    g.fillStyle = "#33425a"; g.textAlign = "left"; g.font = "600 11.5px system-ui, sans-serif";
    g.fillText(`${row.title} [${row.unit}]`, LEFT, top - 9);
    g.font = "11px system-ui, sans-serif";
  }

  curve(g, values, edges, y, color, width) {
    g.beginPath(); g.strokeStyle = color; g.lineWidth = width; g.lineJoin = "round";
    let open = false;
    for (let c = 0; c < this.columns; c++) {
      let low = Infinity, high = -Infinity, from = -1, to = -1;
      for (let i = edges[c]; i < edges[c + 1]; i++) {
        const v = values[i];
        if (v < low) { low = v; from = i; }
        if (v > high) { high = v; to = i; }
      }
      if (from < 0) continue;
      const pair = from <= to ? [low, high] : [high, low], x = LEFT + c + 0.5;
      for (const v of pair) { if (open) g.lineTo(x, y(v)); else { g.moveTo(x, y(v)); open = true; } }
    }
    g.stroke();
  }

  drawTimes(g, top) {
    const [a, b] = this.range, step = nice((b - a) / 8);
    g.fillStyle = "#6b7a90"; g.textAlign = "center";
    const most = this.columns + LEFT + RIGHT;
    for (let v = Math.ceil(a / step) * step; v <= b + 1e-9; v += step) {
      const text = `${label(v, step)} s`, half = g.measureText(text).width / 2 + 2;
      g.fillText(text, Math.min(LEFT + (v - a) / (b - a) * this.columns, most - half), top + 11);
    }
  }

  show(time) {  // Draws the cursor and the values at it on the upper canvas; the curves are not drawn again.
    this.cursor = time;
    const g = this.over.getContext("2d"), ratio = window.devicePixelRatio || 1, width = this.box.clientWidth, height = this.box.clientHeight;
    g.setTransform(ratio, 0, 0, ratio, 0, 0); g.clearRect(0, 0, width, height);
    const [a, b] = this.range, x = LEFT + (time - a) / (b - a) * this.columns;
    if (x < LEFT - 1 || x > LEFT + this.columns + 1) return;
    g.strokeStyle = "#0f1c2e"; g.lineWidth = 1.5; line(g, x, TITLE - 4, x, height - AXIS);
    const i = Math.min(this.first(time), this.t.length - 1), each = (height - AXIS) / this.rows.length;
    g.font = "600 11px system-ui, sans-serif"; g.textAlign = "right"; g.textBaseline = "middle";
    this.rows.forEach((row, k) => {
      const chosen = this.curves(row);
      if (chosen.length !== 1 || i < 0) return;
      const v = row.actual[chosen[0]][i];
      if (v === v) g.fillStyle = "#0f1c2e", g.fillText(`${fixed(v, row.digits)}${/^\d/.test(row.unit) ? "·" : " "}${row.unit}`, LEFT + this.columns, k * each + TITLE - 9);
    });
  }
}

function line(g, x0, y0, x1, y1) { g.beginPath(); g.moveTo(x0, y0); g.lineTo(x1, y1); g.stroke(); }
function nice(step) { const p = 10 ** Math.floor(Math.log10(step)), m = step / p; return p * (m <= 1 ? 1 : m <= 2 ? 2 : m <= 5 ? 5 : 10); }
function fixed(v, digits) { const text = v.toFixed(digits); return Number(text) === 0 ? text.replace("-", "") : text; }
function label(v, step) { return fixed(v, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))); }
function scale(low, high, row, height) {  // Ticks of a plot: as many as fit, with one at each end, around all curves.
  if (!(low <= high)) low = high = 0;
  if (row.error) { high = Math.max(Math.abs(low), Math.abs(high), row.least); low = row.positive ? 0 : -high; }
  else if (high - low < 2 * row.least) { const middle = (low + high) / 2; low = middle - row.least; high = middle + row.least; }
  const most = Math.max(2, Math.floor(height / BETWEEN));  // An axis around zero always has two intervals.
  let step = nice((high - low) / most);
  while (count(low, high, step) > most) step = nice(step * 1.01);
  const first = Math.floor(low / step + 1e-6);
  return { step, ticks: Array.from({ length: count(low, high, step) + 1 }, (_, i) => (first + i) * step) };
}
function count(low, high, step) { return Math.max(1, Math.ceil(high / step - 1e-6) - Math.floor(low / step + 1e-6)); }
