"""Calibration of forecasts: valid and reproducible scenes; scores of known cases and of the held-out half."""

import numpy as np
import pytest

from sandbox.scene.files.load import from_document
from tools.calibration.forecast import (
    NEW_KINDS,
    WAYS,
    Case,
    brier_score,
    cases_of,
    halves,
    precision,
    recall,
    reliability,
    summary,
)
from tools.calibration.random_scenes import KINDS, document

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def case(odds: float | None, hits: int, starts: int = 20, in_file: bool = False) -> Case:
    return Case("kind", 0, "pymunk", "tunnelling", dict.fromkeys(WAYS, odds), hits, starts, in_file, covered=True)


def test_halves_have_disjoint_kinds_and_seeds_and_later_features_are_held_out() -> None:
    (fit, even), (held_out, odd) = halves()["fit"], halves()["held-out"]
    assert sorted(fit + held_out) == sorted(KINDS)
    assert (even % 2, odd % 2) == (0, 1)
    assert set([*KINDS][-NEW_KINDS:]) <= set(held_out)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_makes_valid_and_reproducible_scenes(kind: str) -> None:
    for seed in range(4):
        assert len(from_document(document(kind, seed)).bodies) > 0
    assert document(kind, 1) == document(kind, 1) != document(kind, 2)


def test_scores_of_known_cases() -> None:
    cases = [case(0.9, 20), case(None, 12), case(0.1, 0), case(-1.0, 3), case(0.05, 0, in_file=True), case(None, 0)]
    assert (recall(cases, "check").hits, recall(cases, "check").trials) == (1, 2)
    assert (precision(cases, "check").hits, precision(cases, "check").trials) == (3, 4)
    squares = [0.1**2, 0.6**2 + 0.6 * 0.4, 0.1**2, 0.05**2, 0.0]  # the warning without odds is left out
    assert brier_score(cases, "check") == pytest.approx(sum(squares) / 5, rel=1e-12)  # rounding


@pytest.mark.parametrize(("bias", "holds"), [(0.0, True), (0.35, False)])
def test_bins_hold_for_odds_that_are_right_and_not_for_biased_ones(bias: float, holds: bool) -> None:
    random = np.random.default_rng(1)
    stated = random.uniform(0.15, 0.6, 400)
    cases = [case(float(p), int(random.binomial(20, min(p + bias, 1.0)))) for p in stated]
    found = reliability(cases, "check")
    assert sum(each.cases for each in found) == 400
    assert {each.holds for each in found} == {holds}


def test_stated_odds_of_bullets_are_those_of_fresh_starts() -> None:
    """Three bullets from slow to fast: frequencies of trial runs and of other starts have the same expectation."""
    for seed in range(4):
        (found,) = (each for each in cases_of("bullets", seed, ["pymunk"], 20) if each.trouble == "tunnelling")
        odds = found.odds["check"] or 0.0
        assert odds == pytest.approx(found.frequency, abs=0.2)  # two samples of 20 to 30 starts of three bodies
        assert found.covered
        assert found.odds["formulas"] is not None or not found.hits  # a bound may warn too often, never too rarely


@pytest.mark.nightly
@pytest.mark.timeout(3600)  # 58 scenes, each run some sixty times
def test_targets_on_the_held_out_half() -> None:
    kinds, parity = halves()["held-out"]
    cases = [
        each
        for kind in kinds
        for seed in (parity, parity + 2)
        for each in cases_of(kind, seed, ["pymunk", "reference", "box2d"], 20)
    ]
    found = summary(cases)["check"]
    assert found["scores"]["all"]["recall"].probability >= 0.95
    assert found["scores"]["all"]["precision"].probability >= 0.9
    assert np.mean([each.holds for each in found["bins"]]) >= 0.8  # of five or six bins, one may be outside by chance
