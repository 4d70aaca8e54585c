"""Live check of the editor: elements, remedies, engines and demands of a scene, and the thread."""

import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from sandbox.engines.registry import ENGINES
from sandbox.scene.compile.scene import Scene
from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import ElementKey
from sandbox.scene.files.load import loads
from sandbox.window.editor import live_check
from sandbox.window.editor.live_check import CheckResult, LiveCheck, SceneMark, check_scene
from tests.toml_text import toml

FALL, DT = toml("world", gravity=[0, -9.81]), toml("solver", dt=0.01)
GROUND = toml("plane", name="ground", point=[0, 0], normal=[0, 1])


def ball(name: str, x: float, y: float = 0.0, radius: float = 0.5, **more: Any) -> str:
    return toml("ball", name=name, position=[x, y], radius=radius, **more)


def box(name: str, x: float, y: float, **more: Any) -> str:
    return toml("box", name=name, position=[x, y], size=[1, 1], **more)


def boxes(count: int) -> str:
    return "".join(box(f"x{k}", 0, k + 0.5, friction=0.5) for k in range(count))


def joint(kind: str, *between: str, anchors: Any = ((0, 0), (0, 0)), **more: Any) -> str:
    return toml("joint", kind=kind, between=between, anchors=anchors, **more)


def chain(links: int, last_mass: float = 1.0) -> str:
    masses = [1.0] * (links - 1) + [last_mass]
    text = "".join(ball(f"c{k}", k + 1, 0, 0.1, mass=mass, collides="none") for k, mass in enumerate(masses))
    return text + "".join(joint("rod", *(f"c{j}" for j in (k - 1, k) if j >= 0)) for k in range(links))


BULLET = (
    DT
    + toml("wall", name="w", points=[[3, -5], [3, 5]], thickness=0.05)
    + toml("ball", name="b", position=[0, 0], velocity=[30, 0], radius=0.05)
)


def spring(stiffness: float, damping: float, **solver: str) -> str:
    ends = joint("spring", "b", stiffness=stiffness, damping=damping, rest_length=1)
    return toml("solver", dt=0.01, **solver) + ball("b", 1, 0, 0.1, mass=1) + ends


KICK = FALL + DT + toml("wall", points=[[-5, 0], [5, 0]], thickness=0.5, kick={"speed": 2, "threshold": 0.05})
ZONE = toml("zone", name="gate", points=[[3, -5], [3, 5]], thickness=0.1)
SLACK = FALL + toml("solver", dt=0.016, iterations=10)
RELAXED = FALL + toml("solver", dt=0.0167, iterations=2, joints="relaxation")
ON_GROUND = GROUND + ball("b", 0, 0.4)
PILE = "".join(toml("ball", position=[1.2 * (k % 2), 0.5 + 1.1 * k], radius=0.5, friction=0.4) for k in range(9))
B, W, R, G = (ElementKey(kind, 0) for kind in ("ball", "wall", "joint", "plane"))
STEPS = ("dt", "substeps")
PASSES = ("iterations", *STEPS)

