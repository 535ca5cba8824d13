// Look of every page, also that of a log: dark on a dark system, usable on a phone, grey if old,
// without antialiasing if the processor draws it.
(() => {
  const look_of_page = document.createElement("style");
  look_of_page.textContent = `
    html.snakewalk-old body > :not(#snakewalk-stop) { filter: grayscale(1) opacity(.6) }
    body:has(#snakewalk-stop) .mantine-Notifications-root { margin-top: 170px }  /* viser's notices: below the E-STOP */
    @media (prefers-color-scheme: dark) {  /* viser draws its panels in one scheme for all browsers */
      html { background: #000 }
      body > :not(#snakewalk-stop) { filter: invert(1) hue-rotate(180deg) }
      html.snakewalk-old body > :not(#snakewalk-stop) { filter: invert(1) grayscale(1) opacity(.6) }
      body canvas, body img { filter: invert(1) hue-rotate(180deg) }
    }
    @media (max-width: 600px) {  /* viser's panel of a phone: at its full width, below the body */
      body .mantine-Notifications-root { margin: 0 !important; top: auto !important; bottom: 46% }  /* below a verdict of many lines */
      .mantine-Paper-root[style*="position: fixed"] { width: 100% !important; max-height: 45% !important }
      .mantine-Paper-root[style*="position: fixed"] .mantine-ScrollArea-content > * { width: 100% !important }
    }`;
  document.documentElement.append(look_of_page);

  // Without a graphics card antialiasing takes half of the time of a picture.
  const getContext = HTMLCanvasElement.prototype.getContext;
  const probe = getContext.call(document.createElement("canvas"), "webgl2");
  const facts = probe?.getExtension("WEBGL_debug_renderer_info");
  const renderer = facts ? probe.getParameter(facts.UNMASKED_RENDERER_WEBGL) : "";
  probe?.getExtension("WEBGL_lose_context")?.loseContext();
  if (/swiftshader|llvmpipe|software/i.test(renderer)) {
    HTMLCanvasElement.prototype.getContext = function (kind, options) {
      const changed = /^webgl/.test(kind) ? { ...options, antialias: false } : options;
      return getContext.call(this, kind, changed);
    };
  }
})();
