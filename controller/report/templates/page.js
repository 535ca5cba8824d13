const film = document.querySelector("video");
const plot = document.getElementById("plot");
let mark = null;
const toFilm = t => (t - film.dataset.start) / film.dataset.speed;
const toRun = t => +film.dataset.start + t * film.dataset.speed;
document.querySelectorAll("button[data-time]").forEach(b => b.addEventListener("click", () => {
  const t = +b.dataset.time;
  if (film) { film.pause(); film.currentTime = Math.max(toFilm(t), 0); }
  if (mark) mark(t);
  (film || plot || b).scrollIntoView({ behavior: "smooth", block: "center" });
}));
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
  const shapes = spec.layout.shapes;
  const now = { type: "line", x0: spec.mark_s, x1: spec.mark_s, yref: "paper", y0: 0, y1: 1,
    line: { color: "#22303c", width: 1.2 } };
  spec.layout.height = spec.height;
  spec.layout.shapes = [...shapes, now];
  await Plotly.newPlot(plot, spec.traces, spec.layout, { responsive: true,
    displaylogo: false, displayModeBar: innerWidth > 640 && "hover" });
  mark = t => Plotly.relayout(plot, { [`shapes[${shapes.length}].x0`]: t,
    [`shapes[${shapes.length}].x1`]: t });
  if (film) film.addEventListener("timeupdate", () => mark(toRun(film.currentTime)));
  document.getElementById("joint").addEventListener("change", change => {
    const rows = spec.joints[+change.target.value];
    Plotly.restyle(plot, { y: rows }, rows.map((_, k) => spec.first + k));
  });
})();
