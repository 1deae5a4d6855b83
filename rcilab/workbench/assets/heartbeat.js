// Heartbeats are sent by a separate thread: drawing a scene without a graphics card can block the page for seconds, and
// a slow page still has its operator. A page that is blocked for longer than `SLOWEST` counts as closed.
(() => {
  "use strict";
  const SLOWEST = 4000;  // [ms] The longest frame that software rendering was seen to take is 3.3 s.
  const work = (slowest) => {
    let me = null, socket = null, lastAnswer = 0;
    const hello = () => { if (socket && socket.readyState === WebSocket.OPEN && me) socket.send(JSON.stringify({ kind: "hello", ...me })); };
    const connect = (address) => {
      socket = new WebSocket(address);
      socket.onopen = hello;
      socket.onmessage = () => {  // A heartbeat of the server.
        self.postMessage(0);  // The page's own thread answers when it can.
        if (Date.now() - lastAnswer < slowest) socket.send('{"kind":"here"}');
      };
      socket.onclose = () => setTimeout(() => connect(address), 1000);
    };
    self.onmessage = ({ data }) => {
      lastAnswer = Date.now();
      if (!data) return;
      me = data.me;
      if (socket) hello(); else connect(data.address);
    };
  };
  let worker;
  try {
    worker = new Worker(URL.createObjectURL(new Blob([`(${work})(${SLOWEST})`], { type: "text/javascript" })));
  } catch { return; }  // A browser without workers: the page's own thread answers alone.
  worker.onmessage = () => worker.postMessage(null);
  const address = (location.protocol === "https:" ? "wss://" : "ws://") + location.host + "/rcilab/heartbeat";
  window.addEventListener("rl-me", (event) => worker.postMessage({ me: event.detail, address }));
})();
