// Jogging by keys and by a gamepad: both hold the buttons of the Jog tab, so all that holds for those holds for them, too.
// A gamepad needs its dead-man button: releasing it, or losing the gamepad, releases everything within a look.
(() => {
  "use strict";
  const LOOK = 20;  // [ms] Between two looks at a gamepad.
  const ON = 0.5, OFF = 0.35;  // Deflections of a stick, 0 to 1, from which on a direction is held, and no longer.
  const DEAD_MAN = [4, 5];  // Left and right shoulder button (standard mapping of the Gamepad API).
  // Stick or button of the standard mapping, and the axis of the tool that it moves; a stick pushed away or to the left is +.
  const STICKS = [[1, "x"], [0, "y"], [3, "z"], [2, "yaw"]];
  const PADS = [[12, "pitch", 1], [13, "pitch", -1], [14, "roll", -1], [15, "roll", 1]];
  const TOOL = ["x", "roll", "y", "pitch", "z", "yaw"];  // The order of the buttons, - before +.

  const buttons = (mark) => [...document.querySelectorAll(`#root div:has(> div > .rl-${mark}.rl-held) button`)];
  const joint = (number, sign) => buttons("joints")[2 * number + (sign > 0 ? 1 : 0)];
  const axis = (name, sign) => buttons("axes")[2 * TOOL.indexOf(name) + (sign > 0 ? 1 : 0)];
  const isTyping = (target) => target instanceof Element && target.matches("input:not([type=checkbox]), textarea, select, [contenteditable]");

  // 1 to 9 jog a joint, with Shift in the other direction, while the Jog tab is open.
  window.addEventListener("keydown", (event) => {
    const digit = /^Digit([1-9])$/.exec(event.code);
    if (!digit || event.repeat || event.ctrlKey || event.altKey || event.metaKey || isTyping(event.target)) return;
    const button = joint(Number(digit[1]) - 1, event.shiftKey ? -1 : 1);
    if (button && window.rcilabJog.hold(button, event.code)) event.preventDefault();
  });
  window.addEventListener("keyup", (event) => { if (/^Digit[1-9]$/.test(event.code)) window.rcilabJog.release(event.code); });

  let holding = null, timer = 0;
  const wanted = (pad) => {
    if (!DEAD_MAN.some((number) => pad.buttons[number] && pad.buttons[number].pressed)) return null;
    const bound = holding ? OFF : ON;
    const found = STICKS.map(([number, name]) => [Math.abs(pad.axes[number] || 0), name, pad.axes[number] < 0 ? 1 : -1]);
    for (const [number, name, sign] of PADS) found.push([pad.buttons[number] && pad.buttons[number].pressed ? 1 : 0, name, sign]);
    const [most, name, sign] = found.sort((a, b) => b[0] - a[0])[0];
    return most > bound ? name + (sign > 0 ? "+" : "-") : null;
  };
  const look = () => {
    const pads = [...navigator.getGamepads()].filter((pad) => pad && pad.connected && pad.mapping === "standard");
    if (!pads.length) { clearInterval(timer); timer = 0; }
    const next = document.hasFocus() ? pads.map(wanted).find((name) => name) || null : null;
    if (next === holding) return;
    if (holding) window.rcilabJog.release("gamepad");
    holding = null;
    const button = next && axis(next.slice(0, -1), next.endsWith("+") ? 1 : -1);
    if (button && window.rcilabJog.hold(button, "gamepad")) holding = next;
  };
  window.addEventListener("gamepadconnected", () => { if (!timer) timer = setInterval(look, LOOK); });
  window.addEventListener("gamepaddisconnected", look);

  // "?" lists the keys.
  let help = null, keys = [];
  window.addEventListener("rl-news", ({ detail }) => { if (detail.keys) keys = detail.keys; });
  const showKeys = () => {
    if (help) { help.remove(); help = null; return; }
    help = document.createElement("dialog");
    help.id = "rl-help";
    const table = document.createElement("table");
    for (const [key, meaning] of keys) {
      const row = table.insertRow();
      row.insertCell().append(Object.assign(document.createElement("kbd"), { textContent: key }));
      row.insertCell().textContent = meaning;
    }
    help.append(table);
    help.addEventListener("click", showKeys);
    document.body.append(help);
    help.show();
  };
  window.addEventListener("keydown", (event) => {
    if (event.key === "?" && !isTyping(event.target)) showKeys();
    else if (event.key === "Escape" && help) showKeys();
  });
})();
