"""Notebook displays in a browser: they are painted, as tall as their pages, and request nothing from a network."""

from collections.abc import Callable
from pathlib import Path

import pytest

import sandbox
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.html_repr import HtmlRepr
from sandbox.measure.compare import Comparison
from tests.browser import Browser

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

PAINTED = """(() => {
  const canvas = document.querySelector("canvas");
  if (!canvas || !canvas.width) return false;
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  return pixels.some((value) => value > 0);
})()"""


BALL_ON_TABLE = """
world = { duration = 1.0 }
surface = { sliding_friction = 0.2, rolling_friction = 0.01 }
ball = [{ name = "cue", position = [0.5, 0.5], radius = 0.03 }, { name = "b", position = [0.9, 0.5], radius = 0.03 }]
"""


def shot() -> ShotResult:
    return sandbox.Table(sandbox.loads(BALL_ON_TABLE)).shoot(sandbox.Stroke(aim=0.02, speed=1.0), record_paths=True)


def run_with_an_added_body() -> sandbox.Trajectory:
    scene = sandbox.loads("ball = [{ name = 'a', position = [0, 0], radius = 0.5 }]\nworld = { duration = 0.1 }")
    return sandbox.run(
        scene, actions=[sandbox.Spawn(time=0.05, ball=sandbox.Ball(name="b", position=(3, 0), radius=1))]
    )


def test_two_displays_of_one_run_are_painted(browser: Browser, comparison: Comparison, tmp_path: Path) -> None:
    run = next(iter(comparison.trajectories.values()))
    frame = run._repr_html_()
    page = tmp_path / "notebook.html"
    page.write_text(f"<!doctype html><meta charset=utf-8>{frame}{frame}", encoding="utf-8")
    browser.show(page)
    assert_painted_and_full_height(browser)
    assert [line for line in browser.log() if "SEVERE" in line] == []
    assert [url for url in browser.requests() if url.startswith("http")] == []


@pytest.mark.parametrize("display", [shot, run_with_an_added_body])
def test_display_without_charts_is_painted(browser: Browser, display: Callable[[], HtmlRepr], tmp_path: Path) -> None:
    page = tmp_path / "notebook.html"
    page.write_text(f"<!doctype html><meta charset=utf-8>{display()._repr_html_()}", encoding="utf-8")
    browser.show(page)
    assert_painted_and_full_height(browser)
    assert [line for line in browser.log() if "SEVERE" in line] == []


def assert_painted_and_full_height(browser: Browser) -> None:
    """Assert that the replay in each frame is painted, and that each frame is as tall as its page."""
    for frame_element in browser.driver.find_elements("tag name", "iframe"):
        browser.do("arguments[0].scrollIntoView()", frame_element)
        browser.driver.switch_to.frame(frame_element)
        assert browser.wait(PAINTED)
        assert browser.wait("innerHeight >= document.documentElement.scrollHeight")  # nothing scrolls within
        browser.driver.switch_to.default_content()
