"""Frame rate and latency of a live scene in a headless Chromium on this machine.

    python -m tools.benchmarks.live [--bodies N] [--seconds S]

The latency of a drag is the time from a pointer event in the page to the end of the drawing of the first frame that was
computed with it. The display adds up to one frame of its own.
"""

import argparse
import random
from functools import partial
from time import perf_counter, sleep

import numpy as np
from selenium import webdriver

from sandbox.scene.files.load import loads
from tools.live_page import PAINTED, live_page

SCENE = """
title = "Balls in a box"
[world]
gravity = [0.0, -9.81]
[play]
view = [[-1.0, -1.0], [11.0, 8.0]]
[[wall]]
points = [[0.0, 8.0], [0.0, 0.0], [10.0, 0.0], [10.0, 8.0]]
thickness = 0.1
[[grid]]
name = "balls"
origin = [0.5, 0.5]
columns = {columns}
rows = 10
spacing = [{spacing}, 0.6]
radius = 0.2
restitution = 0.6
friction = 0.3
"""

MEASURE = """
const moves = (window.moves = []), figure = document.querySelector(".layout"), canvas = figure.querySelector("canvas");
window.latencies = [];
canvas.addEventListener("pointermove", () => moves.push(performance.now()), true);
new MutationObserver(() => {
  const now = performance.now();
  const shown = Number(figure.dataset.moves);
  for (let k = window.latencies.length; k < shown; k += 1) window.latencies.push(now - moves[k]);
}).observe(figure, { attributes: true, attributeFilter: ["data-painted"] });
"""


def main() -> None:
    """Measure, and print the figures."""
    parser = argparse.ArgumentParser(description="Frame rate and latency of a live scene in a headless Chromium.")
    parser.add_argument("--bodies", type=int, default=100, metavar="N", help="number of balls; default: 100")
    parser.add_argument("--seconds", type=float, default=5.0, metavar="S", help="length of each part; default: 5")
    options = parser.parse_args()
    columns = max(options.bodies // 10, 1)
    scene = loads(SCENE.format(columns=columns, spacing=min(0.9, 9.0 / columns)))
    with live_page(scene, 1280, 900) as driver:
        _measure(driver, len(scene.bodies), options.seconds)


def _measure(driver: webdriver.Chrome, bodies: int, seconds: float) -> None:
    driver.find_element("css selector", "[data-action=play]").click()
    sleep(1.0)
    before, begin = driver.execute_script(PAINTED), perf_counter()
    sleep(seconds)
    frames, passed = driver.execute_script(PAINTED) - before, perf_counter() - begin

    driver.find_element("css selector", "[data-action=reset]").click()
    driver.execute_script(MEASURE)
    x, y, width, height = driver.execute_script(
        "const box = document.querySelector('canvas').getBoundingClientRect();"
        "return [box.x, box.y, box.width, box.height]"
    )
    scale = min(width / 12.0, height / 9.0)
    ball = x + width / 2.0 + (0.5 - 5.0) * scale, y + height / 2.0 - (0.5 - 3.5) * scale  # view centred at (5, 3.5)
    mouse = partial(driver.execute_cdp_cmd, "Input.dispatchMouseEvent")
    held = {"button": "left", "buttons": 1, "clickCount": 1}
    mouse({"type": "mousePressed", "x": ball[0], "y": ball[1], **held})
    until = perf_counter() + seconds
    draw = random.Random(1)
    while perf_counter() < until:
        at = {"x": ball[0] + draw.uniform(0, 5) * scale, "y": ball[1] - draw.uniform(0, 5) * scale}
        mouse({"type": "mouseMoved", **at, **held})
        sleep(draw.uniform(0.005, 0.03))
    sleep(0.3)
    latencies = np.asarray(driver.execute_script("return window.latencies"))
    median, p95 = np.percentile(latencies, (50, 95))
    print(f"{bodies} bodies: {frames / passed:.1f} frames/s")
    print(f"pointer to drawn frame, {len(latencies)} moves: median {median:.0f} ms, 95 % within {p95:.0f} ms")


if __name__ == "__main__":
    main()
