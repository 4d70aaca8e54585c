"""Reading and writing scene files: every input gives a Scene or a SceneError."""

import random
import sys
import tomllib
from pathlib import Path
from types import FrameType
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import sandbox
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import dumps, from_document, load, loads
from tests import strategies

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

BALL = "[[ball]]\nposition = [0, 0]\nradius = 1\n"
KEYS = sorted(
    {field.alias or name for name, field in Scene.model_fields.items()} | {"x", "", "name", "radius", "count"}
)


def check_faults(error: SceneError, file: str, lines: int) -> None:
    """Check the invariants of every fault."""
    assert error.faults
    assert str(error) == "\n".join(map(str, error.faults))
    for fault in error.faults:
        assert fault.file == file
        assert fault.message
        assert fault.line is None or 1 <= fault.line <= lines
        assert len(str(fault).splitlines()) == 1


def assert_scene_or_scene_error(text: str) -> None:
    try:
        assert isinstance(loads(text, "f.toml"), Scene)
    except SceneError as error:
        check_faults(error, "f.toml", text.count("\n") + 1)


@given(st.text())
@example("\ufeff" + BALL)
@example("a = 1" + "0" * 5000)
@example("a = 0x1" + "0" * 5000)
@example("a = " + "[" * 100_000)
@example("a = " + "[" * 300 + "]" * 300)
@example("a" + ".a" * 100_000 + " = 1")
@example("a" + ".a" * 80 + " = 1")
@example("x = {" + "a = {" * 5000)
@example('"a\\nb" = 1')
@example("[[ball]]\n'' = 1\n\"\\u001b[31m\" = 2")
@example("ball = [[]]")
@example("ball = [[[1]], 2]")
@example("[ball.0]\nradius = 1")
@example("[[ball]]\n[ball.position]\nx = 1")
@example("[[world.bounds]]\n")
def test_any_text_gives_a_scene_or_a_scene_error(text: str) -> None:
    assert_scene_or_scene_error(text)


@given(st.dictionaries(st.sampled_from(KEYS), strategies.junk()))
@example({"ball": [{"position": [0, 0], "radius": 10**5000}]})
@example({"title": "\ud800"})
@example({"\ud800": 1})
@example({"balls": [{"raduis": 1}]})
@example({"material": [{"name": "a", "frction": 1}], "materials": [{"name": 1}]})
def test_any_document_gives_a_scene_or_a_scene_error(document: dict[str, Any]) -> None:
    try:
        assert isinstance(from_document(document, "f"), Scene)
    except SceneError as error:
        check_faults(error, "f", 0)


@given(strategies.documents(), strategies.junk(), st.randoms(use_true_random=False))
def test_any_value_anywhere_gives_a_scene_or_a_scene_error(document: Any, value: Any, chance: random.Random) -> None:
    node: Any = document
    while True:
        key = chance.choice(list(node) if isinstance(node, dict) else range(len(node)))
        if not isinstance(node[key], dict | list) or not node[key] or chance.random() < 0.2:
            break
        node = node[key]
    node[key] = value
    try:
        assert isinstance(from_document(document, "f"), Scene)
    except SceneError as error:
        check_faults(error, "f", 0)


@given(strategies.scenes())
def test_scene_round_trips_through_toml(scene: Scene) -> None:
    text = dumps(scene)
    again = loads(text)
    assert again == scene
    assert dumps(again) == text
    assert from_document(to_document(scene)) == scene


@given(strategies.rendered())
def test_scene_does_not_depend_on_the_layout_of_the_text(drawn):
    document, rendered = drawn
    assert tomllib.loads(rendered.text.replace("\r\n", "\n")) == document
    assert loads(rendered.text) == from_document(document)


@given(st.text(max_size=200), st.text(max_size=200))
def test_title_and_about_of_any_text_round_trip(title: str, about: str) -> None:
    scene = from_document({"title": title, "about": about})
    assert loads(dumps(scene)) == scene


def test_scene_is_read_from_a_file_with_bom_and_crlf(tmp_path: Path) -> None:
    path = tmp_path / "a name with spaces.toml"
    path.write_bytes(b"\xef\xbb\xbf" + f'about = """a\nb"""\n{BALL}'.replace("\n", "\r\n").encode())
    scene = load(path)
    assert scene.balls == loads(BALL).balls
    assert scene.about == "a\nb"
    path.write_bytes(b"\xef\xbb\xbf" + f"{BALL}raduis = 1\n".replace("\n", "\r\n").encode())
    with pytest.raises(SceneError) as caught:
        load(path)
    assert [(fault.line, fault.path) for fault in caught.value.faults] == [(4, "ball[0].raduis")]


