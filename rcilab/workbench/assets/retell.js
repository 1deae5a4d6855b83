// viser has one throttle for all its controls: within 50 ms, what is told of one replaces what was to be told of another.
// So a text box that is left right after its last key is told once more when nothing has been typed for a moment.
(() => {
  "use strict";
  const WINDOW = 80, left = new Map();  // [ms] A little more than viser's.
  let last = -Infinity, box = null, timer = 0;

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

  document.addEventListener("input", (event) => {
    if (!event.isTrusted) return;
    last = performance.now();
    box = event.target;
    left.delete(box);
  }, true);
  document.addEventListener("focusout", (event) => {
    if (event.target !== box || box.type !== "text" || performance.now() - last > WINDOW) return;
    left.set(box, box.value);
    wait();
  }, true);
})();
