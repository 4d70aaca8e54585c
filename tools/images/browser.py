"""Pictures of live scenes in the browser."""

import base64
from functools import partial
from io import BytesIO
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.webdriver.support.ui import Select, WebDriverWait

import sandbox
from tools.images.files import save_png
from tools.live_page import PAINTED, live_page

SIZE = 1180, 700
"""px"""
SECONDS = 4.6
"""Simulated time of the picture."""


def live(path: Path) -> None:
    """Run the bridge on pymunk beside a ghost with a tenth of dt, step by step."""
    scene = sandbox.load("bridge")
    with live_page(scene, *SIZE) as driver:
        Select(driver.find_element("css selector", "select.ghost")).select_by_visible_text("dt ÷ 10")
        figure = driver.find_element("css selector", ".layout")
        wait = WebDriverWait(driver, 30, 0.005)
        for _ in range(round(SECONDS / scene.solver.dt)):
            before = driver.execute_script(PAINTED)
            figure.send_keys(".")
            wait.until(partial(_is_painted_after, before))
        driver.execute_script("document.activeElement.blur()")
        png = driver.execute_cdp_cmd("Page.captureScreenshot", {})["data"]
    save_png(Image.open(BytesIO(base64.b64decode(png))), path, 48)


def _is_painted_after(frames: int, driver: webdriver.Chrome) -> bool:
    """Return whether more frames were drawn than so many."""
    return int(driver.execute_script(PAINTED)) > frames
