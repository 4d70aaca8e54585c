"""A live scene in a browser, by pointer, finger and keyboard, on a desktop and a phone."""

import asyncio
import base64
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from queue import Queue
from typing import Any, NamedTuple

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

import sandbox
from sandbox.interactive.live_scene import LiveScene
from sandbox.interactive.server import SceneServer, ServerOptions
from sandbox.interactive.widget import LiveWidget
from sandbox.scene.files.load import loads
from tests.browser import Browser

pytestmark = pytest.mark.fail_slow(60)  # shows pages in a browser

SCENE = """
title = "Disc in space"
about = "One disc in the middle of the view, without gravity."

[play]
view = [[-4.0, -3.0], [4.0, 3.0]]

[[ball]]
name = "disc"
position = [0.0, 0.0]
angle = 0.3
radius = 0.6
friction = 0.5
restitution = 0.5
"""

DATA = "document.querySelector('.layout').dataset"
SIZES = {"desktop": (1280, 800), "phone": (390, 844)}


class Served(NamedTuple):
    """A server in another thread, with one scene for all viewers."""

    address: str
    live: LiveScene


@pytest.fixture
def served() -> Iterator[Served]:
    scene, addresses = loads(SCENE), Queue[str]()
    server = SceneServer(scene, partial(LiveScene, scene), ServerOptions(is_shared=True))
    loop = asyncio.new_event_loop()
    task = loop.create_task(server.serve(addresses.put))

    def run() -> None:
        with pytest.raises(asyncio.CancelledError):
            loop.run_until_complete(task)
        loop.close()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        live = server._shared
        assert live is not None
        yield Served(addresses.get(timeout=30), live)
    finally:
        loop.call_soon_threadsafe(task.cancel)
        thread.join()


def show(browser: Browser, served: Served, size: str) -> None:
    """Show the page in a size, and wait until the scene is drawn."""
    width, height = SIZES[size]
    is_phone = size == "phone"
    device = {"width": width, "height": height, "deviceScaleFactor": 2 if is_phone else 1, "mobile": is_phone}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", device)
    touch = {"enabled": is_phone, "maxTouchPoints": 1}
    browser.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", touch)
    browser.log()
    browser.driver.get(served.address)
    browser.wait(f"Number({DATA}.painted) > 0")


def press(browser: Browser, *keys: str) -> None:
    """Press keys while the scene has the focus."""
    browser.do("document.querySelector('.layout').focus({preventScroll: true})")
    ActionChains(browser.driver).send_keys(*keys).perform()


def middle_of_stage(browser: Browser) -> tuple[float, float, float]:
    """Return the pixel in the middle of the canvas, and the pixels per metre."""
    x, y, width, height = browser.do(
        "document.querySelector('canvas.world').scrollIntoView({block: 'center', behavior: 'instant'});"
        "const box = document.querySelector('canvas.world').getBoundingClientRect();"
        "return [box.x, box.y, box.width, box.height]"
    )
    return x + width / 2, y + height / 2, min(width / 8, height / 6)  # the view is 8 m by 6 m


def touch(browser: Browser, kind: str, *point: float) -> None:
    points = [{"x": point[0], "y": point[1]}] if point else []
    browser.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def mouse(browser: Browser, kind: str, x: float, y: float) -> None:
    event: dict[str, Any] = {"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1}
    browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)


def drag(browser: Browser, size: str, dx: float, dy: float) -> None:
    """Drag the disc from the middle of the view by an offset, m, without releasing it."""
    x, y, scale = middle_of_stage(browser)
    for k in range(9):
        at = x + scale * dx * k / 8, y - scale * dy * k / 8
        if size == "phone":
            touch(browser, "touchMove" if k else "touchStart", *at)
        else:
            mouse(browser, "mouseMoved" if k else "mousePressed", *at)
    browser.wait(f"Number({DATA}.moves) >= 8")


def release(browser: Browser, size: str) -> None:
    if size == "phone":
        touch(browser, "touchEnd")
    else:
        mouse(browser, "mouseReleased", 0, 0)


@pytest.mark.parametrize("size", SIZES)
def test_scene_plays_and_is_dragged(size: str, browser: Browser, served: Served) -> None:
    show(browser, served, size)
    browser.driver.find_element(By.CSS_SELECTOR, "[data-action=play]").click()
    browser.wait(f"Number({DATA}.time) > 0.3")
    drag(browser, size, 1.5, 1.0)
    assert list(served.live.simulation.pulls) == ["disc"]
    here = browser.do(f"return Number({DATA}.time)")
    browser.wait(f"Number({DATA}.time) > {here + 1.0}")  # critically damped at 7.5 Hz: it has arrived
    release(browser, size)
    browser.driver.find_element(By.CSS_SELECTOR, "[data-action=play]").click()
    browser.wait(f"{DATA}.playing === 'false'")
    assert served.live.frame.position[0].tolist() == pytest.approx([1.5, 1.0], abs=0.05)  # a few pixels
    assert not served.live.simulation.pulls
    assert browser.do("return document.documentElement.scrollWidth") <= SIZES[size][0]
    assert browser.log() == []


