"""CPU time of a picture of a page in Chromium without a window and without a graphics card.

``python -m benchmarks.page_pictures [--drag] view place.glb``: the words are a command of
snakewalk that serves a page; ``--view-at`` is added. The time is that of the browser's processes
during ``SECONDS``, over the pictures that it drew. It depends less on other programs than the
pictures a second do. ``--drag`` turns the camera with the pointer, because
a page without motion draws nothing.
"""

import argparse
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.provenance import provenance
from tests.helpers.browser import chromium, new_tab

SIZE_PX = (1000, 640)
SECONDS = 10.0
COUNT = """async (milliseconds) => {
  const context = WebGL2RenderingContext.prototype;
  let corners = 0, seen = false, pictures = 0;
  for (const name of ["drawElements", "drawElementsInstanced"]) {
    const draw = context[name];
    context[name] = function (...given) {
      corners += given[1] * (given[4] ?? 1);
      seen = true;
      return draw.apply(this, given);
    };
  }
  const begin = performance.now();
  await new Promise((ready) => {
    const look = () => {
      pictures += seen; seen = false;
      performance.now() - begin < milliseconds ? requestAnimationFrame(look) : ready();
    };
    requestAnimationFrame(look);
  });
  const canvas = [...document.querySelectorAll("canvas")].sort((a, b) => b.width - a.width)[0];
  return [pictures, (performance.now() - begin) / 1e3, corners / 3, canvas.width, canvas.height];
}"""


def children_cpu_s() -> float:
    """CPU time of all browsers below this process."""
    parents: dict[int, int] = {}
    spent: dict[int, float] = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = file.read_text()
        except OSError:
            continue
        name, fields = text[text.index("(") + 1 : text.rindex(")")], text.rsplit(")")[-1].split()
        parents[int(file.parent.name)] = int(fields[1])
        if "chrom" in name:
            spent[int(file.parent.name)] = sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")

    def is_ours(process: int) -> bool:
        while process > 1 and process != os.getpid():
            process = parents.get(process, 0)
        return process == os.getpid()

    return sum(seconds for process, seconds in spent.items() if is_ours(process))


def main() -> None:
    """Print a row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drag", action="store_true")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--wait", type=float, default=20.0, help="s until the scene has arrived")
    parser.add_argument("words", nargs=argparse.REMAINDER)
    given = parser.parse_args()
    command = [
        str(Path(sys.executable).with_name("snakewalk")),
        *given.words,
        "--view-at",
        "127.0.0.1:0",
    ]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        url = server.stdout.readline().split()[0]
        with chromium() as browser:
            tab = new_tab(browser, viewport=dict(zip(("width", "height"), SIZE_PX, strict=True)))
            tab.goto(url)
            tab.wait_for_selector("canvas")
            time.sleep(given.wait)
            tab.mouse.move(300.0, 320.0)
            begin_s = children_cpu_s()
            end_s = time.monotonic() + SECONDS
            tab.evaluate(f"(ms) => {{ window.counted = ({COUNT})(ms); }}", 1e3 * SECONDS)
            if given.drag:
                tab.mouse.down()
                while (left_s := end_s - time.monotonic()) > 0.0:
                    tab.mouse.move(300.0 + 20.0 * (SECONDS - left_s), 320.0)
                    time.sleep(0.05)
            pictures, seconds, triangles, wide, high = tab.evaluate("() => window.counted")
            spent_s = children_cpu_s() - begin_s
            if given.picture:
                tab.screenshot(path=str(given.picture))
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(60.0)
    print("| command | canvas | pictures | a second | triangles | CPU a picture | load |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    print(
        f"| `{' '.join(given.words)}` | {wide} x {high} | {pictures} | {pictures / seconds:.1f} "
        f"| {triangles / max(pictures, 1):.0f} | {1e3 * spent_s / max(pictures, 1):.0f} ms "
        f"| {os.getloadavg()[0]:.0f} |"
    )
    print(provenance("python -m benchmarks.page_pictures"))


if __name__ == "__main__":
    main()
