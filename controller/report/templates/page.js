const film = document.querySelector("video");
const plot = document.getElementById("plot");
const toFilm = t => (t - film.dataset.start) / film.dataset.speed;
const toRun = t => +film.dataset.start + t * film.dataset.speed;
// One cursor: film, curves, map and heat maps show the same time, and each of them sets it.
const cursors = [];
const clock = document.getElementById("clock");
const show = t => {
  cursors.forEach(draw => draw(t));
  if (clock) clock.textContent = `${t.toFixed(2)} s`;
};
const seek = t => {
  if (film) { film.pause(); film.currentTime = Math.max(toFilm(t), 0); }
  show(t);
};
document.querySelectorAll("button[data-time]").forEach(b => b.addEventListener("click", () => {
  seek(+b.dataset.time);
  (film || plot || b).scrollIntoView({ behavior: "smooth", block: "center" });
}));
if (film) {
  let shown = -1;
  const next = film.requestVideoFrameCallback ? f => film.requestVideoFrameCallback(f) : requestAnimationFrame;
  const follow = (_, frame) => {  // the frame that is seen, not the next one
    const at = film.paused || !frame ? film.currentTime : frame.mediaTime;
    if (at !== shown) show(toRun(shown = at));
    next(follow);
  };
  follow();
}
// Pictures: "time FROM TO" names a panel over time, "track T1 T2 ..." the points of the way.
const numbers = text => (text.match(/-?\d+(\.\d+)?(e-?\d+)?/g) || []).map(Number);
const overlay = (img, svg) => {
  const [, , width, height] = numbers(svg.documentElement.getAttribute("viewBox"));
  const box = document.createElement("div");
  box.className = "picture";
  img.replaceWith(box);
  box.append(img);
  const put = (kind, x, y, h) => {
    const line = document.createElement("i");
    line.className = kind;
    Object.assign(line.style, { left: `${100 * x / width}%`, top: `${100 * y / height}%` });
    if (h) line.style.height = `${100 * h / height}%`;
    box.append(line);
    return line;
  };
  const pick = act => {
    const at = event => {
      if (event.type === "pointermove" && !event.buttons) return;
      const rect = img.getBoundingClientRect();
      act((event.clientX - rect.left) / rect.width * width,
        (event.clientY - rect.top) / rect.height * height);
    };
    box.addEventListener("pointerdown", at);
    box.addEventListener("pointermove", at);
  };
  svg.querySelectorAll("g[id^='time ']").forEach(panel => {
    const [from, to] = numbers(panel.id);
    const edges = numbers(panel.querySelector("path").getAttribute("d"));
    const xs = edges.filter((_, k) => k % 2 === 0), ys = edges.filter((_, k) => k % 2);
    const left = Math.min(...xs), right = Math.max(...xs), top = Math.min(...ys);
    const line = put("cursor", left, top, Math.max(...ys) - top);
    cursors.push(t => {
      const share = (t - from) / (to - from);
      line.hidden = !(share >= 0 && share <= 1);
      line.style.left = `${100 * (left + share * (right - left)) / width}%`;
    });
    pick((x, y) => {
      if (x >= left && x <= right && y >= top && y <= Math.max(...ys))
        seek(from + (x - left) / (right - left) * (to - from));
    });
  });
  svg.querySelectorAll("g[id^='track ']").forEach(way => {
    const times = numbers(way.id), points = numbers(way.querySelector("path").getAttribute("d"));
    if (points.length !== 2 * times.length) return;
    const dot = put("dot", points[0], points[1]);
    cursors.push(t => {
      const k = Math.max(times.findLastIndex(s => s <= t), 0), n = Math.min(k + 1, times.length - 1);
      const share = n === k ? 0 : Math.min((t - times[k]) / (times[n] - times[k] || 1), 1);
      const at = c => points[2 * k + c] + Math.max(share, 0) * (points[2 * n + c] - points[2 * k + c]);
      dot.style.left = `${100 * at(0) / width}%`;
      dot.style.top = `${100 * at(1) / height}%`;
    });
    pick((x, y) => {
      const far = times.map((_, k) => Math.hypot(points[2 * k] - x, points[2 * k + 1] - y));
      seek(times[far.indexOf(Math.min(...far))]);
    });
  });
};
document.querySelectorAll("img[src^='data:image/svg+xml;base64,']").forEach(img => {
  const text = new TextDecoder().decode(
    Uint8Array.from(atob(img.src.split(",")[1]), c => c.charCodeAt(0)));
  overlay(img, new DOMParser().parseFromString(text, "image/svg+xml"));
});
(async () => {
  if (!plot) return;
  const unpacked = id => {
    const packed = atob(document.getElementById(id).textContent);
    const bytes = Uint8Array.from(packed, c => c.charCodeAt(0));
    const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(plain).text();
  };
  const library = document.createElement("script");
  library.textContent = await unpacked("plotly");
  document.head.append(library);
  const spec = JSON.parse(await unpacked("curves-data"));
  const upright = (time_s, line) => ({ type: "line", x0: time_s, x1: time_s, yref: "paper", y0: 0, y1: 1, line });
  const shapes = spec.marks.map(([time_s, color, dash]) =>
    ({ ...upright(time_s, { color, width: 1, dash }), opacity: 0.6, layer: "below" }));
  const count = spec.titles.length, panelPx = 160;
  const gap = 34 / (panelPx * count);  // for the title and the legend of the lower panel
  const tall = (1 - gap * (count - 1)) / count;
  const layout = {
    height: panelPx * count + 88, margin: { l: 46, r: 8, t: 50, b: 36 },
    font: { family: "system-ui, sans-serif", size: innerWidth > 640 ? 12 : 10, color: "#22303c" },
    hovermode: "x", showlegend: true, dragmode: "zoom",
    xaxis: { range: [0, Math.max(spec.end_s, 1e-3)], title: { text: "time (s)", standoff: 4 },
      anchor: "free", position: 0 },
    shapes: [...shapes, upright(spec.mark_s, { color: "#22303c", width: 1.2 })],
    annotations: spec.titles.map((title, row) => ({ text: `<b>${title}</b>`, xref: "paper", yref: "paper",
      x: 0, y: 1 - row * (tall + gap), xanchor: "left", yanchor: "bottom", showarrow: false })),
  };
  spec.titles.forEach((_, row) => {
    const top = 1 - row * (tall + gap), number = row ? row + 1 : "";
    layout[`yaxis${number}`] = { domain: [Math.max(top - tall, 0), top], fixedrange: true,
      gridcolor: "#e9edf1", zerolinecolor: "#d9e0e6", nticks: 5 };
    layout[`legend${number}`] = { orientation: "h", x: 1, xanchor: "right", y: top, yanchor: "bottom" };
  });
  const traces = spec.traces.map(trace => {
    const number = trace.row > 1 ? trace.row : "";
    return { type: "scatter", mode: "lines", xaxis: "x", yaxis: `y${number}`, legend: `legend${number}`,
      line: { color: trace.colour, width: 1.3 }, hovertemplate: `${trace.name} %{y:.4g}<extra></extra>`,
      ...trace };
  });
  await Plotly.newPlot(plot, traces, layout, { responsive: true,
    displaylogo: false, displayModeBar: innerWidth > 640 && "hover" });
  let isDrawing = false, next = null;
  const mark = async t => {  // no more often than it can be drawn
    next = t;
    if (isDrawing) return;
    isDrawing = true;
    while (next !== null) {
      const at = next;
      next = null;
      await Plotly.relayout(plot, { [`shapes[${shapes.length}].x0`]: at,
        [`shapes[${shapes.length}].x1`]: at });
    }
    isDrawing = false;
  };
  cursors.push(mark);
  show(film ? toRun(film.currentTime) : spec.mark_s);
  plot.on("plotly_click", event => seek(event.points[0].x));
  document.getElementById("joint").addEventListener("change", change => {
    const rows = spec.joints[+change.target.value];
    Plotly.restyle(plot, { y: rows }, rows.map((_, k) => traces.length - rows.length + k));
  });
})();
