"""Observation of pinball for an environment: panel and lamps as numbers."""

from tests.games.pinball.pinball_by_hand import OPEN, Table, table

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
