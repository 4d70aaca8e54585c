"""The widget of a live scene: messages of its views, without a browser."""

from typing import Any

import pytest

import sandbox
from sandbox.interactive.widget import MAX_VIEWS, LiveWidget
from sandbox.scene.files.load import loads
from tests.interactive.conversation import SCENE


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Replies that the widget sends."""
    replies: list[dict[str, Any]] = []
    monkeypatch.setattr(LiveWidget, "send", lambda self, content, buffers=None: replies.append(content))
    return replies


def receive(widget: LiveWidget, view: str, *inputs: dict[str, Any]) -> None:
    """Let the widget receive a request, as from a front end."""
    widget._handle_custom_msg({"view": view, "inputs": list(inputs)}, [])


def test_views_of_a_widget_show_one_scene(sent) -> None:
    widget = sandbox.live(loads(SCENE), engine="reference", sliders=["solver.dt", "ball.*.restitution"])
    receive(widget, "one", {"type": "open"}, {"type": "step", "count": 3})
    receive(widget, "two", {"type": "open"})
    assert [each["view"] for each in sent] == ["one", "two"]
    first, second = (each["reply"] for each in sent)
    assert first["time"] == second["time"] == widget.simulation.time == pytest.approx(0.03)
    assert second["state"]["engine"] == "reference"
    assert [each["key"] for each in second["state"]["sliders"]] == ["solver.dt", "ball.*.restitution"]
    widget.close()


def test_change_in_one_view_is_shown_in_the_others(sent) -> None:
    widget = sandbox.live(loads(SCENE))
    for view in ("one", "two"):
        receive(widget, view, {"type": "open"})
    sent.clear()
    receive(widget, "one", {"type": "engine", "name": "reference"})
    assert [(each["view"], each["reply"]["state"]["engine"]) for each in sent] == [
        ("one", "reference"),
        ("two", "reference"),
    ]
    widget.close()


def test_invalid_messages_are_answered(sent) -> None:
    widget = sandbox.live(loads(SCENE))
    widget._handle_custom_msg({"view": "one", "inputs": [{"type": "advance", "elapsed": float("nan")}]}, [])
    widget._handle_custom_msg({"inputs": "x"}, [])
    widget._handle_custom_msg({"view": 7, "inputs": {"type": "open"}}, [])
    assert [len(each["reply"]["messages"]) for each in sent] == [1, 1, 1]
    widget.close()


def test_views_that_are_gone_release_their_body(sent) -> None:
    widget = sandbox.live(loads(SCENE))
    grab = {"type": "grab", "body": 0, "grip": [0, 0], "target": [0, 0]}
    receive(widget, "one", {"type": "play", "on": True}, grab)
    assert widget.simulation.pulls
    widget._handle_custom_msg({"view": "one", "inputs": None}, [])
    assert not widget.simulation.pulls
    receive(widget, "two", grab)
    for k in range(MAX_VIEWS):
        receive(widget, f"later {k}", {"type": "open"})
    assert not widget.simulation.pulls
    widget.close()


def test_module_and_style_are_those_of_the_page_and_touch_nothing_else() -> None:
    widget = sandbox.live("bounce")
    module, style = str(widget._esm), str(widget._css)
    assert "export default" in module
    assert "class Renderer" in module
    assert "document.querySelector" not in module  # it draws in its own element only
    assert ":root" not in style
    assert "body {" not in style
    widget.close()
