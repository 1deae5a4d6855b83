// A picture of the scene as it is seen, and a film of the preview played once; the browser saves both.
(() => {
  "use strict";
  const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];  // In order of preference.
  const RATE = 30, BITS = 8e6;  // [Hz], [bit/s]
  const PATIENCE = 3000, LAST = 300;  // [ms] For the preview to start, and for its last frame to be drawn.
  const scene = window.rcilabScene;
  const send = (detail) => window.dispatchEvent(new CustomEvent("rl-say", { detail }));

  const save = (blob, kind) => {
    const now = new Date(), two = (value) => String(value).padStart(2, "0");
    const day = [now.getFullYear(), now.getMonth() + 1, now.getDate()].map(two).join("-");
    const time = [now.getHours(), now.getMinutes(), now.getSeconds()].map(two).join("");
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `rcilab-${day}-${time}.${kind}` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  };

  // Draws what lies over the scene: boxes, lines, circles and lines of text.
  const paint = (context, node) => {
    if (node.nodeType === Node.TEXT_NODE) {
      const range = document.createRange();
      range.selectNodeContents(node);
      const area = range.getClientRects()[0], style = getComputedStyle(node.parentElement);
      if (!area) return;
      const font = [style.fontStyle, style.fontWeight, style.fontSize, style.fontFamily].join(" ");  // "" as a whole, with tabular digits.
      Object.assign(context, { font, fillStyle: style.color, textBaseline: "middle" });
      context.fillText(node.data, area.left, area.top + area.height / 2);
      return;
    }
    const style = getComputedStyle(node), area = node.getBoundingClientRect(), of = (name) => Number(node.getAttribute(name));
    if (style.display === "none" || node.matches("button, input")) return;
    context.beginPath();
    if (node.tagName === "line") { context.moveTo(of("x1"), of("y1")); context.lineTo(of("x2"), of("y2")); }
    else if (node.tagName === "circle") context.arc(of("cx"), of("cy"), of("r"), 0, 2 * Math.PI);
    else context.roundRect(area.left, area.top, area.width, area.height, parseFloat(style.borderRadius) || 0);
    const isShape = ["line", "circle"].includes(node.tagName);
    Object.assign(context, { fillStyle: isShape ? style.fill : style.backgroundColor, strokeStyle: style.stroke, lineWidth: parseFloat(style.strokeWidth) || 1 });
    if (node.tagName !== "line") context.fill();
    if (isShape) context.stroke();
    node.childNodes.forEach((child) => paint(context, child));
  };
  const picture = () => {
    const canvas = scene.canvas(), place = scene.box(), made = document.createElement("canvas"), context = made.getContext("2d");
    [made.width, made.height] = [canvas.width, canvas.height];
    context.drawImage(canvas, 0, 0);
    context.scale(canvas.width / place.width, canvas.height / place.height);
    context.translate(-place.left, -place.top);
    document.querySelectorAll(".rl-overlay:not([hidden])").forEach((over) => paint(context, over));
    made.toBlob((blob) => save(blob, "png"));
  };

  let words = {}, preview = null, film = null;
  const filmBox = () => {
    const box = document.createElement("div");
    box.id = "rl-film";
    box.append(document.createElement("span"), document.createElement("progress"), document.createElement("button"));
    box.lastChild.type = "button";
    box.lastChild.textContent = words.cancel;
    box.lastChild.addEventListener("click", () => { send({ kind: "play", playing: false }); end(false); });
    document.body.append(box);
    return box;
  };
  const show = () => {
    const place = scene.box(), [text, bar] = film.box.children;
    text.textContent = words.recording;
    bar.value = film.share;
    if (place) film.box.style.left = `${place.left + place.width / 2}px`;
  };
  const start = () => {
    const type = window.MediaRecorder && TYPES.find((one) => MediaRecorder.isTypeSupported(one));
    if (!type) { window.dispatchEvent(new CustomEvent("rl-notice", { detail: { tone: "warn", text: words.none } })); return; }
    film = { type, share: 0, recorder: null, box: filmBox(), timer: setTimeout(() => end(false), PATIENCE) };
    show();
    window.dispatchEvent(new CustomEvent("rl-tool-on", { detail: { name: "film", on: true } }));
    send({ kind: "play", playing: true });
  };
  const record = () => {
    clearTimeout(film.timer);
    const chunks = [], stream = scene.canvas().captureStream(RATE), mine = film;
    const recorder = film.recorder = new MediaRecorder(stream, { mimeType: film.type, videoBitsPerSecond: BITS });
    recorder.addEventListener("dataavailable", ({ data }) => chunks.push(data));
    recorder.addEventListener("stop", () => {
      stream.getTracks().forEach((track) => track.stop());
      if (mine.isWhole) save(new Blob(chunks, { type: mine.type }), mine.type.includes("mp4") ? "mp4" : "webm");
    });
    recorder.start();
  };
  const end = (isWhole) => {
    if (!film) return;
    const { recorder, box, timer } = film;
    film.isWhole = isWhole;
    film = null;
    clearTimeout(timer);
    box.remove();
    window.dispatchEvent(new CustomEvent("rl-tool-on", { detail: { name: "film", on: false } }));
    if (!recorder) return;
    scene.draw();
    setTimeout(() => recorder.stop(), isWhole ? LAST : 0);
  };

  // The film follows the preview, which may loop: it ends where the preview does, and with a preview that is interrupted.
  const follow = () => {
    if (!film) return;
    if (preview && preview.playing && !film.recorder) record();
    if (!film.recorder) return;
    if (!preview || preview.share < film.share) end(Boolean(preview) && preview.playing);
    else if (!preview.playing) end(preview.share >= 1);
    else { film.share = preview.share; show(); }
  };
  window.addEventListener("rl-news", ({ detail }) => {
    if (detail.film) words = detail.film;
    if ("preview" in detail) { preview = detail.preview; follow(); }
  });
  window.addEventListener("rl-tool", ({ detail }) => {
    if (detail.name === "picture") picture();
    if (detail.name === "film" && film) { send({ kind: "play", playing: false }); end(false); }
    else if (detail.name === "film") start();
  });
})();
