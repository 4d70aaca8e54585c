"""Settings written into scene files: only the values in `[solver]` change, everything else is kept byte for byte."""

import os
import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.errors import SceneError
from sandbox.scene.files import solver_in_file as rewrite
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.scene.files.solver_in_file import with_solver, write_solver
from sandbox.scene.files.toml_changes import written
from sandbox.scene.files.toml_index import statements
from tests.samples import each_shipped_scene
from tests.strategies import documents, rendered

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

BALL = '[[ball]]\nname = "a"  # it falls\nposition = [0.0, 1.0]\nradius = 0.5\n'
CHANGES = {"dt": 0.002, "substeps": 4, "iterations": None, "integrator": "rk4"}

some_settings = st.fixed_dictionaries(
    {},
    optional={
        "dt": st.sampled_from([1e-3, 0.5, 1, 2.5e-4]),
        "substeps": st.none() | st.integers(1, 100),
        "iterations": st.none() | st.integers(1, 10_000),
        "slop": st.none() | st.floats(0, 1e9),
        "half_kick": st.none() | st.booleans(),
        "integrator": st.none() | st.sampled_from(["rk4", "leapfrog"]),
        "detection": st.none() | st.sampled_from(["discrete", "swept"]),
    },
)


def without_solver(text: str) -> str:
    """Return a text without its `[solver]`: heading, lines or inline table, each up to the end of its line."""
    heading, kept, end = None, "", 0
    for each in statements(text):
        heading = each.keys if each.heading else heading
        is_solver = heading == ("solver",) or (heading is None and each.keys[0] == "solver")
        kept += text[end : each.begin] + ("" if is_solver else text[each.begin : each.end])
        end = each.end
    return kept + text[end:]


@given(rendered(documents()), some_settings, st.sampled_from(["", "\ufeff"]))
def test_settings_written_into_any_layout_change_nothing_else(case, changes, mark):
    document, text = case
    result = with_solver(mark + text.text, changes)
    solver = {**document.get("solver", {}), **changes}
    expected = {**document, "solver": {key: value for key, value in solver.items() if value is not None}}
    assert {"solver": {}, **tomllib.loads(result.removeprefix("\ufeff"))} == expected
    assert result.startswith("\ufeff") == bool(mark)
    before, after = (without_solver(each.removeprefix("\ufeff")) for each in (text.text, result))
    if "solver" in document:
        assert before.rstrip("\r\n") == after.rstrip("\r\n")  # a newline may be added to the last line
    else:  # only blank lines are added around a new table
        assert re.sub(r"\s+", " ", before).strip() == re.sub(r"\s+", " ", after).strip()
    assert with_solver(result, changes) == result


@pytest.mark.parametrize("name", each_shipped_scene())
def test_shipped_scenes_keep_every_byte_outside_solver(name: str) -> None:
    text = find(name).read_bytes().decode()
    result = with_solver(text, CHANGES)
    begin = text.index("[solver]\n")
    end = text.find("\n[", begin)
    stop = len(result) - len(text[end:])
    assert (result[:begin], result[stop:]) == (text[:begin], text[end:])
    before, after = loads(text), loads(result)
    assert after.model_copy(update={"solver": before.solver}) == before
    assert (after.solver.dt, after.solver.substeps, after.solver.iterations) == (0.002, 4, 10)
    assert after.solver.integrator == "rk4"
    comments = [line for line in text.splitlines() if "#" in line and not line.startswith("iterations")]
    assert [c.partition("#")[2] for c in comments] == [
        line.partition("#")[2] for line in result.splitlines() if "#" in line
    ]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("[solver]\ndt = 0.01  # s\n\n" + BALL, "[solver]\ndt = 0.002  # s\nsubsteps = 4\n\n" + BALL),
        ("[solver]\n  dt=0.002#s\n  # more\n" + BALL, "[solver]\n  dt=0.002#s\n  substeps = 4\n  # more\n" + BALL),
        (BALL + "[solver]", BALL + "[solver]\ndt = 0.002\nsubsteps = 4"),
        ("solver = { dt = 0.01 }  # s\n" + BALL, "solver = { dt = 0.002, substeps = 4 }  # s\n" + BALL),
        ("solver = {}\n" + BALL, "solver = { dt = 0.002, substeps = 4 }\n" + BALL),
        ("solver.dt = 1 # s\ntitle = ''\n" + BALL, "solver.dt = 0.002 # s\nsolver.substeps = 4\ntitle = ''\n" + BALL),
        ("title = ''\n\n# it\n" + BALL, "title = ''\n\n[solver]\ndt = 0.002\nsubsteps = 4\n\n# it\n" + BALL),
        ("[world]\n\n" + BALL, "[world]\n\n[solver]\ndt = 0.002\nsubsteps = 4\n\n" + BALL),
        (BALL + "[world]\nseed = 1", "[solver]\ndt = 0.002\nsubsteps = 4\n\n" + BALL + "[world]\nseed = 1"),
    ],
)
def test_layout_of_solver_is_kept(before: str, after: str) -> None:
    assert with_solver(before, {"dt": 0.002, "substeps": 4}) == after
    crlf = before.replace("\n", "\r\n")
    if "\n" in before:
        assert with_solver(crlf, {"dt": 0.002, "substeps": 4}) == after.replace("\n", "\r\n")


