"""Live check of the editor: elements, remedies, engines and demands of a scene, and the thread."""

import threading
import time
from collections.abc import Callable

import pytest

from sandbox.engines.registry import ENGINES
from sandbox.scene.compile.scene import Scene
from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import ElementKey
from sandbox.scene.files.load import loads
from sandbox.window.editor import live_check
from sandbox.window.editor.live_check import CheckResult, LiveCheck, SceneMark, check_scene

GROUND = '[[plane]]\nname = "ground"\npoint = [0, 0]\nnormal = [0, 1]\n'


def boxes(count: int, size: float = 1.0, mass: str = "") -> str:
    return "".join(
        f'[[box]]\nname = "x{k}"\nposition = [0, {(k + 0.5) * size}]\nsize = [{size}, {size}]\nfriction = 0.5\n{mass}'
        for k in range(count)
    )


def chain(links: int, last_mass: float = 1.0) -> str:
    text = ""
    for k in range(links):
        mass = last_mass if k == links - 1 else 1.0
        text += f'[[ball]]\nname = "c{k}"\nposition = [{k + 1}, 0]\nradius = 0.1\nmass = {mass}\ncollides = "none"\n'
        ends = f'["c{k - 1}", "c{k}"]\nanchors = [[0, 0], [0, 0]]' if k else '["c0"]\nanchors = [[0, 0], [0, 0]]'
        text += f'[[joint]]\nname = "r{k}"\nkind = "rod"\nbetween = {ends}\n'
    return text


BULLET = (
    '[solver]\ndt = 0.01\n[[wall]]\nname = "w"\npoints = [[3, -5], [3, 5]]\nthickness = 0.05\n'
    '[[ball]]\nname = "b"\nposition = [0, 0]\nvelocity = [30, 0]\nradius = 0.05\n'
)
SPRING = (
    '[solver]\ndt = 0.01\n{solver}[[ball]]\nname = "b"\nposition = [1, 0]\nradius = 0.1\nmass = 1\n'
    '[[joint]]\nname = "s"\nkind = "spring"\nbetween = ["b"]\nanchors = [[0, 0], [0, 0]]\n'
    "stiffness = {stiffness}\ndamping = {damping}\nrest_length = 1\n"
)
ZONE = (
    '[[ball]]\nname = "b"\nposition = [0, 0]\nvelocity = [30, 0]\nradius = 0.05\n'
    '[[zone]]\nname = "gate"\npoints = [[3, -5], [3, 5]]\nthickness = 0.1\n'
)
KICK = (
    "[world]\ngravity = [0, -9.81]\n[solver]\ndt = 0.01\n"
    '[[wall]]\nname = "w"\npoints = [[-5, 0], [5, 0]]\nthickness = 0.5\nkick = {{speed = 2, threshold = {threshold}}}\n'
    '[[ball]]\nname = "b"\nposition = [0, 2]\nradius = 0.3\n'
)
ROD = (
    '[[ball]]\nname = "b"\nposition = [2, 0]\nradius = 0.1\n'
    '[[joint]]\nname = "r"\nkind = "rod"\nbetween = ["b"]\nanchors = {anchors}\n{more}'
)
TOWER = "[world]\ngravity = [0, -9.81]\n" + "[solver]\ndt = 0.016\niterations = 10\n"
B, W, R = ElementKey("ball", 0), ElementKey("wall", 0), ElementKey("joint", 0)

