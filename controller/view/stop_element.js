// Our own element in the page: the E-STOP, at every width, over everything else.
// It also drops inputs that waited in the browser, before viser sends them as new ones.
(() => {
  const LATE_MS = 1000, AGAIN_MS = 500;
  const NO_LINE = "no connection to the run: switch the supply off";
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
    </style><button type="button" disabled>E-STOP <small>(Esc)</small></button>
    <output role="status">waiting for the run</output>`;
  const button = root.querySelector("button"), text = root.querySelector("output");
  let socket = null, isArmed = false, isPressed = false;

  const show = (line, color) => {
    text.textContent = line;
    text.style.color = color || "";
    button.disabled = !isArmed;
  };
  const send = (message) => {
    if (!socket || socket.readyState !== WebSocket.OPEN) return false;
    socket.send(message);
    return true;
  };
  const open = () => {
    socket = new WebSocket(location.origin.replace(/^http/, "ws") + "/stop");
    socket.onopen = () => { if (isPressed) isPressed = !send("stop"); };
    socket.onmessage = (message) => {
      const state = JSON.parse(message.data);
      isArmed = state.armed;
      show(state.text, state.color);
    };
    socket.onclose = () => { show(NO_LINE, "#d55e00"); setTimeout(open, AGAIN_MS); };
  };
  const press = () => {
    if (!isArmed) return;
    isPressed = !send("stop");  // sent as soon as there is a connection
    if (isPressed) show(NO_LINE, "#d55e00");
  };
  button.addEventListener("pointerdown", press);
  button.addEventListener("click", press);  // Enter and space
  window.addEventListener("keydown", (event) => { if (event.key === "Escape") press(); }, true);

  const inputs = ["pointerdown", "pointermove", "pointerup", "mousedown", "mousemove", "mouseup",
    "touchstart", "touchmove", "touchend", "click", "dblclick", "keydown", "wheel"];
  for (const name of inputs) {
    window.addEventListener(name, (event) => {
      const age = performance.now() - event.timeStamp;
      if (!event.isTrusted || age <= LATE_MS || event.composedPath().includes(host)) return;
      event.stopImmediatePropagation();
      if (event.cancelable) event.preventDefault();
      if (!name.endsWith("move") && name !== "wheel") send(`late ${Math.round(age)}`);
    }, {capture: true, passive: false});
  }

  const place = () => {
    const put = () => { if (!host.isConnected) document.body.append(host); };
    put();
    new MutationObserver(put).observe(document.body, {childList: true});
  };
  if (document.body) place(); else document.addEventListener("DOMContentLoaded", place);
  open();
})();
