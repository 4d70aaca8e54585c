"""Lit lamps, and when; panel and lamps as numbers for an environment."""

import copy

import pytest

from sandbox.games.contract import HasLamps
from sandbox.games.pinball.devices import FLASH_TIME
from sandbox.games.pinball.drop_targets import FALL_TIME
from sandbox.games.pinball.rules import BLINK_PERIOD
from tests.games.pinball.pinball_by_hand import DT, OPEN, Table, table


@pytest.fixture
def game() -> Table:
    """A game with a ball in play after its ball save, and no lamp lit."""
    game = Table(table())
    game.play()
    assert isinstance(game.game, HasLamps)
    assert game.game.lit_lamps() == frozenset()
    return game


def lit_lamps_over(game: Table, seconds: float = BLINK_PERIOD) -> list[frozenset[str]]:
    """Return the lit lamps at every step of a time."""
    found = []
    for _ in range(round(seconds / DT)):
        game.advance()
        found.append(game.game.lit_lamps())
    return found


@pytest.mark.parametrize("name", ["bumper a", "sling", "outlane"])
def test_hit_flashes_the_lamp(game: Table, name: str) -> None:
    game.advance((name, 0.5))
    assert game.game.lit_lamps() == {name}
    game.wait(FLASH_TIME + DT)
    assert game.game.lit_lamps() == frozenset()


def test_lamp_of_a_set_stays_lit_until_the_set_is_full(game: Table) -> None:
    game.advance(("lane 2", 0.5))
    assert lit_lamps_over(game)[-1] == {"lane 2"}
    game.press("left flipper")
    assert game.game.lit_lamps() == {"lane 1"}
    game.advance(("lane 2", 0.5))
    game.advance(("lane 3", 0.5))
    assert not lit_lamps_over(game)[-1] & {"lane 1", "lane 2", "lane 3"}


def test_drop_target_is_lit_while_it_is_down_and_a_full_bank_blinks(game: Table) -> None:
    game.advance(("drop 1", 0.5))
    assert lit_lamps_over(game)[-1] == {"drop 1"}
    game.advance(("drop 2", 0.5))
    game.wait(FALL_TIME)
    lit = [each & {"drop 1", "drop 2"} for each in lit_lamps_over(game)]
    assert set(lit) == {frozenset(), frozenset({"drop 1", "drop 2"})}
    # half of the time, within a step at either end
    assert lit.count(frozenset()) == pytest.approx(len(lit) / 2, abs=1.1)


def test_ready_lock_is_lit() -> None:
    game = Table(table("bumper a", "spinner", "hole", balls=2))  # without a mode that the hole could start
    game.play()
    game.game.sheet.is_lock_lit = True
    assert lit_lamps_over(game)[-1] == {"lock"}


def test_mode_blinks_the_elements_that_it_counts(game: Table) -> None:
    modes = game.game.modes
    modes.mode, modes.left, modes.to_go = modes.modes[0], 30.0, 12
    assert modes.mode.roles == ("bumper",)
    game.put(0, OPEN)
    assert set(lit_lamps_over(game)) == {frozenset(), frozenset({"bumper a"})}


def test_tilted_table_is_dark(game: Table) -> None:
    game.advance(("lane 2", 0.5))
    assert game.game.lit_lamps()
    game.game.nudge.tilted = True
    assert game.game.lit_lamps() == frozenset()


def test_reading_lamps_does_not_change_the_state(game: Table) -> None:
    game.advance(("lane 2", 0.5))
    other = copy.deepcopy(game.game)
    for _ in range(3):
        other.lit_lamps()
    assert [copy.deepcopy(other).lit_lamps(), other.display_lines()] == [
        game.game.lit_lamps(),
        game.game.display_lines(),
    ]


NAMES = tuple(name for name, _ in Table(table()).game.observation())


def observed(game: Table) -> dict[str, float]:
    return dict(game.game.observation())


def test_observation_shows_hit_lanes_and_targets() -> None:
    game = Table(table())
    game.wait(0.05)
    game.put(0, OPEN)
    game.advance()
    initial = observed(game)
    assert (initial["ball"], initial["balls in play"], initial["bonus times"], initial["player"]) == (1, 1, 1, 0)
    assert initial["ball save"] == 8.0  # starts at the step in which the ball has left the lane
    assert not any(value for name, value in initial.items() if name.endswith((" lit", " down")))

    game.advance(("lane 2", 0.5))
    game.advance(("standup 1", 0.5))
    game.advance(("drop 1", 0.5))
    current = observed(game)
    assert [current[f"lane {k} lit"] for k in (1, 2, 3)] == [0, 1, 0]
    assert (current["standup 1 lit"], current["drop 1 down"], current["drop 2 down"]) == (1, 1, 0)
    assert current["bonus"] == 100 + 100 + 200  # of a lane, a standup and a drop target
    assert 0.0 < current["ball save"] < initial["ball save"]
    game.press("left flipper")
    # the lit lane moves to the side of the flipper
    assert [observed(game)[f"lane {k} lit"] for k in (1, 2, 3)] == [1, 0, 0]
    game.advance(("drop 2", 0.5))
    assert observed(game)["lock lit"] == 0
    game.wait(0.3)  # until the second target is down: a full bank lights the lock
    assert observed(game)["lock lit"] == 1
    game.advance(("lock", 0.5))
    assert observed(game)["locked"] == 1


def test_observation_shows_modes_and_tilt() -> None:
    game = Table(table())
    game.play()
    for k in (1, 2, 3):
        game.advance((f"lane {k}", 0.5))
    assert observed(game)["mode ready"] == 1
    game.advance(("hole", 0.5))
    game.put(0, OPEN)
    initial = observed(game)
    assert (initial["mode"], initial["mode to go"], initial["mode ready"]) == (1, 12, 0)
    game.wait(2.0)
    assert 27.0 < observed(game)["mode left"] < initial["mode left"]
    warnings = [observed(game)["warnings"]]
    while not observed(game)["tilted"]:
        game.press("nudge")
        game.wait(0.2)
        warnings.append(observed(game)["warnings"])
    assert sorted({*warnings}) == [0, 1, 2, 3]


def test_names_of_the_observation_are_constant() -> None:
    game = Table(table())
    for _ in range(5):
        game.advance(("lane 1", 0.5), ("drop 1", 0.5), ("drop 2", 0.5), ("hole", 0.5), ("drain", 0.5))
        game.wait(1.0)
        assert tuple(name for name, _ in game.game.observation()) == NAMES
    assert len(set(NAMES)) == len(NAMES)