CASES: dict[str, tuple[str, str, tuple[ElementKey, ...], tuple[str, ...]]] = {
    "wall": (BULLET, "tunnelling", (B, W), ("dt 0.0025 s", "4 substeps", "thickness 0.5 m")),
    "balls": (
        '[solver]\ndt = 0.01\n[[ball]]\nname = "a"\nposition = [0, 0]\nvelocity = [30, 0]\nradius = 0.05\n'
        '[[ball]]\nname = "b"\nposition = [3, 0]\nradius = 0.05\n',
        "tunnelling",
        (B,),
        ("dt 0.00333 s", "3 substeps"),
    ),
    "depth": (
        "[world]\ngravity = [0, -9.81]\n[solver]\ndt = 0.01\n"
        + GROUND
        + '[[ball]]\nname = "b"\nposition = [0, 20]\nradius = 0.05\n',
        "depth",
        (B, ElementKey("plane", 0)),
        ("dt", "substeps"),
    ),
    "zone": (ZONE, "entry", (B, ElementKey("zone", 0)), ("dt 0.00333 s", "3 substeps", "thickness 0.3 m")),
    "overlap with the ground": (
        GROUND + '[[ball]]\nname = "b"\nposition = [0, 0.4]\nradius = 0.5\n',
        "overlap",
        (B, ElementKey("plane", 0)),
        ("move 'b' by 0.1 m",),
    ),
    "overlap of balls": (
        '[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 0.5\n'
        '[[ball]]\nname = "b"\nposition = [0.5, 0.7]\nradius = 0.5\n'
        "[[grid]]\norigin = [9, 9]\ncolumns = 13\nrows = 13\nspacing = [1, 1]\nradius = 0.1\n",
        "overlap",
        (B, ElementKey("ball", 1)),
        ("move 'a' by 0.14 m",),
    ),
    "overlap of boxes": (
        '[[box]]\nname = "a"\nposition = [0, 0]\nsize = [1, 1]\n'
        '[[box]]\nname = "b"\nposition = [0.8, 0]\nsize = [1, 1]\n',
        "overlap",
        (ElementKey("box", 0), ElementKey("box", 1)),
        (),
    ),
    "iterations": (
        "[solver]\niterations = 1\n[[ball]]\nposition = [0, 0]\nradius = 0.5\nrestitution = 0.9\nvelocity = [1, 0]\n"
        "[[ball]]\nposition = [3, 0]\nradius = 0.5\nrestitution = 0.9\n",
        "iterations",
        (),
        ("3 iterations",),
    ),
    "rounding": (
        '[[post]]\nposition = [0, 0]\nradius = 1\n[[ball]]\nname = "b"\nposition = [1e14, 0]\nradius = 0.5\n',
        "rounding",
        (B,),
        (),
    ),
    "kick": (
        KICK.format(threshold=0.05),
        "kick_threshold",
        (W,),
        ("dt 0.00509 s", "2 substeps", "threshold 0.0982 m/s"),
    ),
    "joint error": (
        ROD.format(anchors="[[0, 0], [0, 0]]", more="length = 1.5\n"),
        "joint_start",
        (R,),
        ("length as it starts",),
    ),
    "anchors": (
        ROD.format(anchors="[[5, 0], [0.01, 0]]", more=""),
        "anchors",
        (R, B),
        ("swap the anchors",),
    ),
    "spring": (SPRING.format(solver="", stiffness=4e4, damping=0), "spring", (R,), ("dt 0.00749 s", "2 substeps")),
    "spring at a round number": (
        SPRING.format(solver="", stiffness=9e4, damping=0),
        "spring",
        (R,),
        ("dt 0.00499 s", "3 substeps"),
    ),
    "explicit Euler": (
        SPRING.format(solver='integrator = "explicit_euler"\n', stiffness=1e3, damping=0),
        "spring",
        (R,),
        ("default integrator",),
    ),
    "damper": (SPRING.format(solver="", stiffness=1, damping=400), "spring", (R,), ("dt", "substeps")),
    "orbit": (
        "[solver]\ndt = 0.05\n[[attraction]]\ntoward = [0, 0]\nstrength = 1\n"
        '[[ball]]\nname = "b"\nposition = [1, 0]\nvelocity = [0, 0.3]\nradius = 0.01\ncollides = "none"\n',
        "orbit",
        (B,),
        ("dt", "substeps"),
    ),
    "chain": (
        "[world]\ngravity = [0, -9.81]\n[solver]\ndt = 0.016\niterations = 10\n" + chain(20),
        "chain",
        (R,),
        ("iterations", "dt", "substeps"),
    ),
    "stretch": (
        '[world]\ngravity = [0, -9.81]\n[solver]\ndt = 0.0167\niterations = 2\njoints = "relaxation"\n' + chain(20),
        "chain",
        (R,),
        ("iterations", "dt", "substeps"),
    ),
    "load of a chain": (
        "[world]\ngravity = [0, -9.81]\n[solver]\ndt = 0.016\niterations = 10\n" + chain(3, 100.0),
        "mass_ratio",
        (ElementKey("joint", 2),),
        ("iterations", "dt", "substeps"),
    ),
    "tower": (TOWER + GROUND + boxes(12), "stack", (ElementKey("box", 0),), ("iterations", "dt", "substeps")),
    "heavy on light": (
        TOWER
        + GROUND
        + '[[box]]\nname = "light"\nposition = [0, 0.5]\nsize = [1, 1]\nmass = 1\n'
        + '[[box]]\nname = "heavy"\nposition = [0, 1.5]\nsize = [1, 1]\nmass = 100\n',
        "mass_ratio",
        (ElementKey("box", 1), ElementKey("box", 0)),
        ("iterations", "dt", "substeps"),
    ),
    "events": (
        "[world]\ngravity = [0, -9.81]\n"
        + GROUND
        + "".join(
            f"[[ball]]\nposition = [{1.2 * (k % 2)}, {0.5 + 1.1 * k}]\nradius = 0.5\nfriction = 0.4\n" for k in range(9)
        ),
        "event_rate",
        (),
        (),
    ),
    "duration": (
        "[world]\nduration = 0.1\n[solver]\ndt = 0.5\n[[ball]]\nposition = [0, 0]\nradius = 0.5\n",
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
    text = "[world]\ngravity = [0, -9.81]\n" + GROUND + '[[ball]]\nname = "b"\nposition = [0, 1]\nradius = 0.5\n'
    found = check_scene(loads(text))
    assert found.marks == ()
    assert found.note == ""


def test_remedies_are_dropped_where_they_do_not_apply() -> None:
    fast = BULLET.replace("[30, 0]", "[300_000, 0]")  # 3000 m in a substep
    labels = [remedy.label for remedy in mark_of(fast, "tunnelling").remedies]
    assert labels == ["dt 2.5e-07 s"]  # a substep for each would be too many, and the wall thicker than long
    near = BULLET.replace("position = [0, 0]", "position = [2.8, 0]")
    labels = [remedy.label for remedy in mark_of(near, "tunnelling").remedies]
    assert labels == ["dt 0.0025 s", "4 substeps"]  # a thicker wall would overlap the ball
    tied = CASES["overlap with the ground"][0] + '[[thrust]]\nbody = "b"\nforce = [1, 0]\n'
    assert mark_of(tied, "overlap").remedies == ()
    beside = CASES["overlap with the ground"][0] + '[[ball]]\nname = "c"\nposition = [0.6, 1.24]\nradius = 0.5\n'
    assert mark_of(beside, "overlap").remedies == ()  # there is no room for it


def test_elements_of_generators_and_default_names_are_found() -> None:
    text = (
        BULLET.replace('name = "w"\n', "")
        + "[[grid]]\norigin = [-9, 1]\ncolumns = 2\nrows = 2\nspacing = [1, 1]\nradius = 0.01\n"
    )
    text += "velocity = [40, 0]\n"
    found = {mark.elements for mark in check_scene(loads(text)).marks if mark.kind == "tunnelling"}
    assert (ElementKey("grid", 0), W) in found


def test_demands_and_engines_of_a_scene() -> None:
    found = check_scene(loads(GROUND + "[world]\ngravity = [0, -9.81]\n" + boxes(1)))
    assert "friction" in found.demands
    assert "polygons" in found.demands
    assert "springs" not in found.demands
    lacks = dict(found.engines)
    assert list(lacks) == list(ENGINES)
    assert lacks["pymunk"] == ()
    assert lacks["exact"]


def test_large_scene_is_not_checked_which_a_note_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_check, "MAX_CHECKED_BODIES", 1)
    found = check_scene(loads(BULLET + "[[ball]]\nposition = [0, 9]\nradius = 0.5\n"))
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
