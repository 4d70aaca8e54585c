"""Statistics of scores, and high scores: ten per table; a damaged file is reported and renamed."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.cli.run_tables import MAX_BINS, ScoreStatistics
from sandbox.games.high_scores import FILE, MAX_SCORES, HighScores, initials_of, opened, table_of
from sandbox.scene.files.load import loads

SCORES = st.lists(st.one_of(st.integers(-1000, 10_000_000), st.floats(-1e6, 1e6)), min_size=1, max_size=60)


@given(scores=SCORES)
def test_statistics_are_those_of_the_sample(scores: list[float]) -> None:
    found = ScoreStatistics.of(scores)
    assert found.count == len(scores) == sum(found.histogram.counts)
    assert found.mean == pytest.approx(np.mean(scores), rel=1e-12, abs=1e-9)  # rounding
    quantiles = found.quantiles
    assert (quantiles["0"], quantiles["1"]) == (min(scores), max(scores))
    assert list(quantiles.values()) == sorted(quantiles.values())
    assert quantiles["0.5"] == pytest.approx(np.median(scores), rel=1e-12, abs=1e-9)


@given(scores=SCORES)
@example(scores=[11.0, -5e-324])  # divided by the bin width it is -0
def test_bins_contain_all_scores_and_have_round_widths(scores: list[float]) -> None:
    found = ScoreStatistics.of(scores).histogram
    assert len(found.edges) == len(found.counts) + 1
    assert len(found.counts) <= MAX_BINS + 2  # the lowest and the highest score may each need one more bin
    assert found.edges[0] <= min(scores)
    assert max(scores) <= found.edges[-1] * (1.0 + 1e-12) + 1e-9  # rounding of an edge
    width = found.edges[1] - found.edges[0]
    assert f"{width:.0e}"[0] in "125"


@given(st.lists(st.integers(-40, 40), min_size=1, max_size=30))
def test_bins_of_integer_scores_have_integer_edges(scores: list[int]) -> None:
    assert all(edge == round(edge) for edge in ScoreStatistics.of(scores).histogram.edges)


@pytest.mark.parametrize(("score", "edge"), [(0.3, 3), (0.6, 6), (0.7, 7)])
def test_bins_include_their_lower_edges(score: float, edge: int) -> None:
    found = ScoreStatistics.of([score, 0.05, 1.0]).histogram
    k = found.edges.index(edge / 10)  # in floating point 3 × 0.1 is more than 0.3
    assert found.counts[k] == 1


def test_one_score_gives_one_bin() -> None:
    found = ScoreStatistics.of([7])
    assert (found.deviation, found.histogram.counts) == (0.0, [1])
    assert found.histogram.edges[0] <= 7 < found.histogram.edges[1]


def test_empty_sample_is_refused() -> None:
    with pytest.raises(ValueError, match="no game"):
        ScoreStatistics.of([])


@pytest.fixture
def scores(tmp_path: Path) -> HighScores:
    return opened(tmp_path / "new" / FILE)


def test_the_ten_best_scores_are_kept_in_descending_order(scores: HighScores) -> None:
    for k in (5, 3, 8, 1, 9, 2, 7, 4, 6, 10, 12, 11):
        scores.enter("a", f"p{k}", k * 1000)
    assert [each.score for each in scores.of("a")] == [k * 1000 for k in range(12, 2, -1)]
    assert scores.of("a")[0].initials == "P12"
    assert scores.of("b") == ()


def test_rank_equals_the_rank_at_which_a_score_is_entered(scores: HighScores) -> None:
    for k in range(MAX_SCORES):
        scores.enter("a", "abc", 100 * (k + 1))
    for score, rank in ((2000, 1), (1000, 2), (150, 10), (100, None), (50, None)):
        assert scores.rank("a", score) == rank
    assert scores.enter("a", "low", 50) is None
    assert scores.enter("a", "new", 1000) == 2
    assert [each.initials for each in scores.of("a")][:2] == ["ABC", "NEW"]  # of equal scores the earlier ranks first


def test_a_score_of_zero_is_not_entered(scores: HighScores) -> None:
    assert scores.rank("a", 0) is None
    assert scores.enter("a", "abc", 0) is None
    assert not scores.path.exists()


@given(st.text())
def test_initials_of_any_text_can_be_stored(text: str) -> None:
    initials = initials_of(text)
    assert 1 <= len(initials) <= 3
    assert initials.isascii()
    assert initials_of(initials) == initials


def test_file_survives_a_crash_in_the_middle_of_writing(scores: HighScores) -> None:
    scores.enter("a", "abc", 100)
    before = scores.path.read_bytes()
    # The process dies as in a power cut, with half a file on the disk.
    crash = f"""
import os, pathlib
from sandbox.cli.run_tables import MAX_BINS, ScoreStatistics
from sandbox.games.high_scores import HighScores
write = pathlib.Path.write_text
def half(self, text, **rest):
    write(self, text[: len(text) // 2], **rest)
    os._exit(9)
pathlib.Path.write_text = half
HighScores(pathlib.Path({str(scores.path)!r})).enter("a", "new", 500)
"""
    process = subprocess.run([sys.executable, "-c", crash], check=False)
    assert process.returncode == 9
    assert len(list(scores.path.parent.iterdir())) == 2  # half a file was written
    assert scores.path.read_bytes() == before
    again = opened(scores.path)
    assert (again.notice, again.of("a")[0].score) == (None, 100)


DAMAGE = {
    "not JSON": b'{"a": [["ABC", 1',
    "not text": b"\xff\xfe\x00",
    "no object": b"[1, 2]",
    "no pairs": b'{"a": [["ABC"]]}',
    "no initials": b'{"a": [["ABCDEF", 5]]}',
    "no number": b'{"a": [["ABC", "many"]]}',
    "too large": b'{"a": [["ABC", 1' + b"0" * 400 + b"]]}",
    "not finite": b'{"a": [["ABC", 1e999]]}',
    "out of range": b'{"a": [["ABC", 10000000000000000]]}',
    "negative": b'{"a": [["ABC", -10000000000000000]]}',
    "too deep": b"[" * 100_000,
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_file_is_reported_and_renamed(tmp_path: Path, damage: str) -> None:
    path = tmp_path / FILE
    for k in (1, 2):
        path.write_bytes(DAMAGE[damage])
        scores = opened(path)
        renamed = tmp_path / f"high-scores-damaged-{k}.json"
        assert scores.notice is not None
        assert str(renamed) in scores.notice
        assert "\n" not in scores.notice
        assert renamed.read_bytes() == DAMAGE[damage]
        scores.enter("a", "abc", 5)
        assert opened(path).notice is None


def test_unreadable_file_is_not_treated_as_damaged(tmp_path: Path) -> None:
    (tmp_path / FILE).mkdir()
    with pytest.raises(OSError, match=FILE):
        opened(tmp_path / FILE)


def test_high_scores_without_a_folder_name_the_variable_that_sets_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SANDBOX_DATA", raising=False)
    monkeypatch.delenv("XDG_DATA_HOME", raising=False)
    monkeypatch.setattr("sandbox.user_folders.home_folder", lambda: None)
    with pytest.raises(OSError, match="SANDBOX_DATA"):
        opened()


def test_table_name_has_the_game_and_the_title() -> None:
    scene = loads('title = "Classic"\n[play]\ngame = "pinball"\n[[ball]]\nposition = [0.0, 0.0]\nradius = 0.1\n')
    assert table_of(scene) == "pinball: Classic"
