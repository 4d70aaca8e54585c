"""Tables and texts on terminals of 60 to 200 columns: nothing is cut off, and no number or word is folded."""

import re
import sys
from pathlib import Path

import pytest
from click import unstyle

from sandbox.cli.tables import add_columns, new_table, print_table
from tests.cli.calling import DROP, lines_of, write_scene

WIDTHS = (60, 80, 120, 200)
TWO_BALLS = DROP + '\n[[ball]]\nname = "other ball"\nposition = [3.0, 1.0]\nvelocity = [0.1, 1e-17]\nradius = 0.5\n'
TABLE_OF_KEYS = {"key", "value", "default", "–"}
"""Heads and empty cells of the table that `schema` prints on wide terminals only"""
COMMANDS = (
    "run SCENE",
    "run SCENE --sweep solver.dt=0.01,0.001 --sweep solver.iterations=5,10 --set solver.substeps=2",
    "run SCENE --ledger",
    "compare SCENE --engines pymunk,reference",
    "compare SCENE --engines pymunk -v --sweep solver.dt=0.01,0.001",
    "tradeoff SCENE --engine pymunk --tolerance 0.001 --effort 0.01 --repeats 1 -v",
    "schema solver",
    "schema joint",
    "scenes",
    "engines",
    "check SCENE",
    "runs study",
    "runs study --by solver.dt",
)


def set_terminal(monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    """Make the standard output a terminal of some width."""
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    for name, value in (("COLUMNS", str(width)), ("TERM", "dumb"), ("NO_COLOR", "1")):
        monkeypatch.setenv(name, value)


def words_of(lines: list[str]) -> set[str]:
    """Return the words of an output without numbers: measured times differ between two runs."""
    return {word.strip(";:") for line in lines for word in line.split() if not re.search(r"\d", word)}


@pytest.mark.fail_slow(60)  # searches, and kernels that are compiled
@pytest.mark.parametrize("command", COMMANDS)
def test_lines_fit_and_words_are_whole(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    scene = Path(write_scene(tmp_path, TWO_BALLS)).name
    words = command.replace("SCENE", scene).split()
    if words[0] == "runs":
        assert lines_of(capfd, "run", scene, "--sweep", "solver.dt=0.01,0.005", "--out", "study")[0] == 0
    set_terminal(monkeypatch, 1000)
    status, wide, _ = lines_of(capfd, *words)
    for width in WIDTHS:
        set_terminal(monkeypatch, width)
        again, narrow, _ = lines_of(capfd, *words)
        assert again == status
        code = "    "  # lines to paste into a program are not folded
        assert [line for line in narrow if len(unstyle(line).rstrip()) > width and not line.startswith(code)] == []
        if words[0] != "tradeoff":  # whose rows depend on the timings
            assert words_of(wide) - TABLE_OF_KEYS <= words_of(narrow)


@pytest.mark.parametrize("width", WIDTHS)
def test_blocks_of_a_table_name_their_rows_and_keep_numbers_whole(
    width: int, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    set_terminal(monkeypatch, width)
    table = new_table()
    add_columns(table, ["engine", "dt"])
    add_columns(table, [f"long head {k}" for k in range(20)], "right")
    for row in range(2):
        table.add_row(f"engine-{row}", "0.001", *(f"{row}.{k:06d}" for k in range(20)))
    print_table(table, keys=2)
    lines = capfd.readouterr().out.splitlines()
    assert max(len(line.rstrip()) for line in lines) <= width
    for row in range(2):
        blocks = [line.split() for line in lines if line.startswith(f"engine-{row}")]
        assert all(block[1] == "0.001" for block in blocks)
        assert [cell for block in blocks for cell in block[2:]] == [f"{row}.{k:06d}" for k in range(20)]


def test_long_text_in_a_cell_folds_between_words(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    set_terminal(monkeypatch, 40)
    table = new_table()
    add_columns(table, ["scene", "game"])
    table.add_row("8-ball", "the player on the left wins by three balls and a safety")
    print_table(table)
    lines = capfd.readouterr().out.splitlines()
    assert max(len(line.rstrip()) for line in lines) <= 40
    assert "the player on the left wins by three balls and a safety" in " ".join(
        " ".join(line.split()) for line in lines
    )
