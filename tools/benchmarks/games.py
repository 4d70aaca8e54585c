"""Rows of games: billiard shots against pooltool, pinball, changes of parameters, and shots on threads."""

from sandbox.scene.files.load import load
from tools.benchmarks import agreement, drawing, pooltool_shots
from tools.benchmarks.row import Bench
from tools.benchmarks.workloads import fanning, playing, running, scene, setting, shooting, simulated, stepping

GAMES = (
    *(
        Bench(
            f"shot-{name.replace('_', '-')}",
            "a full shot to rest, events kept, exact engine / the same shot by pooltool as it is installed",
            lambda name=name: shooting(load(pooltool_shots.path(name))),
            lambda name=name: pooltool_shots.peer(name),
            1.0 / (300.0 if name == "three_cushions" else 1000.0),
            missing=pooltool_shots.missing,
        )
        for name in pooltool_shots.NAMES
    ),
    Bench(
        "run-break",
        "sandbox.run of the 9-ball break, 2,001 frames, exact engine / pooltool's search for its events, no frames",
        lambda: running(load(pooltool_shots.path("nine_ball_break")), engine="exact"),
        lambda: pooltool_shots.peer("nine_ball_break"),
        1.0 / 20.0,
        missing=pooltool_shots.missing,
    ),
    *(
        Bench(
            f"shot-{name.replace('_', '-')}-corrected",
            "the same / by pooltool with touching balls and degenerate quartics corrected",
            lambda name=name: shooting(load(pooltool_shots.path(name))),
            lambda name=name: pooltool_shots.peer(name, corrected=True),
            missing=pooltool_shots.missing,
        )
        for name in pooltool_shots.NAMES
    ),
    *(
        Bench(
            f"pinball-{name}",
            "seconds of a game in one: 1 kHz, rules, random player, contacts, not audited / of the table bare, its "
            "ball at rest",
            lambda name=name: playing(scene(f"pinball/{name}")),
            lambda name=name: simulated(scene(f"pinball/{name}"), 20.0),
            60.0,
            "s/s",
            rate=True,
        )
        for name in ("classic", "full")
    ),
    *(
        Bench(
            f"set-{name.partition('/')[2]}",
            f"{path} set while {name} runs / a step of it",
            lambda name=name, path=path, values=values: setting(scene(name), 100, path, values),
            lambda name=name: stepping(scene(name), 100, record=False),
            5.0,
        )
        for name, path, values in (
            ("pinball/full", "world.gravity", ([0.0, -1.0], [0.0, -1.1])),
            ("games/curling", "surface.sliding_friction", (0.015, 0.014)),
        )
    ),
    Bench(
        "pinball-frames",
        "pictures a second of pinball/full in play / of the same without cached static elements",
        lambda: drawing.played(scene("pinball/full", "world.duration=8.0"), kept=True),
        lambda: drawing.played(scene("pinball/full", "world.duration=8.0"), kept=False),
        unit="frames/s",
        rate=True,
    ),
    Bench(
        "shots-threads",
        "9-ball breaks a second, in a fan on two threads / on one",
        lambda: fanning(load(pooltool_shots.path("nine_ball_break")), 2000, 2),
        lambda: fanning(load(pooltool_shots.path("nine_ball_break")), 2000, 1),
        unit="shots/s",
        rate=True,
        same=lambda: agreement.threads(load(pooltool_shots.path("nine_ball_break"))),
    ),
)
