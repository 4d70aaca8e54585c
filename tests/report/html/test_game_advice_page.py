"""Page of the advice for a game: its figures, its lines of code, its replays, its marks."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox.measure.game_advice.difference import GameTruth
from sandbox.measure.proportion import Proportion
from sandbox.rehearsal.step_settings import RehearsalSettings
from sandbox.report.html.game_advice import game_advice_page, write_game_advice
from sandbox.report.html.game_replay import GameTrack, game_replay_document
from sandbox.report.html.replay_data import ABSENT, decompress
from tests.report.html.game_advice_documents import (
    BALL,
    BULLET_SHAPE,
    COIN,
    DURATION,
    FIRED,
    FRAMES,
    HIT,
    LAG,
    TAKEN,
    WINDOW,
    ZOOM,
    game_advice,
    rehearsal,
    runs,
    setting,
)
from tests.report.html.page_documents import HOSTILE
from tests.report.html.test_page_parts import ParsedHtml

DATA = re.compile(r'<script type="application/json" class="data">(.*?)</script>', re.DOTALL)


def data_of(html: str) -> dict[str, Any]:
    """Return the data of the only replay of a page."""
    (text,) = DATA.findall(html)
    found: dict[str, Any] = json.loads(text)
    return found


def page_text(html: str) -> str:
    """Return the text of a page with single spaces."""
    return " ".join(ParsedHtml(html).text.split())


def document(**more: Any) -> dict[str, Any]:
    """Return the replay of the game with y down, or of one run of it with other arguments."""
    found = runs() if not more else {"truth": rehearsal(RehearsalSettings(), hits=True, **more)}
    return game_replay_document([GameTrack(name, "truth", run) for name, run in found.items()], DURATION, ZOOM)


def positions(data: dict[str, Any], track: int) -> Any:
    """Return x and y, px, of the drawn bodies in a track, from the left and upper side of the window (F, N, 2)."""
    codes = decompress(data["tracks"][track]["codes"], (len(data["time"]), data["bodies"], 3))
    found = codes[..., :2] * data["step"] - data["half"]
    found[codes[..., 0] == ABSENT] = np.nan
    left, _, _, top = data["view"]
    return np.stack((found[..., 0] - left, top - found[..., 1]), axis=-1)


def test_page_has_the_figures_of_the_advice(tmp_path: Path) -> None:
    shown = runs()
    path = write_game_advice(game_advice(shown), shown, tmp_path / "advice.html", ["a note on the recording"])
    text = page_text(path.read_text(encoding="utf-8"))
    for figure in (
        "Present setting (1 substep, 10 iterations): 1 of 1 contact",
        "Recommended setting (4 substeps, 10 iterations): 0.25 px, contacts as in the truth",
        "0.7 ms of physics per frame (×3.50)",
        "is up to 3 px off at 2 s",  # LAG at 0.5 px per unit
        "1 of 10 (2–40 %)",  # Wilson's interval of 1 of 10
        "9 of 10 (60–98 %)",
        "The truth is the game itself with 64 substeps. It is within 0.125 px",
        "known for 75 % of the positions",
        "start up to 0.1 px off",
        "iterations 10 → 20",
        "Recording: a note on the recording",
        "7 settings tried in 41 runs of the game, 12 s.",
    ):
        assert figure in text


def test_setting_that_only_departs_names_the_time() -> None:
    shown = {name: run for name, run in runs().items() if name != "recommended"}
    shown["present"] = rehearsal(RehearsalSettings(), hits=True, lag=LAG)
    advice = game_advice(runs())
    present = setting(shown["present"], GameTruth(shown["truth"], {}, frozenset()), {}, 0.2)
    text = page_text(game_advice_page(replace(advice, present=present), shown).html())
    assert "too far off at 0.683 s" in text  # frame 41: 6 units · 41/120 · 0.5 px/unit is the first beyond 1 px


def test_lines_to_change_are_a_diff() -> None:
    shown = runs()
    html = game_advice_page(game_advice(shown), shown).html()
    assert "game.py:12" in html
    assert "<del>    space.step(dt)</del>" in html
    assert html.count("<ins>") == 2


def test_page_escapes_all_texts() -> None:
    shown = runs()
    html = game_advice_page(game_advice(shown), shown, [HOSTILE]).html()
    parsed = ParsedHtml(html)
    assert "img" not in parsed.elements
    assert HOSTILE not in html
    # In the answer, the settings, the callbacks, the bodies that are unknown, the lines of code and the remarks.
    assert parsed.text.count(HOSTILE) >= 6


@pytest.mark.parametrize("names", [("truth", "present", "recommended"), ("truth", "present")])
def test_page_has_a_picture_for_each_run(names: tuple[str, ...]) -> None:
    shown = runs()
    html = game_advice_page(game_advice(shown), {name: shown[name] for name in names}).html()
    assert ParsedHtml(html).elements.count("canvas") == len(names)
    data = data_of(html)
    assert [track["name"] for track in data["tracks"]] == list(names)
    assert data["panes"] == [["truth"], *([name, "truth"] for name in names[1:])]


def test_page_without_runs_has_no_replay() -> None:
    elements = ParsedHtml(game_advice_page(game_advice(runs()), {}).html()).elements
    assert "canvas" not in elements
    assert "table" in elements


def test_page_without_a_recommended_setting_shows_the_most_accurate() -> None:
    shown = runs()
    advice = game_advice(shown)
    best = {**{name: shown[name] for name in ("truth", "present")}, "most accurate": shown["recommended"]}
    held = replace(advice.plays, chosen=Proportion(8, 10))
    html = game_advice_page(
        replace(advice, recommended=None, most_accurate=advice.recommended, plays=held), best
    ).html()
    assert "No setting that was tried keeps to 1 px in enough plays. The most accurate one (4 substeps" in html
    assert "8 of 10 plays that differ a little are within the tolerance." in html
    assert [track["name"] for track in data_of(html)["tracks"]] == list(best)


def test_present_setting_within_the_tolerance_is_the_answer() -> None:
    shown = {"truth": runs()["truth"], "present": rehearsal(RehearsalSettings(), hits=True)}
    advice = game_advice(runs())
    present = setting(shown["present"], GameTruth(shown["truth"], {}, frozenset()), {}, 0.2)
    html = game_advice_page(replace(advice, present=present, recommended=present, code=None), shown).html()
    assert "The present setting, 1 substep, 10 iterations, is the cheapest that keeps to 1 px." in html
    assert '<pre class="diff">' not in html


def test_missed_contact_is_marked_where_the_truth_has_it() -> None:
    shown = runs()
    data = data_of(game_advice_page(game_advice(shown), shown).html())
    truth, present, recommended = (track["marks"] for track in data["tracks"])
    assert truth == recommended == []
    ((time, x, y, text),) = present
    assert time == data["start"] == pytest.approx(HIT / 60, abs=1e-5)  # written to six digits
    left, _, _, top = data["view"]
    # The bullet is removed in the frame of the hit; its last position is that of the frame before. Rounded to 0.001.
    assert x - left == pytest.approx(ZOOM * (100.0 + 20.0 * (HIT - 1 - FIRED)), abs=2e-3)
    assert top - y == pytest.approx(ZOOM * 200.0, abs=2e-3)
    assert text.startswith("missed: ")


def test_positions_are_those_of_the_runs() -> None:
    data = document()
    assert data["bodies"] == 2  # the post never moves
    assert (data["time"][0], data["time"][-1], len(data["time"])) == (0.0, DURATION, FRAMES)
    ball, bullet = positions(data, 1).swapaxes(0, 1)
    frames = np.arange(FRAMES)
    expected = ZOOM * np.stack((100.0 + LAG * frames / (FRAMES - 1), 50.0 + 3.0 * frames), axis=1)
    assert ball == pytest.approx(expected, abs=0.51 * data["step"])  # half a step, and rounding
    assert np.isnan(bullet[:FIRED]).all()
    assert np.isfinite(bullet[FIRED : HIT + 10]).all()  # later it leaves the square that is encoded
    truth = positions(data, 0)
    assert np.isnan(truth[HIT:, 1]).all()  # removed by the hit


def test_window_is_the_view_and_y_follows_gravity() -> None:
    down, up = document(), document(gravity=-900.0)
    for data in (down, up):
        left, bottom, right, top = data["view"]
        assert (right - left, top - bottom) == pytest.approx(WINDOW)
    # The canvas has y up: what falls in a game with y down falls in the picture.
    height = [data["view"][3] - data["view"][1] for data in (down, up)]
    below = [positions(data, 0)[:, 0, 1] for data in (down, up)]
    assert np.diff(below[0]).min() > 0.0
    assert below[1] == pytest.approx(height[1] - below[0], abs=down["step"] + up["step"])  # a step each
    angles = [decompress(each["tracks"][0]["codes"], (FRAMES, 2, 3))[10, 0, 2] for each in (down, up)]
    assert angles[1] * math.tau / 65536 == pytest.approx(0.5, abs=1e-4)  # a step of an angle is 9.6e-5
    assert (int(angles[0]) + int(angles[1])) % 65536 == 0


def test_geometry_has_static_bodies_sensors_and_bodies_at_rest() -> None:
    geometry = document()["geometry"]
    assert sorted(len(piece) for _, _, _, piece, _ in geometry["solids"]) == [5, 9]  # the wall; the post with 4 corners
    ((_, _, angle, coin, number),) = geometry["sensors"]
    assert number == COIN
    assert (angle, coin) == (0.0, [ZOOM * 9.0, ZOOM * 200.0, -ZOOM * 100.0])
    assert geometry["shapes"][geometry["shape"][BALL]] == [[ZOOM * 20.0, 0.0, 0.0]]


def test_removed_shapes_are_absent_from_then_on_and_added_ones_before() -> None:
    absent = document()["tracks"][0]["absent"]
    assert absent == {str(COIN): [[TAKEN / 60, None]], str(BULLET_SHAPE): [[0.0, FIRED / 60]]}


def test_run_that_ends_early_has_no_bodies_afterwards() -> None:
    short = rehearsal(RehearsalSettings(), hits=False, frames=50)
    tracks = [GameTrack("truth", "truth", runs()["truth"]), GameTrack("present", "e1", short, [0.0] * 50)]
    data = game_replay_document(tracks, DURATION, ZOOM)
    found = positions(data, 1)
    assert np.isfinite(found[:50, 0]).all()
    assert np.isnan(found[50:]).all()
    assert data["tracks"][1]["errors"] == [0.0] * 50 + [None] * (FRAMES - 50)


def test_long_run_of_many_bodies_stays_below_three_megabytes() -> None:
    random = np.random.default_rng(1)
    count, frames = 100, 600
    states = np.zeros((frames, count, 6))
    states[..., :3] = np.cumsum(random.normal(scale=3.0, size=(frames, count, 3)), axis=0) + 200.0
    run = replace(
        runs()["truth"],
        offsets=np.arange(frames + 1) * count,
        bodies=np.tile(np.arange(count), frames),
        states=states.reshape(-1, 6),
        shape_bodies=dict(enumerate(range(count))),
        shapes=dict.fromkeys(range(count), runs()["truth"].shapes[2]),
    )
    shown = dict.fromkeys(("truth", "present", "recommended"), run)
    assert len(game_advice_page(game_advice(runs()), shown).html()) < 3_000_000
