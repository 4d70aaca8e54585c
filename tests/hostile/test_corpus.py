"""Corpus: every case that once failed, in an isolated process. `tools/fuzzing` documents the format of a case file."""

from pathlib import Path

import pytest

from tools.fuzzing.isolated import Case, Limits, run_cases

pytestmark = pytest.mark.full  # fuzzing and inputs at the ends of their ranges

CORPUS = sorted((Path(__file__).parent / "corpus").glob("*.json"))
SHARDS = 4


@pytest.mark.timeout(1200)  # the first cases may wait for kernels to be compiled
@pytest.mark.parametrize("shard", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, SHARDS))])
def test_cases_of_the_corpus_end_in_a_result_or_an_error_of_the_interface(shard: int) -> None:
    cases = {path.name: Case.load(path) for path in CORPUS[shard::SHARDS]}
    names = {id(case): name for name, case in cases.items()}
    found = run_cases(cases.values(), Limits(), workers=1)
    assert [f"{names[id(case)]}: {outcome.group}\n{outcome.detail}" for case, outcome in found if outcome.failed] == []


def test_every_case_has_a_description() -> None:
    assert [path.name for path in CORPUS if not Case.load(path).about] == []
