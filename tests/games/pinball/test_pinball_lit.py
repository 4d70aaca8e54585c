"""Which lamps are lit, and when."""

import copy

import pytest

from sandbox.games.contract import HasLamps
from sandbox.games.pinball.devices import FLASH
from sandbox.games.pinball.drop_targets import FALL
from sandbox.games.pinball.rules import BLINK_PERIOD
from tests.games.pinball.pinball_by_hand import DT, OPEN, Table, table


@pytest.fixture
def played() -> Table:
    """A ball on the table, whose save has run out, and nothing lit."""
    each = Table(table())
    each.play()
    assert isinstance(each.game, HasLamps)
    assert each.game.lit_lamps() == frozenset()
    return each


def seen(played: Table, seconds: float = BLINK_PERIOD) -> list[frozenset[str]]:
    """Return what is lit at every step of a time."""
    found = []
    for _ in range(round(seconds / DT)):
        played.look()
        found.append(played.game.lit_lamps())
    return found


@pytest.mark.parametrize("name", ["bumper a", "sling", "outlane"])
def test_hit_is_a_flash(played: Table, name: str) -> None:
    played.look((name, 0.5))
    assert played.game.lit_lamps() == {name}
    played.wait(FLASH + DT)
    assert played.game.lit_lamps() == frozenset()


def test_lamp_of_a_set_stays_lit_until_the_set_is_full(played: Table) -> None:
    played.look(("lane 2", 0.5))
    assert seen(played)[-1] == {"lane 2"}
    played.press("left flipper")
    assert played.game.lit_lamps() == {"lane 1"}
    played.look(("lane 2", 0.5))
    played.look(("lane 3", 0.5))
    assert not seen(played)[-1] & {"lane 1", "lane 2", "lane 3"}


def test_drop_target_is_lit_while_it_is_down_and_a_full_bank_blinks(played: Table) -> None:
    played.look(("drop 1", 0.5))
    assert seen(played)[-1] == {"drop 1"}
    played.look(("drop 2", 0.5))
    played.wait(FALL)
    lit = [each & {"drop 1", "drop 2"} for each in seen(played)]
    assert set(lit) == {frozenset(), frozenset({"drop 1", "drop 2"})}
    assert lit.count(frozenset()) == pytest.approx(len(lit) / 2, abs=1.1)  # half of the time, to a step at either end


def test_lock_that_counts_is_lit() -> None:
    each = Table(table("bumper a", "spinner", "hole", balls=2))  # without a mode that its hole could begin
    each.play()
    each.game.sheet.lit = True
    assert seen(each)[-1] == {"lock"}


def test_mode_blinks_at_what_it_counts(played: Table) -> None:
    modes = played.game.modes
    modes.mode, modes.left, modes.to_go = modes.modes[0], 30.0, 12
    assert modes.mode.roles == ("bumper",)
    played.put(0, OPEN)
    assert set(seen(played)) == {frozenset(), frozenset({"bumper a"})}


def test_tilted_table_is_dark(played: Table) -> None:
    played.look(("lane 2", 0.5))
    assert played.game.lit_lamps()
    played.game.nudge.tilted = True
    assert played.game.lit_lamps() == frozenset()


def test_looking_at_lamps_changes_nothing(played: Table) -> None:
    played.look(("lane 2", 0.5))
    other = copy.deepcopy(played.game)
    for _ in range(3):
        other.lit_lamps()
    assert [copy.deepcopy(other).lit_lamps(), other.display_lines()] == [
        played.game.lit_lamps(),
        played.game.display_lines(),
    ]