CASES: dict[str, tuple[str, str, tuple[ElementKey, ...], tuple[str, ...]]] = {
    "wall": (BULLET, "tunnelling", (B, W), ("dt 0.0025 s", "4 substeps", "thickness 0.5 m")),
    "balls": (
        DT + ball("a", 0, 0, 0.05, velocity=[30, 0]) + ball("b", 3, 0, 0.05),
        "tunnelling",
        (B,),
        ("dt 0.00333 s", "3 substeps"),
    ),
    "depth": (FALL + DT + GROUND + ball("b", 0, 20, 0.05), "depth", (B, G), STEPS),
    "zone": (
        ball("b", 0, 0, 0.05, velocity=[30, 0]) + ZONE,
        "entry",
        (B, ElementKey("zone", 0)),
        ("dt 0.00333 s", "3 substeps", "thickness 0.3 m"),
    ),
    "overlap with the ground": (ON_GROUND, "overlap", (B, G), ("move 'b' by 0.1 m",)),
    "overlap of balls": (
        ball("a", 0)
        + ball("b", 0.5, 0.7)
        + toml("grid", origin=[9, 9], columns=13, rows=13, spacing=[1, 1], radius=0.1),
        "overlap",
        (B, ElementKey("ball", 1)),
        ("move 'a' by 0.14 m",),
    ),
    "overlap of boxes": (
        box("a", 0, 0) + box("b", 0.8, 0),
        "overlap",
        (ElementKey("box", 0), ElementKey("box", 1)),
        (),
    ),
    "iterations": (
        toml("solver", iterations=1) + ball("a", 0, restitution=0.9, velocity=[1, 0]) + ball("b", 3, restitution=0.9),
        "iterations",
        (),
        ("3 iterations",),
    ),
    "rounding": (toml("post", position=[0, 0], radius=1) + ball("b", 1e14), "rounding", (B,), ()),
    "kick": (
        KICK + ball("b", 0, 2, 0.3),
        "kick_threshold",
        (W,),
        ("dt 0.00509 s", "2 substeps", "threshold 0.0982 m/s"),
    ),
    "joint error": (ball("b", 2) + joint("rod", "b", length=1.5), "joint_start", (R,), ("length as it starts",)),
    "anchors": (
        ball("b", 2, 0, 0.1) + joint("rod", "b", anchors=((5, 0), (0.01, 0))),
        "anchors",
        (R, B),
        ("swap the anchors",),
    ),
    "spring": (spring(4e4, 0), "spring", (R,), ("dt 0.00749 s", "2 substeps")),
    "spring at a round number": (spring(9e4, 0), "spring", (R,), ("dt 0.00499 s", "3 substeps")),
    "explicit Euler": (spring(1e3, 0, integrator="explicit_euler"), "spring", (R,), ("default integrator",)),
    "damper": (spring(1, 400), "spring", (R,), STEPS),
    "orbit": (
        toml("solver", dt=0.05)
        + toml("attraction", toward=[0, 0], strength=1)
        + ball("b", 1, 0, 0.01, velocity=[0, 0.3], collides="none"),
        "orbit",
        (B,),
        STEPS,
    ),
    "chain": (SLACK + chain(20), "chain", (R,), PASSES),
    "stretch": (RELAXED + chain(20), "chain", (R,), PASSES),
    "load of a chain": (SLACK + chain(3, 100.0), "mass_ratio", (ElementKey("joint", 2),), PASSES),
    "tower": (SLACK + GROUND + boxes(16), "stack", (ElementKey("box", 0),), PASSES),
    "heavy on light": (
        SLACK + GROUND + box("light", 0, 0.5, mass=1) + box("heavy", 0, 1.5, mass=100),
        "mass_ratio",
        (ElementKey("box", 1), ElementKey("box", 0)),
        PASSES,
    ),
    "events": (FALL + GROUND + PILE, "event_rate", (), ()),
    "duration": (
        toml("world", duration=0.1) + toml("solver", dt=0.5) + ball("b", 0),
        "duration",
        (),
        ("dt 0.1 s", "duration 0.5 s"),
    ),
}


def mark_of(text: str, kind: str) -> SceneMark:
    (found,) = [mark for mark in check_scene(loads(text)).marks if mark.kind == kind]
    return found


@pytest.mark.parametrize("case", CASES)
def test_mark_names_its_elements_and_its_remedies(case: str) -> None:
    text, kind, elements, labels = CASES[case]
    mark = mark_of(text, kind)
    assert mark.elements == elements
    assert len(mark.remedies) == len(labels), mark.remedies
    for remedy, label in zip(mark.remedies, labels, strict=True):
        assert label in remedy.label


@pytest.mark.parametrize("case", [case for case in CASES if CASES[case][3]])
def test_every_remedy_removes_the_diagnostic_and_adds_none(case: str) -> None:
    text, kind, _, _ = CASES[case]
    before = {each.kind for each in check_scene(loads(text)).marks}
    for remedy in mark_of(text, kind).remedies:
        draft = SceneDraft(text)
        assert draft.change(remedy.changes, remedy.label)
        after = {each.kind for each in check_scene(draft.scene).marks}
        assert after <= before - {kind}, (remedy, after)


def test_harmless_scene_has_no_marks() -> None:
    found = check_scene(loads(FALL + GROUND + ball("b", 0, 1)))
    assert found.marks == ()
    assert found.note == ""


def test_remedies_are_dropped_where_they_do_not_apply() -> None:
    fast = BULLET.replace("[30, 0]", "[300_000, 0]")  # 3000 m in a substep
    labels = [remedy.label for remedy in mark_of(fast, "tunnelling").remedies]
    assert labels == ["dt 2.5e-07 s"]  # a substep for each would be too many, and the wall thicker than long
    near = BULLET.replace("position = [0, 0]", "position = [2.8, 0]")
    labels = [remedy.label for remedy in mark_of(near, "tunnelling").remedies]
    assert labels == ["dt 0.0025 s", "4 substeps"]  # a thicker wall would overlap the ball
    tied = ON_GROUND + toml("thrust", body="b", force=[1, 0])
    assert mark_of(tied, "overlap").remedies == ()
    assert mark_of(ON_GROUND + ball("c", 0.6, 1.24), "overlap").remedies == ()  # there is no room for it


