"""Damaged files: files of every kind through the commands that read them, in isolated processes."""

import pytest

from tools.fuzzing.damaged_files import KINDS, argument, file_cases
from tools.fuzzing.isolated import Case, Limits, run_cases

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges


def failures(cases: list[Case], workers: int = 1) -> list[str]:
    found = run_cases(cases, Limits(), workers)
    return [f"{case.about}: {outcome.group}\n{outcome.detail}" for case, outcome in found if outcome.failed]


def test_a_damaged_file_is_determined_by_seed_and_number() -> None:
    assert [argument(3, k) for k in range(20)] == [argument(3, k) for k in range(20)]
    assert argument(3, 0) != argument(4, 0)


def test_undamaged_files_are_read_by_every_command() -> None:
    quick = {"plot", "other", "again", "png", "gif"}  # the other commands take seconds of compiling and drawing
    cases = [
        Case(
            "tools.fuzzing.damaged_files:read_damaged",
            {"file": name, "damage": [], "commands": [each for each in kind.commands if each not in quick]},
            name,
        )
        for name, kind in KINDS.items()
    ]
    assert failures(cases) == []


@pytest.mark.nightly
def test_damaged_files_are_refused_or_recreated() -> None:
    assert failures(list(file_cases(7, 25))) == []


@pytest.mark.nightly
def test_many_damaged_files_are_refused_or_recreated() -> None:
    assert failures(list(file_cases(8, 400)), workers=2) == []
