"""Warm-up: what playing a scene needs is compiled once, in one wait, and scenes of equal physics share it."""

from pathlib import Path

import pytest

from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.common.kernel import COMPILED
from sandbox.engines.registry import ENGINES
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window import warm_up as module
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.warm_up import warm_up, warm_up_key, warm_ups

pytestmark = [
    pytest.mark.fail_slow(60),  # compiles kernels
    pytest.mark.skipif(not COMPILED, reason="nothing is compiled"),
]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Marks are kept in an empty folder."""
    monkeypatch.setattr(module, "cache_folder", lambda: tmp_path)
    return tmp_path


def scene_of(**more: object) -> Scene:
    ball = {"position": [0.0, 1.0], "radius": 0.5, "restitution": 0.5}
    return from_document({"ball": [ball], "plane": [{"point": [0, 0], "normal": [0, 1]}], **more})


def test_parts_are_named_with_their_total_and_run_once() -> None:
    parts: list[str] = []
    for _ in range(2):
        warm_up(scene_of(world={"gravity": [0.0, -9.81]}), "reference", None, parts.append)
    assert parts == ["part 1 of 2: the engine reference", "part 2 of 2: the pictures"]
    parts.clear()
    warm_up(load(find("8-ball")), "exact", None, parts.append)
    assert [text.partition(":")[0] for text in parts] == [f"part {k} of 3" for k in (1, 2, 3)]


@pytest.mark.parametrize(
    ("more", "is_equal"),
    [
        ({"title": "another"}, True),
        ({"world": {"gravity": [0.0, -1.0], "duration": 3.0}}, True),
        ({"solver": {"dt": 0.001, "substeps": 4}}, True),
        ({"solver": {"integrator": "rk4"}}, False),
        ({"box": [{"position": [3.0, 3.0], "size": [1.0, 1.0]}]}, False),
        ({"ball": [{"position": [k, 5.0], "radius": 0.1, "restitution": 0.5} for k in range(70)]}, False),
    ],
)
def test_scenes_with_the_same_kernels_share_a_warm_up(more: dict[str, object], is_equal: bool) -> None:
    plain, other = scene_of(world={"gravity": [0.0, -9.81]}), scene_of(**{"world": {"gravity": [0.0, -9.81]}, **more})
    keys = [warm_up_key(each, "reference", each.solver) for each in (plain, other)]
    assert (keys[0] == keys[1]) is is_equal
    assert warm_up_key(plain, "exact", plain.solver) != keys[0]


@pytest.mark.parametrize(("engine", "scene"), [("box2d", "8-ball"), ("exact", "cloth")])
def test_scene_that_an_engine_refuses_is_left_to_the_session(engine: str, scene: str, folder: Path) -> None:
    refused = load(find(scene))
    assert ENGINES[engine].missing(refused, refused.solver)
    warm_up(refused, engine, None, pytest.fail)
    assert list(folder.iterdir()) == []


def test_every_shipped_scene_is_among_the_warm_ups() -> None:
    entries = warm_ups()
    assert {engine for _, engine in entries.values()} == set(ENGINES)
    assert all(warm_up_key(scene, engine, scene.solver) == key for key, (scene, engine) in entries.items())


@pytest.mark.parametrize("name", ["bounce", "9-ball"])
def test_everything_for_opening_a_scene_is_one_job(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each job that compiles is a wait of its own."""
    state = AppState()
    window = App(state, size=(640, 480), folder=tmp_path, say=lambda _: None)
    jobs, parts, compute = [0], [list[str]()], state.compute

    def counted(job):  # type: ignore[no-untyped-def]
        parts[0] = []
        jobs[0] += 1
        return compute(job)

    monkeypatch.setattr(state, "compute", counted)
    monkeypatch.setattr(state, "on_part", lambda text: parts[0].append(text))
    assert state.open(find(name))
    before = jobs[0]
    assert before <= 2  # one for the session; one for the controls of a game
    spent = COMPILE_CLOCK.seconds
    for _ in range(5):
        window.run_frame(0.05)
    assert COMPILE_CLOCK.seconds == spent
    parts[0] = []
    state.switch_engine("reference")
    assert parts[0][0].startswith("part 1 of")
    spent = COMPILE_CLOCK.seconds
    state.restart()
    for _ in range(5):
        window.run_frame(0.05)
    state.step_back()
    window.run_frame(1.0)
    assert COMPILE_CLOCK.seconds == spent
    window.close()
