"""Script files of control presses: every fault of a file is reported with its line."""

from pathlib import Path

import pytest

from sandbox.games.contract import Control, Press
from sandbox.games.players import PlayerSpec, faults_of, read_script
from sandbox.scene.errors import SceneError

CONTROLS = (Control("left flipper", "", ("z",)), Control("plunger", "", ("enter",), analogue=True))


def test_lines_become_presses_sorted_by_time(tmp_path: Path) -> None:
    file = tmp_path / "s.txt"
    file.write_text("1.5, left flipper, 1\n\n  # all of it\n0, plunger, 0.25 # a quarter\n", encoding="utf-8")
    presses = read_script(file)
    assert presses == (Press(0.0, "plunger", 0.25), Press(1.5, "left flipper", 1.0))
    assert faults_of(presses, CONTROLS, "s.txt") == []
    assert PlayerSpec.parse(str(file)).presses == presses


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("0.5 left 1", "should be `time, control, value`"),
        ("0.5, 1", "should be `time, control, value`"),
        ("0.5, , 1", "should be `time, control, value`"),
        ("soon, left, 1", "should be `time, control, value`"),
        ("-1, left, 1", "a time of -1 s is out of range"),
        ("nan, left, 1", "a time of nan s is out of range"),
        ("1e99, left, 1", "a time of 1e99 s is out of range"),
        ("1, left, 2", "a value of 2 is out of range"),
        ("1, left, nan", "a value of nan is out of range"),
    ],
)
def test_faults_are_reported_with_their_lines(tmp_path: Path, line: str, message: str) -> None:
    file = tmp_path / "s.txt"
    file.write_text(f"# first\n{line}\n1, ok, 1\n{line}\n")
    with pytest.raises(SceneError) as error:
        read_script(file)
    assert [(fault.file, fault.line) for fault in error.value.faults] == [(str(file), 2), (str(file), 4)]
    assert message in error.value.faults[0].message


def test_unknown_controls_and_invalid_values_are_reported() -> None:
    presses = (Press(0.0, "tilt", 1.0), Press(1.0, "tilt", 0.0), Press(2.0, "left flipper", 0.5))
    assert [str(fault).split(";")[0] for fault in faults_of(presses, CONTROLS, "s.txt")] == [
        "s.txt: there is no control 'tilt'",
        "s.txt: 'left flipper' is 0 or 1, not 0.5",
    ]


def test_repeated_fault_is_reported_at_its_first_line(tmp_path: Path) -> None:
    file = tmp_path / "s.txt"
    file.write_text("# first\n3, tilt, 1\n\n1, plunger, 1\n3, tilt, 1\n2, left flipper, 0.5 # half\n")
    faults = faults_of(read_script(file), CONTROLS, str(file))
    assert [(fault.line, fault.message.split(";")[0]) for fault in faults] == [
        (6, "'left flipper' is 0 or 1, not 0.5"),
        (2, "there is no control 'tilt'"),
    ]


def test_missing_or_binary_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="No such file"):
        PlayerSpec.parse(str(tmp_path / "none.txt"))
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="cannot be read"):
        PlayerSpec.parse(str(tmp_path / "bytes"))


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    "text",
    ["x" * 10**6, "1, x, 1," * 10**5, "9" * 10**6 + ", a, 1", "[" * 10**6, "0, a, " + "9" * 10**6, "wrong\n" * 10**5],
)
def test_faults_of_large_scripts_are_few_and_short(text: str, tmp_path: Path) -> None:
    file = tmp_path / "s.txt"
    file.write_text(text)
    with pytest.raises(SceneError) as error:
        read_script(file)
    assert len(error.value.faults) <= 21
    assert all(len(fault.message) < 200 for fault in error.value.faults)


def test_many_unknown_controls_are_reported_by_the_first_twenty(tmp_path: Path) -> None:
    presses = tuple(Press(0.0, f"control {k}" + "x" * 1000, 1.0) for k in range(1000))
    faults = faults_of(presses, CONTROLS, "s.txt")
    assert faults[-1].message == "980 more faults"
    assert (len(faults), max(len(fault.message) for fault in faults) < 200) == (21, True)


@pytest.mark.parametrize("name", ["/dev/zero", "x" * 300, "folder", "loop", "a\0b"])
def test_unreadable_path_gives_a_short_error(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("loop").symlink_to("loop")
    with pytest.raises(SceneError, match="cannot be read: ") as error:
        PlayerSpec.parse(name)
    assert len(str(error.value)) < 500