def test_numbers_are_written_in_short_form() -> None:
    numbers = [0.001, 1e-3, 1e-6, 2.5e-7, 1.0, 10.0, 1e22, 4, True]
    assert list(map(written, numbers)) == ["0.001", "0.001", "1e-6", "2.5e-7", "1.0", "10.0", "1e22", "4", "true"]


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_written_number_round_trips(number: float) -> None:
    assert tomllib.loads(f"x = {written(number)}")["x"] == number


def test_invalid_setting_or_text_is_refused() -> None:
    with pytest.raises(SceneError, match=r"f\.toml:2: solver\.dt: "):
        with_solver("[solver]\ndt = 0.01\n" + BALL, {"dt": -1.0}, "f.toml")
    with pytest.raises(SceneError, match=r"solver\.speed"):
        with_solver(BALL, {"speed": 1})
    with pytest.raises(SceneError, match=r"\[solver\]"):
        with_solver("[solver\n", {"dt": 1.0})


def test_write_keeps_permissions_and_follows_a_link(tmp_path: Path) -> None:
    path, link = tmp_path / "a.toml", tmp_path / "link.toml"
    path.write_bytes(b"\xef\xbb\xbf" + BALL.replace("\n", "\r\n").encode())
    path.chmod(0o640)
    link.symlink_to(path)
    assert write_solver(link, {"dt": 0.004})
    assert link.is_symlink()
    assert path.stat().st_mode & 0o777 == 0o640
    assert path.read_bytes().startswith(b"\xef\xbb\xbf[solver]\r\ndt = 0.004\r\n\r\n[[ball]]\r\n")
    assert load(path).solver.dt == 0.004
    assert not write_solver(path, {"dt": 0.004})
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.toml", "link.toml"]


def test_file_that_is_not_a_writable_scene_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session, latin, missing = tmp_path / "s.json", tmp_path / "l.toml", tmp_path / "m.toml"
    session.write_text("{}")
    latin.write_bytes(BALL.encode() + b"# \xe9\n")
    for path, reason in (
        (session, "is not a scene file"),
        (latin, "not UTF-8"),
        (missing, "No such file"),
        (tmp_path, "not a regular file"),
    ):
        with pytest.raises(SceneError, match=f"^{re.escape(str(path))}: .*{reason}"):
            write_solver(path, {"dt": 0.004})
    inside = tmp_path / "package" / "shipped" / "tutorial" / "a.toml"
    inside.parent.mkdir(parents=True)
    inside.write_text(BALL)
    monkeypatch.setattr(rewrite, "PACKAGE", tmp_path / "package")
    with pytest.raises(SceneError, match="part of the installed package"):
        write_solver(inside, {"dt": 0.004})
    assert inside.read_text() == BALL


def test_failed_write_leaves_the_file_unchanged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.toml"
    path.write_text(BALL)
    with monkeypatch.context() as patch:
        patch.setattr(os, "access", lambda *_: False)
        with pytest.raises(SceneError, match="read-only"):
            write_solver(path, {"dt": 0.004})

    def fail_with_full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", fail_with_full_disk)
    with pytest.raises(SceneError, match="cannot be written: No space left"):
        write_solver(path, {"dt": 0.004})
    assert path.read_text() == BALL
    assert [p.name for p in tmp_path.iterdir()] == ["a.toml"]
