"""Rows of games: billiard shots against pooltool, pinball, changes of parameters, and shots on threads."""

from functools import partial

from sandbox.scene.files.load import load
from tools.benchmarks import agreement, drawing, pooltool_shots
from tools.benchmarks.row import Bench
from tools.benchmarks.workloads import (
    batch,
    fanning,
    playing,
    running,
    scene,
    setting,
    shooting,
    simulated,
    single_shot,
    stepping,
)

CORRECTED = "pooltool with four corrections, and so with the same events"
TABLES = {name: load(pooltool_shots.path(name)) for name in pooltool_shots.NAMES}

GAMES = (
    *(
        Bench(
            f"shot-{name.replace('_', '-')}{suffix}",
            f"{about}, on exact / {CORRECTED}, one shot",
            lambda name=name, workload=workload: workload(TABLES[name]),
            lambda name=name: pooltool_shots.peer(name, corrected=True),
            target,
            missing=pooltool_shots.missing,
            same=partial(agreement.shot, name),
        )
        for name in pooltool_shots.COMPARED
        for suffix, about, workload, target in (
            ("", "one shot to rest, with the list of its events", single_shot, None),
            (
                "-arrays",
                "a shot of 200 to rest, one after the other, events as arrays",
                shooting,
                1.0 / (300.0 if name == "three_cushions" else 1000.0),
            ),
            ("-batch", "a shot of 200 in one call, final positions without events", batch, None),
        )
    ),
    Bench(
        "run-break",
        f"sandbox.run of the 9-ball break, 2,001 frames, on exact / {CORRECTED}, without frames",
        lambda: running(TABLES["nine_ball_break"], engine="exact"),
        lambda: pooltool_shots.peer("nine_ball_break", corrected=True),
        1.0 / 20.0,
        missing=pooltool_shots.missing,
        same=partial(agreement.shot, "nine_ball_break"),
    ),
    *(
        Bench(
            f"shot-{name.replace('_', '-')}-installed",
            "one shot to rest, with the list of its events, on exact / the shot by pooltool as it is installed",
            lambda name=name: single_shot(TABLES[name]),
            lambda name=name: pooltool_shots.peer(name),
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
        lambda: fanning(TABLES["nine_ball_break"], 2000, 2),
        lambda: fanning(TABLES["nine_ball_break"], 2000, 1),
        unit="shots/s",
        rate=True,
        same=lambda: agreement.threads(TABLES["nine_ball_break"]),
    ),
)
