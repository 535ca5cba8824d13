// Our own element in the page: the E-STOP, the age of what is shown, and the run's end, at every
// width, over everything else. It also drops inputs that waited in the browser, before viser sends
// them as new ones.
(() => {
  const LATE_MS = 1000, AGAIN_MS = 500, SILENT_MS = 1000, LOOK_MS = 200;
  const FAULT = "#d55e00";
  const UNCONFIRMED = "E-STOP is pressed, but the run has not confirmed it: use Ctrl-C or the switch";
  const tab = sessionStorage.snakewalkTab ||= Math.random().toString(36).slice(2, 10);
  const host = document.createElement("div");
  host.id = "snakewalk-stop";
  host.style.cssText = "position:fixed;z-index:2147483647;top:max(8px,env(safe-area-inset-top));"
    + "left:max(8px,env(safe-area-inset-left));max-width:calc(100vw - 16px)";
  const root = host.attachShadow({mode: "open"});
  root.innerHTML = `<style>
      button { all: unset; box-sizing: border-box; display: block; min-width: 132px; height: 52px;
        padding: 0 16px; border-radius: 8px; background: #c92a2a; color: #fff; text-align: center;
        font: 700 18px system-ui, sans-serif; cursor: pointer; touch-action: none;
        user-select: none; -webkit-user-select: none; box-shadow: 0 1px 6px #0006; }
      button:active { background: #8f1d1d; }
      button:focus-visible { outline: 3px solid #22303c; outline-offset: 2px; }
      button:disabled { background: #8796a5; cursor: default; }
      small { font-weight: 400; font-size: 12px; }
      output { display: block; width: fit-content; max-width: 300px; margin-top: 4px;
        padding: 2px 8px; border-radius: 6px; background: #fff; color: #22303c; box-shadow: 0 1px 4px #0003;
        font: 13px system-ui, sans-serif; pointer-events: none; }
      output:empty { display: none; }
      #verdict, a { pointer-events: auto; overflow-wrap: anywhere; }
      #age { background: #b34700; color: #fff; font-weight: 700; }
      @media (prefers-color-scheme: dark) {
        output { background: #000; color: #f1f3f5; }
        button:focus-visible { outline-color: #fff; }
      }
    </style><button type="button" disabled>E-STOP <small>(Esc)</small></button>
    <output id="age" role="alert"></output><output id="state" role="status">waiting for the run</output><output id="verdict"></output><output id="report"></output>`;
  const button = root.querySelector("button");
  const text = root.querySelector("#state"), age = root.querySelector("#age");
  let socket = null, isArmed = false, isPressed = false, isOver = false, newestMs = null, newest = null;

  const show = (line, color) => {
    text.textContent = line;
    text.style.color = color || "";
    button.disabled = !isArmed;
  };
  const name_page = () => {
    const title = isOver ? "snakewalk: the run has ended" : "snakewalk";
    if (document.title !== title) document.title = title;
  };

  const send = (message) => {
    if (!socket || socket.readyState !== WebSocket.OPEN) return false;
    socket.send(message);
    return true;
  };
  const take = (state) => {
    newest = state;
    newestMs = state.age_ms === null ? null : performance.now() - state.age_ms;
    isArmed = state.armed;
    isOver = state.over;
    if (state.pressed || isOver) isPressed = false;
    if (!isPressed) show(state.text, state.color);
    root.querySelector("#verdict").textContent = state.verdict;
    if (isOver) keep_end(state);
    look();
  };
  // The end is also shown when the page is loaded again and nothing is served any more.
  const workers = navigator.serviceWorker;  // undefined on an address that is not this machine's
  if (workers) workers.register("/stop.js").catch(() => {});
  const keep_end = async (state) => {
    if (!workers || !window.caches) return;
    const text = (line) => Object.assign(document.createElement("p"), {textContent: line}).outerHTML;
    const page = `<!doctype html><meta charset="utf-8"><title>snakewalk: the run has ended</title>`
      + `<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">`
      + `<body style="font: 16px system-ui, sans-serif; max-width: 36em; margin: 3em auto; padding: 0 1em">`
      + text(state.text) + text(state.verdict) + root.querySelector("#report").innerHTML
      + text(`Nothing is served here since ${new Date().toLocaleString()}. The newest run prints its own address.`);
    const kept = new Response(page, {headers: {"Content-Type": "text/html; charset=utf-8"}});
    await (await caches.open("snakewalk")).put("/end", kept);
  };
  // The report opens from the browser's own copy: the server stops when the command ends.
  const keep_report = async (data) => {
    const page = new Blob([data], {type: "text/html; charset=utf-8"});
    const link = Object.assign(document.createElement("a"), {target: "_blank", textContent: "open the report"});
    try {
      await (await caches.open("snakewalk")).put("/report", new Response(page));
      link.href = "/report";
    } catch {  // not an address of this machine, or no space: as long as this tab is open
      link.href = URL.createObjectURL(page);
    }
    root.querySelector("#report").replaceChildren(link);
    if (isOver) await keep_end(newest);
    send("kept");
  };
  const look = () => {  // also while nothing comes
    name_page();
    const ageMs = performance.now() - newestMs;
    const isOld = !isOver && newestMs !== null && ageMs > SILENT_MS;
    const line = isOld ? `no data for ${(ageMs / 1000).toFixed(1)} s: E-STOP may not arrive; `
      + "use Ctrl-C or the switch" : "";
    if (age.textContent !== line) age.textContent = line;
    document.documentElement.classList.toggle("snakewalk-old", isOld);
  };
  const open = () => {
    socket = new WebSocket(location.origin.replace(/^http/, "ws") + "/stop");
    socket.onopen = () => { send(`tab ${tab}`); if (isPressed) send("stop"); };
    socket.onmessage = ({data}) => typeof data === "string" ? take(JSON.parse(data)) : keep_report(data);
    socket.onclose = () => {
      if (isOver) return;
      if (!isPressed) show("no connection to the run: switch the supply off", FAULT);
      setTimeout(open, AGAIN_MS);
    };
  };
  const press = () => {
    if (!isArmed || isOver) return;
    isPressed = true;  // until the run confirms it; sent again with each new connection
    send("stop");
    show(UNCONFIRMED, FAULT);
  };
  button.addEventListener("pointerdown", press);
  button.addEventListener("click", press);  // Enter and space
  window.addEventListener("keydown", (event) => { if (event.key === "Escape") press(); }, true);

  const inputs = ["pointerdown", "pointermove", "pointerup", "mousedown", "mousemove", "mouseup",
    "touchstart", "touchmove", "touchend", "click", "dblclick", "keydown", "wheel"];
  for (const name of inputs) {
    window.addEventListener(name, (event) => {
      const age_ms = performance.now() - event.timeStamp;
      if (!event.isTrusted || event.composedPath().includes(host)) return;
      if (age_ms <= LATE_MS) {
        if (name.endsWith("down")) send("input");
        return;
      }
      event.stopImmediatePropagation();
      if (event.cancelable) event.preventDefault();
      if (!name.endsWith("move") && name !== "wheel") send(`late ${Math.round(age_ms)}`);
    }, {capture: true, passive: false});
  }

  const place = () => {
    const put = () => { if (!host.isConnected) document.body.append(host); };
    put();
    new MutationObserver(put).observe(document.body, {childList: true});
  };
  if (document.body) place(); else document.addEventListener("DOMContentLoaded", place);
  open();
  setInterval(look, LOOK_MS);
})();