@pytest.mark.parametrize("size", SIZES)
def test_drag_while_paused_moves_the_body(size: str, browser: Browser, served: Served) -> None:
    show(browser, served, size)
    drag(browser, size, -2.0, 1.0)
    release(browser, size)
    assert served.live.frame.position[0].tolist() == pytest.approx([-2.0, 1.0], abs=0.05)
    assert served.live.frame.time == 0.0
    assert browser.log() == []


def test_keys_play_step_reset_and_push(browser: Browser, served: Served) -> None:
    show(browser, served, "desktop")
    press(browser, "..")
    browser.wait(f"Number({DATA}.time) === 0.02")
    press(browser, "]", Keys.ARROW_RIGHT)
    press(browser, " ")
    browser.wait(f"Number({DATA}.time) > 0.3")
    press(browser, " ")
    browser.wait(f"{DATA}.playing === 'false'")
    assert served.live.frame.velocity[0].tolist() == pytest.approx([1.0, 0.0])
    press(browser, "r")
    browser.wait(f"Number({DATA}.time) === 0")
    assert browser.log() == []


def test_controls_change_the_scene(browser: Browser, served: Served) -> None:
    show(browser, served, "desktop")
    slider = browser.driver.find_element(By.CSS_SELECTOR, "input[aria-label='ball.*.restitution']")
    slider.send_keys(Keys.ARROW_RIGHT)
    browser.wait("document.querySelectorAll('.slider output')[2].textContent === '0.505'")
    for name, value in (("engine", "reference"), ("ghost", '["pymunk",1]')):
        browser.do(
            "const [name, value] = arguments, choice = document.querySelector(`select.${name}`);"
            "choice.value = value; choice.dispatchEvent(new Event('change'))",
            name,
            value,
        )
        browser.wait(f"document.querySelector('select.{name}').value === {value!r}")
    browser.wait("document.querySelectorAll('.legend li').length === 2")
    assert served.live.simulation.engine == "reference"
    assert served.live.simulation.scene.balls[0].restitution == 0.505
    press(browser, ".")
    browser.wait("document.querySelector('.distance').textContent === '0 m apart'")
    named = (
        "return [...document.querySelectorAll('button, select, input')].every((it) => it.ariaLabel || it.labels.length)"
    )
    assert browser.do(named)
    assert browser.log() == []


def test_page_of_a_server_that_has_ended_says_so(browser: Browser) -> None:
    scene, addresses = loads(SCENE), Queue[str]()

    async def serve_until_shown() -> None:
        server = SceneServer(scene, partial(LiveScene, scene), ServerOptions())
        task = asyncio.create_task(server.serve(addresses.put))
        address = await asyncio.to_thread(addresses.get)
        await asyncio.to_thread(show, browser, Served(address, LiveScene(scene)), "desktop")
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(serve_until_shown())
    browser.wait(f"{DATA}.ended === 'true'")
    assert "ended" in browser.do("return document.querySelector('.message').textContent")
    assert browser.do("return [...document.querySelectorAll('button, select, input')].every((it) => it.disabled)")


NOTEBOOK = """<!doctype html><style>{style}</style><body style="margin: 0; width: 640px"><div id="cell"></div>
<script type="module">
import widget from "data:text/javascript;base64,{module}";
window.sent = [];
const callbacks = [];
window.reply = (message) => callbacks.forEach((each) => each(message));
const model = {{
  send: (message) => window.sent.push(message),
  on: (name, callback) => name === "msg:custom" && callbacks.push(callback),
  off: (name, callback) => callbacks.splice(callbacks.indexOf(callback), 1),
}};
window.dispose = widget.render({{ model, el: document.getElementById("cell") }});
</script>"""
"""A page with the interface of a notebook that a widget uses."""


def test_widget_plays_in_a_cell_of_a_notebook(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replies: list[Any] = []
    monkeypatch.setattr(LiveWidget, "send", lambda self, content, buffers=None: replies.append(content))
    widget = sandbox.live(loads(SCENE))
    page = tmp_path / "notebook.html"
    module = base64.b64encode(str(widget._esm).encode()).decode()
    page.write_text(NOTEBOOK.format(style=widget._css, module=module), encoding="utf-8")

    def answer() -> None:
        """Pass the requests of the page to the widget, and its replies to the page."""
        for message in browser.do("return window.sent.splice(0)"):
            widget._handle_custom_msg(message, [])
        while replies:
            browser.do("window.reply(arguments[0])", replies.pop(0))

    browser.show(page)
    browser.wait("window.sent && window.sent.length")
    answer()
    browser.wait(f"Number({DATA}.painted) > 0")
    browser.driver.find_element(By.CSS_SELECTOR, "[data-action=play]").click()
    for _ in range(500):
        answer()
        if widget.simulation.time > 0.1:
            break
    assert widget.simulation.time > 0.1
    assert browser.do("const f = document.querySelector('.layout'); return f.scrollWidth <= f.clientWidth")
    browser.do("window.dispose()")
    answer()
    assert widget._viewers == {}
    assert browser.log() == []
    widget.close()
