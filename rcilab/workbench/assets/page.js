// The bar of the workbench. It speaks to Python over its own websocket, so that Stop works whatever viser shows.
(() => {
  "use strict";
  // Plots are drawn by the processor: without a graphics card the browser would have it imitate one for every curve.
  // A light scene has no smoothed edges: to imitate them takes as long as all the rest of a frame.
  const LOOKS = { "2d": (options) => ({ willReadFrequently: true, ...options }) };
  if (document.documentElement.dataset.rlQuality === "light") LOOKS.webgl2 = (options) => ({ ...options, antialias: false });
  const getContext = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return getContext.call(this, kind, LOOKS[kind] ? LOOKS[kind](options) : options);
  };

  // What a window has when it is loaded anew: the open tab, and which notice it has seen last.
  const recall = (name) => { try { return JSON.parse(sessionStorage.getItem("rcilab." + name)); } catch { return null; } };
  const keep = (name, value) => { try { sessionStorage.setItem("rcilab." + name, JSON.stringify(value)); } catch { /* Then not. */ } };

  const NARROWEST = 240;  // [px] of the scene that a notice is shown over; else it is shown at the window's lower edge.
  const PAUSE = 50;  // [ms] A choice: between two looks at tabs and plots, whatever changes meanwhile.
  const TOGETHER = 1000;  // [ms] A choice: notices that come closer than this are shown together, at most three.
  const WARNED = 3500;  // [ms] A warning stays beside later notices for so long: time to read it once.
  const TONES = ["good", "warn", "bad"];  // In order of severity.
  const SHOWN = 7000;  // [ms] A choice: long enough to read a notice twice.
  let live = null, said = {}, bar, chips, stop, home, take, question, toast, me = null, notice = recall("notice"), greeted = false, hideTimer = 0, lines = [];

  const send = (message) => {
    if (live && live.readyState === WebSocket.OPEN) { live.send(JSON.stringify(message)); return true; }
    return false;
  };

  const pressStop = () => {
    stop.classList.add("rl-pressed");
    if (!send({ kind: "stop" })) show({ tone: "bad", text: said.lost || "Not connected: Stop was not sent." });
  };

  const goHome = () => send({ kind: "home" });

  const show = (message) => {
    const now = Date.now(), stays = (line) => now - line.at <= (TONES.indexOf(line.tone) > 0 ? WARNED : TOGETHER);
    const kept = toast.className ? lines.filter((line) => line.text !== message.text && stays(line)) : [];
    lines = [...kept, { text: message.text, tone: message.tone, at: now, serial: message.serial }].slice(-3);
    drawToast();
    toast.dataset.serial = message.serial || "";
    clearTimeout(hideTimer);
    hideTimer = setTimeout(hide, SHOWN);
  };
  const drawToast = () => {
    toast.replaceChildren(...lines.map((line) => {
      const said = document.createElement("p");
      said.className = "rl-" + line.tone;
      said.textContent = line.text;
      return said;
    }));
    toast.className = "rl-shown rl-" + TONES[Math.max(...lines.map((line) => TONES.indexOf(line.tone)))];
    place();
  };
  const hide = () => { toast.className = ""; };

  // Over the scene, wherever the panels have left it: that covers no tab, no button and no field.
  const place = () => {
    if (!toast) return;  // A phone sizes a page before it is built.
    const canvas = document.querySelector("#root canvas[data-engine]"), scene = canvas && canvas.getBoundingClientRect();
    const fits = Boolean(scene) && scene.width >= NARROWEST;
    toast.classList.toggle("rl-below", !fits);
    toast.style.left = fits ? `${scene.left + scene.width / 2}px` : "";
    toast.style.maxWidth = fits ? `${Math.min(scene.width - 24, 640)}px` : "";
  };

  const build = () => {
    if (recall("quality") === document.documentElement.dataset.rlQuality) keep("quality", null);  // It worked.
    bar = document.createElement("div");
    bar.id = "rl-bar";
    bar.innerHTML = '<div id="rl-brand"><svg viewBox="0 0 24 24" fill="none" stroke="#5ab0ff" stroke-width="2.6" ' +
      'stroke-linecap="round" stroke-linejoin="round"><path d="M6 21V14L10 6L18 9"/><circle cx="6" cy="14" r="1.6" ' +
      'fill="#fff" stroke="#fff"/><circle cx="10" cy="6" r="1.6" fill="#fff" stroke="#fff"/><path d="M2.5 21.5H10"/></svg>' +
      '<span>rcilab</span></div><div id="rl-chips" role="status" aria-live="off"></div>';
    stop = document.createElement("button");
    stop.id = "rl-stop";
    stop.type = "button";
    stop.addEventListener("pointerdown", pressStop);  // Not only on release: a stop should not wait for the finger.
    stop.addEventListener("click", pressStop);
    take = document.createElement("button");
    take.id = "rl-take";
    take.type = "button";
    take.hidden = true;
    take.addEventListener("click", () => send({ kind: "take" }));
    home = document.createElement("button");
    home.id = "rl-home";
    home.type = "button";
    home.innerHTML = '<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" ' +
      'stroke-linejoin="round" aria-hidden="true"><path d="M4 11.5 12 4l8 7.5M6 10v9.5h4.5V14h3v5.5H18V10"/></svg>';
    home.addEventListener("click", goHome);
    bar.append(home, take, stop);
    question = document.createElement("div");
    question.id = "rl-question";
    question.hidden = true;
    question.setAttribute("role", "alertdialog");
    question.append(...["p", "button", "button"].map((kind) => document.createElement(kind)));
    question.children[1].addEventListener("click", () => send({ kind: said.question.kind, yes: true }));
    question.children[2].addEventListener("click", () => send({ kind: said.question.kind, yes: false }));
    chips = bar.querySelector("#rl-chips");
    toast = document.createElement("div");
    toast.id = "rl-toast";
    toast.setAttribute("role", "alert");
    document.body.append(bar, question, toast);
    label();
    connect();
    // Asked for only when something has changed: a page that looked by itself kept its browser drawing frames all day.
    new MutationObserver(followSoon).observe(document.getElementById("root"), { childList: true, subtree: true, attributes: true, attributeFilter: ["aria-selected"] });
    followSoon();
  };

  const label = () => {
    stop.textContent = said.stop || "Stop";
    const key = document.createElement("kbd");
    key.textContent = "Esc";
    key.setAttribute("aria-hidden", "true");
    stop.appendChild(key);
    stop.title = said.stopHint || "";
    stop.setAttribute("aria-label", said.stop || "Stop");
    home.title = said.homeHint || "";
    home.setAttribute("aria-label", said.home || "Home view");
  };

  // Which of the server's clients this page is; the key proves it. Python calls this as soon as viser is connected.
  window.rcilabPage = (page, key) => {
    me = { page, key };
    greet();
    window.dispatchEvent(new CustomEvent("rl-me", { detail: me }));
  };
  let software = null;  // Whether the browser draws without a graphics card.
  const greet = () => {
    if (!me) return;
    send({ kind: "hello", ...me });
    if (software === null) software = drawsInSoftware();
    if (software) send({ kind: "software" });
    hold();
  };

  // Who holds the controls: the others can ask for them, and the holder is asked.
  const hold = () => {
    if (!take) return;
    take.hidden = !me || !said.take || said.holder === me.page;
    take.textContent = said.take || "";
    document.documentElement.toggleAttribute("data-rl-watching", Boolean(me) && !acts());
    size();  // Plots are as high as the page with the controls has room for.
    if (said.chips) draw(said.chips);  // It says which page this one is.
    const asked = said.question && me && said.question.page === me.page ? said.question : null;
    question.hidden = !asked;
    if (!asked) return;
    [asked.text, asked.yes, asked.no].forEach((words, i) => { question.children[i].textContent = words; });
    question.setAttribute("aria-label", asked.text);
  };

  // Said once in a browser, and each time in one that keeps nothing.
  const sayOnce = (name, text) => {
    try {
      if (!text || localStorage.getItem("rcilab." + name)) return;
      localStorage.setItem("rcilab." + name, "said");
    } catch { /* Then again. */ }
    show({ tone: "info", text });
  };
  // What Esc does and what it is not; after that, in place of viser's own notice, what helps a page without a graphics card.
  const welcome = () => {
    sayOnce("stop", said.stopHint);
    setTimeout(() => { if (document.getElementById("webgl-software-rendering")) sayOnce("software", said.software); }, SHOWN + 1000);
  };

  const draw = (list) => {
    while (chips.children.length > list.length) chips.lastChild.remove();
    list.forEach((chip, i) => {
      let box = chips.children[i];
      if (!box) {
        box = document.createElement("div");
        box.append(document.createElement("small"), document.createElement("b"));
        chips.appendChild(box);
      }
      const look = "rl-chip" + (chip.tone ? " rl-" + chip.tone : "") + (chip.wide ? " rl-wide" : "");
      if (box.className !== look) box.className = look;
      const value = (me && chip.of && chip.of[me.page]) || chip.value, hint = chip.hint || chip.label + ": " + value;
      if (box.dataset.id !== chip.id) box.dataset.id = chip.id;
      if (box.title !== hint) box.title = hint;
      if (box.firstChild.textContent !== chip.label) box.firstChild.textContent = chip.label;
      if (box.lastChild.textContent !== value) box.lastChild.textContent = value;
    });
  };

  const showNotices = (notices) => {
    const serials = notices.map((said) => said.serial), newest = Math.max(0, ...serials);
    if (notice === null && !greeted) notice = newest;  // What was said before this page came is no news to it.
    if (notice > newest && !greeted) notice = 0;  // A workbench that has begun anew.
    const left = lines.filter((line) => !line.serial || serials.includes(line.serial));  // Notices whose cause persists.
    if (toast.className && left.length < lines.length) {
      lines = left;
      if (lines.length) drawToast(); else hide();
    }
    notices.filter((said) => said.serial > notice && (said.page === null || (me && said.page === me.page))).forEach(show);
    keep("notice", notice = Math.max(notice, newest));
  };

  const receive = (event) => {
    const news = JSON.parse(event.data);
    if (news.beat) { send({ kind: "here" }); return; }
    // Another workbench answers at this address: viser's panels are those of the one that is gone.
    if (news.server && said.server && news.server !== said.server) { location.reload(); return; }
    Object.assign(said, news);
    // Smoothed edges and shadows are decided when a page is loaded: viser's arm is not drawn without them afterwards.
    if (news.quality && news.quality !== document.documentElement.dataset.rlQuality) { reloadFor(news.quality); return; }
    if ("stop" in news || "stopHint" in news || "homeHint" in news) label();
    if (news.chips) draw(news.chips);
    if (news.notices) showNotices(news.notices);
    if (!greeted && said.stopHint) welcome();
    greeted = true;
    if ("cursor" in news || "marks" in news) followSoon();
    if ("holder" in news || "take" in news || "question" in news) hold();
    if (news.viser) document.documentElement.dataset.rlViser = news.viser;
    if (news.theme) document.documentElement.dataset.rlTheme = news.theme;
    if (news.language) document.documentElement.lang = news.language;
    window.dispatchEvent(new CustomEvent("rl-news", { detail: news }));
  };

  // Once for a quality: a page that comes back as it was, from a cache, say, does not go round and round.
  const reloadFor = (quality) => {
    if (recall("quality") === quality) return;  // Tried before.
    keep("quality", quality);
    location.reload();
  };
  const drawsInSoftware = () => {
    const gl = document.createElement("canvas").getContext("webgl2"), info = gl && gl.getExtension("WEBGL_debug_renderer_info");
    const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
    if (gl) gl.getExtension("WEBGL_lose_context")?.loseContext();
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
  };

  const connect = () => {
    const scheme = location.protocol === "https:" ? "wss://" : "ws://";
    live = new WebSocket(scheme + location.host + "/rcilab/live");
    live.onopen = () => { greeted = false; bar.classList.remove("rl-lost"); greet(); };
    live.onmessage = receive;
    live.onclose = () => {
      bar.classList.add("rl-lost");
      draw([{ id: "lost", label: "rcilab", value: said.lost || "The workbench is not running.", tone: "bad", wide: true }]);
      setTimeout(connect, 1000);
    };
  };

  window.addEventListener("rl-toast", (event) => show(event.detail));
  window.addEventListener("rl-say", (event) => send(event.detail));  // What the other scripts of the page have to say.
  window.addEventListener("rl-notice", (event) => show(event.detail));  // And to the operator.

  const acts = () => Boolean(me) && said.holder === me.page;
  const size = () => { if (acts()) send({ kind: "size", height: window.innerHeight }); };
  window.addEventListener("resize", () => { size(); place(); });

  // A page that is loaded anew opens the tab that was open, a new one the tab that the server names.
  let shown = null;
  const keepTab = () => {
    const lists = [...document.querySelectorAll('[role="tablist"]')];
    const list = lists.sort((a, b) => b.children.length - a.children.length)[0];
    const found = list ? [...list.querySelectorAll('[role="tab"]')] : [];
    const before = Number(recall("tab") ?? said.tab) || 0;
    if (said.tab === undefined) return;
    if (found.length < 4 || (shown === null && found.length <= before)) return;  // They come one by one.
    if (shown === null) document.documentElement.dataset.rlReady = "";
    const open = Math.max(0, found.findIndex((tab) => tab.getAttribute("aria-selected") === "true"));
    const panel = list.closest(".mantine-ScrollArea-root");
    if (shown === null && open !== before) {
      // viser's tabs react to keys and pointers, not to click().
      found[before].dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
      shown = before;
    } else if (open !== shown) {
      if (shown !== null && panel) panel.firstElementChild.scrollTop = 0;  // What another tab was scrolled by is not its own.
      keep("tab", shown = open);
      send({ kind: "tab", index: open });
    }
  };

  // Waypoints and fault: a line in every plot; the name of the fault, which is long, in the first one.
  const mark = (over, marks, isFirst) => {
    const key = JSON.stringify([marks, isFirst]);
    if (over.dataset.rlMarks === key) return;
    over.dataset.rlMarks = key;
    over.querySelectorAll(".rl-mark").forEach((old) => old.remove());
    for (const { share, label, fault } of marks) {
      const line = document.createElement("div");
      line.className = "rl-mark" + (fault ? " rl-fault" : "") + (share > 0.5 ? " rl-left" : "");
      line.style.left = (share * 100).toFixed(2) + "%";
      if (!fault || isFirst) line.append(Object.assign(document.createElement("span"), { textContent: label }));
      over.appendChild(line);
    }
  };

  // The time cursor: one line in every plot whose x axis is the motion's time; a click there moves it.
  const follow = () => {
    const cursor = said.cursor;
    keepTab();
    if (toast.className) place();  // What is said while a page loads is said before there is a scene.
    const overs = [...document.querySelectorAll(".u-over")], first = overs.find((over) => over.offsetParent);
    overs.forEach((over) => {
      mark(over, said.marks || [], over === first);
      let line = over.querySelector(".rl-cursor");
      if (!line) {
        line = document.createElement("div");
        line.className = "rl-cursor";
        over.appendChild(line);
        over.addEventListener("click", (event) => {
          const box = over.getBoundingClientRect();
          if (box.width > 0) send({ kind: "seek", share: (event.clientX - box.left) / box.width });
        });
      }
      const left = cursor ? (cursor.share * 100).toFixed(2) + "%" : "";
      if (line.style.left !== left) line.style.left = left;
      line.style.display = cursor ? "" : "none";
    });
  };
  let following = 0;
  const followSoon = () => { if (!following) following = setTimeout(() => { following = 0; follow(); }, PAUSE); };

  // Capture phase: before viser and before any text field. A convenience, not a safety function.
  window.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && !event.repeat) pressStop();
  }, true);
  // viser moves its camera by other letters; this one brings it back.
  const isTyping = (target) => target instanceof Element && target.matches("input, textarea, select, [contenteditable]");
  window.addEventListener("keydown", (event) => {
    if (event.code === "KeyH" && !event.repeat && !event.ctrlKey && !event.altKey && !event.metaKey && !isTyping(event.target)) goHome();
  });

  // A hint lies on what is beside its field: none while somebody is at a field, until the mouse goes elsewhere.
  let field = null;
  const heed = (event) => {
    field = isTyping(event.target) ? event.target : null;
    document.documentElement.classList.toggle("rl-typing", field !== null);
  };
  window.addEventListener("keydown", heed, true);
  window.addEventListener("pointerdown", heed, true);
  window.addEventListener("pointerover", (event) => { if (field && event.target !== field && !event.buttons) heed(event); }, true);

  // A button that is held must not stay held when its release would be missed: when the window loses the focus, the
  // button goes out of sight (another tab), or the mouse comes back with no button down.
  const holds = (target) => target instanceof Element ? target.closest("div:has(> div > .rl-held) button") : null;
  let held = null;
  window.addEventListener("pointerdown", (event) => {
    if (held && !holds(event.target)) return;  // Another finger beside the one that holds a button.
    letGo();
    held = event;
    if (event.target instanceof Element && event.target.closest("button")) watchHeld();  // It costs a layout each time.
  }, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    window.addEventListener(kind, (event) => {
      if (held && event.isTrusted && event.pointerId === held.pointerId) held = null;
    }, true);
  }
  window.addEventListener("pointermove", (event) => {
    if (held && !held.key && event.pointerId === held.pointerId && event.buttons === 0) letGo();
  }, true);
  const letGo = () => {
    if (!held) return;
    const { target, pointerId } = held;
    held = null;
    target.classList.remove("rl-holding");
    target.dispatchEvent(new PointerEvent("pointercancel", { bubbles: true, pointerId }));
  };
  const watchHeld = () => {
    if (!held) return;
    if (!held.target.isConnected || held.target.getClientRects().length === 0) letGo();
    else setTimeout(watchHeld, 50);
  };
  window.addEventListener("blur", letGo);
  document.addEventListener("visibilitychange", () => { if (document.hidden) letGo(); });

  // Space and Enter hold a jog button as the mouse does: from key down to key up, which is the click.
  const isKey = (event) => event.key === " " || event.key === "Enter";
  window.addEventListener("keydown", (event) => {
    if (event.key === "Escape") letGo();
    const button = isKey(event) ? holds(event.target) : null;
    if (!button) return;
    event.preventDefault();
    if (event.repeat || held || button.disabled) return;
    holdBy(button, event.key);
  }, true);
  const holdBy = (button, key) => {
    button.dispatchEvent(new PointerEvent("pointerdown", { bubbles: true, button: 0, buttons: 1, pointerId: 1 }));
    held = { target: button, pointerId: 1, key };
    button.classList.add("rl-holding");
    watchHeld();
  };
  // For keys and devices that jog: the button of a direction is held as by the mouse; releasing it is the click.
  window.rcilabJog = {
    hold: (button, key) => {
      if (held || button.disabled || button.getClientRects().length === 0) return false;
      holdBy(button, key);
      return true;
    },
    release: (key) => {
      if (!held || held.key !== key) return;
      const button = held.target;
      letGo();
      button.click();
    },
  };
  window.addEventListener("keyup", (event) => {
    if (!isKey(event) || !holds(event.target)) return;
    event.preventDefault();
    if (!held || held.key !== event.key) return;
    const button = held.target;
    letGo();
    button.click();
  }, true);
  window.addEventListener("focusout", (event) => { if (held && held.key && event.target === held.target) letGo(); }, true);

  if (document.body) build(); else document.addEventListener("DOMContentLoaded", build);
})();
