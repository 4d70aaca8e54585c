"""The corpus: every case that once broke, run in an isolated process. `tools/fuzzing` says what a case file holds."""

from pathlib import Path

import pytest

from tools.fuzzing.isolated import Case, Limits, run_cases

pytestmark = pytest.mark.full  # fuzzing and inputs at the ends of their ranges

CORPUS = sorted((Path(__file__).parent / "corpus").glob("*.json"))
SHARDS = 4


@pytest.mark.timeout(1200)  # the first cases may wait for kernels to be compiled
@pytest.mark.parametrize("shard", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, SHARDS))])
def test_what_once_broke_ends_in_a_result_or_an_error_of_the_interface(shard: int) -> None:
    cases = {path.name: Case.load(path) for path in CORPUS[shard::SHARDS]}
    names = {id(case): name for name, case in cases.items()}
    found = run_cases(cases.values(), Limits(), workers=1)
    assert [f"{names[id(case)]}: {outcome.group}\n{outcome.detail}" for case, outcome in found if outcome.failed] == []


def test_every_case_says_what_it_is_about() -> None:
    assert [path.name for path in CORPUS if not Case.load(path).about] == []
