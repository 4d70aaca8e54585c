"""Notebooks: scenes, runs, comparisons, trade-offs, shots and shot odds as HTML that needs no network.

Each is a page of the report in a frame of its own (`<iframe srcdoc>`): its styles, scripts and identifiers cannot
clash with the notebook or with another page, and its content security policy lets it fetch nothing. The page reports
its height, and a script beside the frame makes the frame as tall. Where a notebook runs no scripts (JupyterLab, as long
as it does not trust the notebook), the frame keeps a fixed height and scrolls. Live scenes are widgets instead.
"""

import html
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sandbox.interactive.widget import LiveWidget
    from sandbox.report.html.page import Page
    from sandbox.scene.compile.scene import Scene

MAX_CHARACTERS = 1_500_000
"""Length of one display; a longer page is shown without its replay, so that notebook files stay small."""
TALL, LOW = 560, 380
"""Heights of frames, px, until the page has reported its own."""

FIT_HEIGHT = """
if (!window.sandboxFrames) {
  window.sandboxFrames = true;
  window.addEventListener("message", (event) => {
    const height = event.data && Number(event.data.sandboxHeight);
    if (!(height > 0 && height < 20000)) return;
    for (const frame of document.querySelectorAll("iframe.sandbox-page")) {
      if (frame.contentWindow !== event.source) continue;
      frame.style.height = `${Math.ceil(height) + frame.offsetHeight - frame.clientHeight}px`;
    }
  });
}
"""
"""Sets the height of a frame to what its page reports; one listener serves all frames of a document."""

PageOf = Callable[..., "Page"]

_PAGES = {
    "Scene": ("sandbox.report.html.scene_page", "scene_page", LOW),
    "Trajectory": ("sandbox.report.html.scene_page", "run_page", TALL),
    "Comparison": ("sandbox.report.html.comparison", "comparison_page", TALL),
    "Tradeoff": ("sandbox.report.html.tradeoff", "page_of_tradeoff", TALL),
    "ShotResult": ("sandbox.report.html.shot_pages", "shot_page", TALL),
    "Odds": ("sandbox.report.html.shot_pages", "odds_page", TALL),
}
"""By the name of the class: module and function of its page, and the height of its frame, px."""


def html_of(value: object) -> str:
    """Return a value as HTML.

    Raises:
        TypeError: there is no display for its class.
    """
    name = next((each.__name__ for each in type(value).__mro__ if each.__name__ in _PAGES), None)
    if name is None:
        raise TypeError(f"no display for {type(value).__name__}")
    module, function, height = _PAGES[name]
    page_of: PageOf = getattr(import_module(module), function)
    text = frame(page_of(value), height)
    if len(text) > MAX_CHARACTERS:
        text = frame(page_of(value, **_without_replay(name)), height)
    return text


def _without_replay(name: str) -> dict[str, Any]:
    """Return the arguments that make a page shorter."""
    return {"replayed": False} if name in ("Trajectory", "Comparison", "ShotResult") else {}


def frame(page: "Page", height: int) -> str:
    """Return a page as a frame: its scripts run, but have no access to the page around it.

    Args:
        page: the page.
        height: height until the page has reported its own, px.
    """
    document, title = html.escape(page.html(compact=True)), html.escape(page.title)
    style = f"box-sizing: border-box; width: 100%; height: {height}px; border: 1px solid #8886; border-radius: 6px"
    # the listener comes first, because the page may report its height at once
    return (
        f"<script>{FIT_HEIGHT}</script>"
        f'<iframe srcdoc="{document}" sandbox="allow-scripts" class="sandbox-page" title="{title}" loading="lazy"'
        f' style="{style}"></iframe>'
    )


def live(
    scene: "Scene | str | Path", engine: str | None = None, *, sliders: Sequence[str] | None = None
) -> "LiveWidget":
    """Return a scene as a live widget for notebooks: play, drag bodies, move sliders, change the engine.

    Needs the extra `notebook` (`pip install -e '.[notebook]'`).

    Args:
        scene: the scene, or its name or path.
        engine: name of the engine; default: `exact` for billiards, otherwise `pymunk`.
        sliders: numbers of the scene with a slider, each `KEY` or `KEY=LOW:HIGH`, such as `solver.dt` or
            `ball.*.restitution=0:1`; default: gravity, dt, restitution and friction.

    Raises:
        SceneError: the name or path is not that of a valid scene.
        UnknownEngineError: no engine has that name.
        Refusal: the engine does not support something that the scene needs.
        ValueError: a slider is invalid.
        ImportError: anywidget is not installed.

    Example:
        >>> widget = sandbox.live("bounce", sliders=["ball.ball.restitution=0:1"])
        >>> widget.simulation.engine
        'pymunk'
        >>> widget.close()
    """
    try:
        from sandbox.interactive.widget import LiveWidget
    except ModuleNotFoundError as error:
        if error.name != "anywidget":
            raise
        raise ImportError("sandbox.live needs anywidget: pip install -e '.[notebook]'") from None
    from sandbox.interactive.live_scene import LiveScene

    return LiveWidget(LiveScene(scene, engine, sliders, wall_clock=monotonic))
