"""Live scenes in notebooks, as a widget of anywidget: Jupyter, marimo, VS Code."""

import json
from typing import Any

import anywidget

from sandbox.engines.switching import SwitchableSimulation
from sandbox.interactive import front_end
from sandbox.interactive.live_scene import LiveScene
from sandbox.interactive.viewer import Viewer

MAX_VIEWS = 20
"""Views of a widget that are remembered; older ones are those of outputs that are gone."""


class LiveWidget(anywidget.AnyWidget):
    """A live scene in a notebook. It never blocks the kernel: it computes only to answer its views.

    All views of a widget show the same scene. `widget.simulation` is the running simulation, which code in other cells
    may read. Real time passes while a cell runs, but the scene does not.
    """

    _esm = front_end.module()
    _css = front_end.style()

    def __init__(self, live: LiveScene) -> None:
        """Make a widget of a live scene, which the widget closes."""
        self._live = live  # before anything can fail: `close` is also called by the garbage collector
        self._viewers: dict[str, Viewer] = {}
        super().__init__()
        self.on_msg(self._receive)

    @property
    def simulation(self) -> SwitchableSimulation:
        """The running simulation; another one after a reset."""
        return self._live.simulation

    def _receive(self, _widget: Any, content: Any, _buffers: Any) -> None:
        """Answer a request of a view: `view`, its name, and `inputs`, or null when it is gone."""
        view, inputs = str(content.get("view"))[:80], content.get("inputs")
        if inputs is None:
            self._forget(view)
            return
        viewer = self._viewers.pop(view, None) or Viewer(self._live)
        self._viewers[view] = viewer  # the last one used
        if len(self._viewers) > MAX_VIEWS:
            self._forget(next(iter(self._viewers)))
        before = self._live.revision
        self.send({"view": view, "reply": viewer.handle(json.dumps(inputs))})
        if self._live.revision != before:
            for other in self._viewers:
                if other != view:
                    self.send({"view": other, "reply": self._viewers[other].handle("[]")})

    def _forget(self, view: str) -> None:
        viewer = self._viewers.pop(view, None)
        if viewer is not None:
            viewer.close()

    def close(self) -> None:
        """Remove the widget, and release the resources of the engines."""
        super().close()
        self._live.close()