def test_elements_of_generators_and_default_names_are_found() -> None:
    grid = {"origin": [-9, 1], "columns": 2, "rows": 2, "spacing": [1, 1], "radius": 0.01, "velocity": [40, 0]}
    text = BULLET.replace('name = "w"\n', "") + toml("grid", **grid)
    found = {mark.elements for mark in check_scene(loads(text)).marks if mark.kind == "tunnelling"}
    assert (ElementKey("grid", 0), W) in found


def test_demands_and_engines_of_a_scene() -> None:
    found = check_scene(loads(GROUND + FALL + boxes(1)))
    assert "friction" in found.demands
    assert "polygons" in found.demands
    assert "springs" not in found.demands
    lacks = dict(found.engines)
    assert list(lacks) == list(ENGINES)
    assert lacks["pymunk"] == ()
    assert lacks["exact"]


def test_large_scene_is_not_checked_which_a_note_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_check, "MAX_CHECKED_BODIES", 1)
    found = check_scene(loads(BULLET + ball("c", 0, 9)))
    assert found.marks == ()
    assert "2 bodies" in found.note
    assert found.engines


# --- The thread ------------------------------------------------------------------------------------------------------


def wait_until(is_so: Callable[[], bool]) -> None:
    end = time.monotonic() + 20.0
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.005)


def is_running() -> bool:
    return any(thread.name == "sandbox check" for thread in threading.enumerate())


def scene(number: int) -> Scene:
    return loads(f'title = "{number}"\n[[ball]]\nposition = [0, 0]\nradius = 1\n')


def noting(checked: list[str | None]) -> Callable[[Scene], CheckResult]:
    """Return a check that notes the titles of its scenes, and gives them as the note of its result."""

    def check(each: Scene) -> CheckResult:
        checked.append(each.title)
        return CheckResult(note=each.title or "")

    return check


def test_only_the_latest_scene_is_checked_a_moment_after_the_last_change() -> None:
    checked: list[str | None] = []
    live = LiveCheck(noting(checked), delay=0.2)
    assert live.result is None
    assert not live.is_current
    scenes = [scene(number) for number in range(5)]
    for each in scenes:
        live.submit(each)
        live.submit(each)
    wait_until(lambda: live.is_current)
    assert checked == ["4"]
    assert live.result == CheckResult(note="4")
    live.submit(scenes[4])
    assert live.is_current
    live.submit(scenes[0])
    assert not live.is_current
    assert live.result == CheckResult(note="4")  # until the new one is there
    wait_until(lambda: live.is_current)
    assert live.result == CheckResult(note="0")
    live.close()
    wait_until(lambda: not is_running())


def test_result_of_a_scene_that_changed_meanwhile_is_followed_by_another() -> None:
    begun, proceed = threading.Event(), threading.Event()

    def check(each: Scene) -> CheckResult:
        begun.set()
        proceed.wait(20.0)
        return CheckResult(note=each.title or "")

    live = LiveCheck(check, delay=0.0)
    live.submit(scene(1))
    assert begun.wait(20.0)
    live.submit(scene(2))
    proceed.set()
    wait_until(lambda: live.is_current)
    assert live.result == CheckResult(note="2")
    live.close()
    wait_until(lambda: not is_running())


def test_exception_becomes_a_mark_and_the_thread_goes_on() -> None:
    def check(each: Scene) -> CheckResult:
        if each.title == "1":
            raise ZeroDivisionError("by zero")
        return CheckResult(note="fine")

    live = LiveCheck(check, delay=0.0)
    live.submit(scene(1))
    wait_until(lambda: live.is_current)
    assert live.result is not None
    (mark,) = live.result.marks
    assert "ZeroDivisionError: by zero" in mark.message
    live.submit(scene(2))
    wait_until(lambda: live.is_current)
    assert live.result == CheckResult(note="fine")
    live.close()
    wait_until(lambda: not is_running())


def test_close_ends_the_thread_and_later_scenes_are_ignored() -> None:
    live = LiveCheck(delay=0.0)
    live.close()
    live.submit(scene(1))
    assert not is_running()
    live = LiveCheck(delay=0.0)
    live.submit(scene(1))
    wait_until(lambda: live.is_current)
    live.close()
    wait_until(lambda: not is_running())
    live.submit(scene(2))
    assert live.result == check_scene(scene(1))
