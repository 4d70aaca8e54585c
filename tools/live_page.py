"""The page of a live scene in a headless Chromium."""

import asyncio
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from queue import Queue

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

from sandbox.interactive.live_scene import LiveScene
from sandbox.interactive.server import SceneServer, ServerOptions
from sandbox.scene.compile.scene import Scene

FLAGS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars")
PAINTED = "return Number(document.querySelector('.layout').dataset.painted || 0)"
"""Script that returns the number of frames drawn so far."""


@contextmanager
def live_page(scene: Scene, width: int, height: int) -> Iterator[webdriver.Chrome]:
    """Serve a scene, show its page in a window of so many px, and wait until it is drawn.

    The server lasts until the process ends.
    """
    addresses: Queue[str] = Queue()
    threading.Thread(target=_serve, args=(scene, addresses), daemon=True).start()
    options = Options()
    options.binary_location = str(shutil.which("chromium"))
    with tempfile.TemporaryDirectory() as profile:
        for flag in (*FLAGS, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        driver = webdriver.Chrome(options=options, service=Service(str(shutil.which("chromedriver"))))
        try:
            size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
            driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            driver.get(addresses.get())
            WebDriverWait(driver, 30).until(lambda page: page.execute_script(PAINTED) > 0)
            yield driver
        finally:
            driver.quit()


def _serve(scene: Scene, addresses: "Queue[str]") -> None:
    asyncio.run(SceneServer(scene, partial(LiveScene, scene), ServerOptions()).serve(addresses.put))
