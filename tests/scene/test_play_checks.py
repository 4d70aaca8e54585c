"""`[play]`: its references are checked, and it does not affect the bodies."""

import re
from typing import Any

import pytest

from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, loads
from sandbox.scene.validate.references import generator_names

PARTS: dict[str, Any] = {
    "ball": [{"name": "a.b", "position": [0, 0], "radius": 1}, {"position": [5, 0], "radius": 1}],
    "grid": [{"origin": [0, 9], "columns": 2, "spacing": [3, 3], "radius": 1}],
    "scatter": [{"name": 'say "hi"', "count": 2, "lower": [20, 20], "upper": [30, 30], "radius": 1}],
    "emitter": [
        {"position": [0, 0], "count": 2, "velocity_min": [0, 0], "velocity_max": [1, 1]},
        {"name": "s", "position": [0, 0], "count": 2, "velocity_min": [0, 0], "velocity_max": [1, 1]},
    ],
}


@pytest.mark.parametrize(
    "play",
    [
        {}, {"arrows": "a.b"}, {"arrows": "ball-2"}, {"arrows": "grid-1-2"}, {"arrows": 'say "hi"-1'},
        {"relaunch": "grid-1"}, {"relaunch": 'say "hi"'}, {"relaunch": "emitter-1"}, {"relaunch": "s"},
        {"show": "overlap"}, {"arrows": "a.b", "arrow_step": 0.1, "relaunch": "s", "show": "overlap"},
    ],
)  # fmt: skip
def test_play_may_refer_to_existing_bodies_and_generators(play: dict[str, Any]) -> None:
    scene = from_document({**PARTS, "play": play})
    assert scene.play.model_dump(exclude_unset=True) == play
    assert scene.bodies.position.tolist() == from_document(PARTS).bodies.position.tolist()


@pytest.mark.parametrize(
    ("play", "path", "words"),
    [
        ({"arrows": "zzz"}, "play.arrows", "no body is named 'zzz'"),
        ({"arrows": "s"}, "play.arrows", "no body"),
        ({"relaunch": "a.b"}, "play.relaunch", "no generator is named 'a.b'"),
        ({"relaunch": "emitter-2"}, "play.relaunch", "no generator"),
        ({"arrow_step": 0}, "play.arrow_step", "greater than 0"),
        ({"show": "all"}, "play.show", "overlap"),
        ({"view": [[0, 1], [1, 1]]}, "play.view", "upper right corner"),
        ({"inset": [[0, 0], [0, 1]]}, "play.inset", "upper right corner"),
        ({"game": "chess"}, "play.game", "'landing'"),
        ({"zzz": 1}, "play.zzz", r"\w"),
        ({"part": [{"name": "a.b", "role": "lamp"}]}, 'play.part."a.b".role', "one of 'ball', 'bumper'"),
        (
            {"part": [{"name": "zzz", "role": "ball"}]},
            "play.part.zzz.name",
            "no body, fixed object or zone is named 'zzz'",
        ),
        ({"part": 2 * [{"name": "a.b", "role": "ball"}]}, 'play.part."a.b".name', "already has a part"),
        ({"marking": [{"colour": "#000000"}]}, "play.marking[0]", "`points`"),
        ({"ground": "sand"}, "play.ground", "'playfield'"),
    ],
)
def test_unknown_reference_or_invalid_value_in_play_is_a_fault(play: dict[str, Any], path: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        from_document({**PARTS, "play": play})
    (fault,) = caught.value.faults
    assert fault.path == path
    assert re.search(words, fault.message)


def test_all_faults_in_play_are_reported_with_their_lines() -> None:
    text = 'title = "t"\n\n[play]\narrows = "a"\nrelaunch = "b"\n'
    with pytest.raises(SceneError) as caught:
        loads(text, "t.toml")
    assert [(fault.line, fault.path) for fault in caught.value.faults] == [(4, "play.arrows"), (5, "play.relaunch")]
    assert all("none" in fault.message for fault in caught.value.faults)


def test_generators_are_named_in_scene_order() -> None:
    assert generator_names(from_document(PARTS)) == ("grid-1", 'say "hi"', "emitter-1", "s")
    assert generator_names(from_document({"title": "t"})) == ()
