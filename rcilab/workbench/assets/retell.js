// viser has one throttle for all its controls: within 50 ms, what is told of one replaces what was to be told of another.
// So a text box that is left right after its last key is told once more when nothing has been typed for a moment. After
// that, whoever has left a box or pressed Enter in it need not wait until the typing has paused: what is there counts.
// What is chosen in a list ("rl-act") goes by our own connection, which is faster than viser's: it waits for the text.
// Unnecessary once viser throttles each control by itself.
(() => {
  "use strict";
  const WINDOW = 80, left = new Map();  // [ms] A little more than viser's.
  let last = -Infinity, box = null, timer = 0, saying = 0, isUnsaid = false, acts = [];

  const retell = () => {
    timer = 0;
    if (performance.now() - last < WINDOW) return wait();
    const [input, value] = left.entries().next().value;
    left.delete(input);
    if (input.isConnected) {
      Object.getOwnPropertyDescriptor(Object.getPrototypeOf(input), "value").set.call(input, value);
      if (input._valueTracker) input._valueTracker.setValue("");  // React tells only what it takes for news.
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }
    last = performance.now();
    wait();
  };
  const wait = () => { if (!timer && left.size) timer = setTimeout(retell, WINDOW); };

  const enter = () => {
    clearTimeout(saying);
    if (isUnsaid) saying = setTimeout(say, 2 * WINDOW);
  };
  const say = () => {
    if (timer) return enter();  // Something is still to be told.
    isUnsaid = false;
    [{ kind: "entered" }, ...acts.splice(0)].forEach(send);
  };
  const send = (detail) => window.dispatchEvent(new CustomEvent("rl-say", { detail }));
  window.addEventListener("rl-act", ({ detail }) => {
    if (!isUnsaid) return send(detail);
    if (!acts.length) enter();
    acts.push(detail);
  });

  document.addEventListener("keydown", (event) => { if (event.key === "Enter" && event.target === box) enter(); }, true);
  document.addEventListener("input", (event) => {
    if (!event.isTrusted) return;
    if (!acts.length) clearTimeout(saying);
    isUnsaid = true;
    last = performance.now();
    box = event.target;
    left.delete(box);
  }, true);
  document.addEventListener("focusout", (event) => {
    if (event.target !== box || box.type !== "text") return;
    enter();
    if (performance.now() - last > WINDOW) return;
    left.set(box, box.value);
    wait();
  }, true);
})();
