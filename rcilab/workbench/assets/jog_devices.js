// Jogging by keys, a gamepad and a SpaceMouse: all hold the buttons of the Jog tab, so all that holds for those holds for
// them, too. Gamepad and SpaceMouse need a dead-man button: releasing it, or losing the device, releases everything.
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

  // A SpaceMouse, read by WebHID. Its axes are x to the right, y towards the hand, z down, and turns about them: in its
  // reports in this order. It reports all the time while its cap is deflected, so silence is a lost device.
  const SPACE = ["y", "x", "z", "pitch", "roll", "yaw"];  // The axis of the tool that each moves, in the other direction.
  const FULL = 350, SILENCE = 80;  // Counts of a full deflection; [ms] from the last report to the release.
  const FILTERS = [0x256f, 0x046d].map((vendorId) => ({ vendorId, usagePage: 1, usage: 8 }));  // 3Dconnexion, and its older ones.
  let said = {};
  const listen = (device) => {
    let cap = [0, 0, 0, 0, 0, 0], isArmed = false, reported = 0, held = null, watching = 0;
    const follow = () => {
      const most = Math.max(...cap.map(Math.abs)), at = cap.findIndex((count) => Math.abs(count) === most);
      const is = isArmed && document.hasFocus() && performance.now() - reported <= SILENCE && most > FULL * (held ? OFF : ON);
      const next = is ? SPACE[at] + (cap[at] < 0 ? "+" : "-") : null;
      if (next === held) return;
      if (held) window.rcilabJog.release("spacemouse");
      held = null;
      clearInterval(watching);
      const button = next && axis(next.slice(0, -1), next.endsWith("+") ? 1 : -1);
      if (!button || !window.rcilabJog.hold(button, "spacemouse")) return;
      held = next;
      watching = setInterval(follow, LOOK);
    };
    device.addEventListener("inputreport", ({ reportId, data, timeStamp }) => {
      const counts = (from) => [...Array(Math.floor(data.byteLength / 2)).keys()].forEach((k) => { if (from + k < 6) cap[from + k] = data.getInt16(2 * k, true); });
      if (reportId === 1) counts(0);  // The turns follow here, or in a report of their own.
      else if (reportId === 2) counts(3);
      else if (reportId === 3) isArmed = [...Array(data.byteLength).keys()].some((k) => data.getUint8(k));
      if (reportId < 3) reported = timeStamp;
      follow();
    });
    return () => { isArmed = false; follow(); };
  };
  const mice = new Map();  // What to do when a device is lost.
  const shows = () => window.dispatchEvent(new CustomEvent("rl-tool-on", { detail: { name: "spacemouse", on: mice.size > 0 } }));
  const notice = (tone, text) => window.dispatchEvent(new CustomEvent("rl-notice", { detail: { tone, text } }));
  const use = async (devices, isAsked) => {
    for (const device of devices) {
      if (mice.has(device)) continue;
      try {
        if (!device.opened) await device.open();
        mice.set(device, listen(device));
        if (isAsked) notice("good", said.ready);
      } catch { if (isAsked) notice("warn", said.closed); }
    }
    shows();
  };
  const isSpace = ({ vendorId, collections }) => FILTERS.some((one) => one.vendorId === vendorId) && collections.some(({ usagePage, usage }) => usagePage === 1 && usage === 8);
  window.addEventListener("rl-tool", async ({ detail }) => {
    if (detail.name !== "spacemouse") return;
    try { await use(await navigator.hid.requestDevice({ filters: FILTERS }), true); } catch { notice("warn", said.closed); }
  });
  if (navigator.hid) {
    navigator.hid.getDevices().then((devices) => use(devices.filter(isSpace), false));  // Those that the operator has allowed before.
    navigator.hid.addEventListener("connect", ({ device }) => { if (isSpace(device)) use([device], false); });
    navigator.hid.addEventListener("disconnect", ({ device }) => { mice.get(device)?.(); mice.delete(device); shows(); });
  }
  window.addEventListener("rl-news", ({ detail }) => { if (detail.spacemouse) said = detail.spacemouse; });

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