@pytest.mark.parametrize("text", ["", "\n", "   \n\t\n", "# only a comment", "\r\n\r\n", "# a comment\n" * 420_000])
def test_file_without_content_is_a_fault(text: str) -> None:
    with pytest.raises(SceneError, match="empty") as caught:
        loads(text, "e.toml")
    assert [(fault.file, fault.line) for fault in caught.value.faults] == [("e.toml", 1)]


@pytest.mark.parametrize(("text", "line"), [("a = 1e", 1), ("a = 1 b", 1), ("x", 1), ("\n= 1", 2), ('a = "\\q"', 1)])
def test_text_that_is_not_toml_is_one_fault_with_its_line(text: str, line: int) -> None:
    with pytest.raises(SceneError, match="not TOML") as caught:
        loads(text)
    assert [fault.line for fault in caught.value.faults] == [line]


def test_file_that_cannot_be_read_is_a_fault(tmp_path: Path) -> None:
    foreign = [tmp_path / f"{k}.toml" for k in range(3)]
    for path, content in zip(foreign, (BALL.encode("utf-16"), b"title = '\xe9'", bytes(range(256)) * 100), strict=True):
        path.write_bytes(content)
    for path in (*foreign, tmp_path / "none.toml", tmp_path, f"{tmp_path}/a\0b.toml", tmp_path / ("x" * 5000), ""):
        with pytest.raises(SceneError) as caught:
            load(path)
        assert [fault.file for fault in caught.value.faults] == [str(path)]


def test_file_beyond_the_size_limit_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "huge.toml"
    with path.open("wb") as stream:
        stream.truncate(2**40)  # sparse: takes no disk space
    with pytest.raises(SceneError, match="SANDBOX_MAX_FILE_SIZE=1024GiB to allow it"):
        load(path)


def test_many_faults_are_all_reported_with_their_lines() -> None:
    comments = 420_000  # megabytes
    with pytest.raises(SceneError) as caught:
        loads("# a comment\n" * comments + "[[ball]]\nposition = [0, 0]\nraduis = 1\n" * 2000)
    reported = {(fault.line, fault.path) for fault in caught.value.faults}
    assert reported == {
        (comments + 3 * k + line, f"ball[{k}].{key}")
        for k in range(2000)
        for line, key in ((3, "raduis"), (1, "radius"))
    }


def test_faults_are_sorted_by_line() -> None:
    text = f"{BALL}raduis = 1\n[world]\nseed = -1\n[[plane]]\npoint = [0, 0]\nnormal = [0, 0]\n[solver]\ndt = 0\n"
    with pytest.raises(SceneError) as caught:
        loads(text)
    assert [fault.line for fault in caught.value.faults] == [4, 6, 9, 11]


def test_override_changes_the_scene() -> None:
    text = (
        f"{BALL}mass = -1\nname = 'cue'\n"  # an override can correct a fault, and a later one replaces an earlier one
    )
    overrides = ["ball.cue.velocity=[1,0]", "ball.cue.mass=2", "solver.dt=0.5", "solver.dt=0.25", ("world.seed", 7)]
    scene = loads(text, overrides=overrides)
    assert (scene.balls[0].velocity, scene.balls[0].mass) == ((1.0, 0.0), 2.0)
    assert (scene.solver.dt, scene.world.seed) == (0.25, 7)


def test_fault_of_an_override_is_marked_and_has_no_line() -> None:
    with pytest.raises(SceneError) as caught:
        loads(f"{BALL}[solver]\ndt = 0.1\n", "s.toml", ["solver.dt=20", "ball.0.mass=-1"])
    assert [(fault.line, fault.path) for fault in caught.value.faults] == [
        (None, "solver.dt (set)"),
        (None, "ball[0].mass (set)"),
    ]


def test_overrides_with_an_unknown_path_are_all_reported() -> None:
    overrides = [
        "solver.dt",
        "=1",
        "nowhere.x.y=1",
        "ball.none.mass=1",
        "ball.9.mass=1",
        "solver.dt.x=1",
        "title.x=1",
        "",
    ]
    with pytest.raises(SceneError) as caught:
        loads(f"title = 't'\n{BALL}[solver]\ndt = 0.1", overrides=[*overrides, "ball.0.mass=2"])
    assert len(caught.value.faults) == len(overrides)
    assert all("--set" in str(fault) for fault in caught.value.faults)


def test_loading_a_small_scene_calls_few_modules() -> None:
    package = str(Path(sandbox.__file__).parent)
    called: set[str] = set()

    def record_call(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(package):
            called.add(frame.f_code.co_filename)

    load("bounce")  # imports modules, and builds the validator
    before = sys.getprofile()
    sys.setprofile(record_call)
    try:
        load("bounce")
    finally:
        sys.setprofile(before)
    assert any(path.endswith("load.py") for path in called)
    assert len(called) <= 13, sorted(called)
