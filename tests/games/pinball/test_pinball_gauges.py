"""What an environment observes of pinball: the panel and the lamps, as numbers."""

from tests.games.pinball.pinball_by_hand import OPEN, Table, table

NAMES = tuple(name for name, _ in Table(table()).game.observation())


def gauges(game: Table) -> dict[str, float]:
    return dict(game.game.observation())


def test_gauges_show_what_has_been_hit() -> None:
    game = Table(table())
    game.wait(0.05)
    game.put(0, OPEN)
    game.look()
    began = gauges(game)
    assert (began["ball"], began["balls in play"], began["bonus times"], began["player"]) == (1, 1, 1, 0)
    assert began["ball save"] == 8.0  # from the look at which the ball has left the lane
    assert not any(value for name, value in began.items() if name.endswith((" lit", " down")))

    game.look(("lane 2", 0.5))
    game.look(("standup 1", 0.5))
    game.look(("drop 1", 0.5))
    now = gauges(game)
    assert [now[f"lane {k} lit"] for k in (1, 2, 3)] == [0, 1, 0]
    assert (now["standup 1 lit"], now["drop 1 down"], now["drop 2 down"]) == (1, 1, 0)
    assert now["bonus"] == 100 + 100 + 200  # of a lane, a standing and a drop target
    assert 0.0 < now["ball save"] < began["ball save"]
    game.press("left flipper")
    assert [gauges(game)[f"lane {k} lit"] for k in (1, 2, 3)] == [1, 0, 0]  # lights go to the side of the flipper
    game.look(("drop 2", 0.5))
    assert gauges(game)["lock lit"] == 0
    game.wait(0.3)  # until the second target is down: a bank lights the lock
    assert gauges(game)["lock lit"] == 1
    game.look(("lock", 0.5))
    assert gauges(game)["locked"] == 1


def test_gauges_of_modes_and_tilt() -> None:
    game = Table(table())
    game.play()
    for k in (1, 2, 3):
        game.look((f"lane {k}", 0.5))
    assert gauges(game)["mode ready"] == 1
    game.look(("hole", 0.5))
    game.put(0, OPEN)
    began = gauges(game)
    assert (began["mode"], began["mode to go"], began["mode ready"]) == (1, 12, 0)
    game.wait(2.0)
    assert 27.0 < gauges(game)["mode left"] < began["mode left"]
    warned = [gauges(game)["warnings"]]
    while not gauges(game)["tilted"]:
        game.press("nudge")
        game.wait(0.2)
        warned.append(gauges(game)["warnings"])
    assert sorted({*warned}) == [0, 1, 2, 3]


def test_names_stay_the_same() -> None:
    game = Table(table())
    for _ in range(5):
        game.look(("lane 1", 0.5), ("drop 1", 0.5), ("drop 2", 0.5), ("hole", 0.5), ("drain", 0.5))
        game.wait(1.0)
        assert tuple(name for name, _ in game.game.observation()) == NAMES
    assert len(set(NAMES)) == len(NAMES)
