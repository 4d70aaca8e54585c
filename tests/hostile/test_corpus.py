"""Fuzzing with fixed seeds, the corpus of cases that once failed, and damaged files, in isolated processes."""

from collections.abc import Iterable
from pathlib import Path

import pytest

from tools.fuzzing.isolated import Case, Limits, Outcome, run_cases
from tools.fuzzing.scene_mutants import argument, scene_cases

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges


SEED = 1
"""The mutants are the same every time; `python -m tools.fuzzing` draws others."""


def outcomes(cases: Iterable[Case], limits: Limits | None = None) -> list[Outcome]:
    return [outcome for _, outcome in run_cases(cases, limits or Limits(), workers=1)]


def failures(cases: Iterable[Case]) -> list[str]:
    found = run_cases(cases, Limits(), workers=1)
    return [f"{case.about}: {outcome.group}\n{outcome.detail}" for case, outcome in found if outcome.failed]


@pytest.mark.nightly
@pytest.mark.timeout(1200)  # the first cases may wait for kernels to be compiled
@pytest.mark.parametrize("part", range(2))
def test_mutated_scenes_end_in_a_result_or_an_error_of_the_interface(part: int) -> None:
    assert failures(scene_cases(SEED, 60, first=60 * part)) == []


@pytest.mark.nightly
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("part", range(4))
def test_more_mutated_scenes_end_in_a_result_or_an_error_of_the_interface(part: int) -> None:
    assert failures(scene_cases(SEED, 500, first=10_000 + 500 * part)) == []


def test_a_mutant_is_determined_by_seed_and_number() -> None:
    assert [argument(3, k) for k in range(30)] == [argument(3, k) for k in range(30)]
    assert argument(3, 0) != argument(4, 0)


@pytest.mark.parametrize(
    ("name", "kind", "what"),
    [
        ("passes", "ok", ""), ("refuses", "refused", "ValueError"), ("raises", "traceback", "ZeroDivisionError"),
        ("violates", "violation", "sum"), ("warns", "traceback", "UserWarning"), ("aborts", "abort", "SIGABRT"),
        ("loops", "hang", ""), ("allocates", "memory", "MemoryError"),
    ],
)  # fmt: skip
def test_outcome_of_a_case_has_its_kind_and_detail(name: str, kind: str, what: str) -> None:
    outcome = outcomes([Case(f"tools.fuzzing.samples:{name}", 1)], Limits(cpu=1.0, memory=2**30))[0]
    assert (outcome.kind, outcome.what) == (kind, what)


def test_cases_after_an_aborted_one_are_run() -> None:
    names = ("passes", "aborts", "passes", "raises", "refuses")
    found = outcomes(Case(f"tools.fuzzing.samples:{name}", 1) for name in names)
    assert [outcome.kind for outcome in found] == ["ok", "abort", "ok", "traceback", "refused"]


def test_closing_the_iterator_ends_the_workers() -> None:
    found = run_cases(
        (Case(f"tools.fuzzing.samples:{name}", 1) for name in ("passes", "waits", "waits")), Limits(), workers=2
    )
    assert next(found)[1].kind == "ok"
    found.close()  # type: ignore[attr-defined]


CORPUS = sorted((Path(__file__).parent / "corpus").glob("*.json"))
SHARDS = 4


@pytest.mark.timeout(1200)  # the first cases may wait for kernels to be compiled
@pytest.mark.parametrize("shard", [0, *(pytest.param(k, marks=pytest.mark.nightly) for k in range(1, SHARDS))])
def test_cases_of_the_corpus_end_in_a_result_or_an_error_of_the_interface(shard: int) -> None:
    cases = {path.name: Case.load(path) for path in CORPUS[shard::SHARDS]}
    names = {id(case): name for name, case in cases.items()}
    found = run_cases(cases.values(), Limits(), workers=1)
    assert [f"{names[id(case)]}: {outcome.group}\n{outcome.detail}" for case, outcome in found if outcome.failed] == []


def test_every_case_has_a_description() -> None:
    assert [path.name for path in CORPUS if not Case.load(path).about] == []
