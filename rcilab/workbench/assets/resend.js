// viser throttles all its controls together: within 50 ms, a change of one control replaces a pending change of another.
// So the value of a text box that loses the focus right after its last key is sent again, a moment after the last key.
// Then "entered" follows: values that were typed are taken at once, without waiting for a pause in the typing.
// A choice from a list ("rl-act") uses our own connection, which is faster than viser's, so it waits for those values.
// Unnecessary once viser throttles each control separately.
(() => {
  "use strict";
  const WINDOW = 80, pending = new Map();  // [ms] A little more than viser's.
  let lastSent = -Infinity, box = null, resendTimer = 0, enterTimer = 0, hasTyped = false, choices = [];

  const resend = () => {
    resendTimer = 0;
    if (performance.now() - lastSent < WINDOW) return schedule();
    const [input, value] = pending.entries().next().value;
    pending.delete(input);
    if (input.isConnected) {
      Object.getOwnPropertyDescriptor(Object.getPrototypeOf(input), "value").set.call(input, value);
      if (input._valueTracker) input._valueTracker.setValue("");  // React reports only a value that differs from this.
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }
    lastSent = performance.now();
    schedule();
  };
  const schedule = () => { if (!resendTimer && pending.size) resendTimer = setTimeout(resend, WINDOW); };

  const enter = () => {
    clearTimeout(enterTimer);
    if (hasTyped) enterTimer = setTimeout(sendEntered, 2 * WINDOW);
  };
  const sendEntered = () => {
    if (resendTimer) return enter();  // A value is still to be sent.
    hasTyped = false;
    [{ kind: "entered" }, ...choices.splice(0)].forEach(send);
  };
  const send = (detail) => window.dispatchEvent(new CustomEvent("rl-say", { detail }));
  window.addEventListener("rl-act", ({ detail }) => {
    if (!hasTyped) return send(detail);
    if (!choices.length) enter();
    choices.push(detail);
  });

  document.addEventListener("keydown", (event) => { if (event.key === "Enter" && event.target === box) enter(); }, true);
  document.addEventListener("input", (event) => {
    if (!event.isTrusted) return;
    if (!choices.length) clearTimeout(enterTimer);
    hasTyped = true;
    lastSent = performance.now();
    box = event.target;
    pending.delete(box);
  }, true);
  document.addEventListener("focusout", (event) => {
    if (event.target !== box || box.type !== "text") return;
    enter();
    if (performance.now() - lastSent > WINDOW) return;
    pending.set(box, box.value);
    schedule();
  }, true);
})();
