"""Advice for a game with its runs: a ball that falls, and a bullet that tunnels through a wall in one of them.

Names are hostile texts. Lengths are in units of 0.5 px, the y axis points down.
"""

from collections.abc import Mapping

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.game_advice.difference import GameTruth, difference_from
from sandbox.measure.game_advice.result import GameAdvice, GameSetting, GameSettingChange, PlaysHeld
from sandbox.measure.game_advice.step_code import StepCode
from sandbox.measure.proportion import Proportion
from sandbox.rehearsal.rehearse import CallbackCalls, Rehearsal
from sandbox.rehearsal.space_log import GameCallback, GameShape
from sandbox.rehearsal.step_settings import RehearsalSettings
from tests.report.html.page_documents import HOSTILE

FRAMES = 121
DURATION = 2.0
ZOOM = 0.5
TOLERANCE_PX = 1.0
WINDOW = 400, 300
BALL, BULLET, POST = 0, 1, 2
FIRED, HIT = 30, 59
"""Frames in which the game adds the bullet, and in which it hits the wall"""
TAKEN = 90
"""Frame in which the game removes the coin"""
LAG = 6.0
"""Units by which the ball of the present setting is off in the end"""
WALL, COIN, BALL_SHAPE, POST_SHAPE, BULLET_SHAPE = range(5)


def rehearsal(
    settings: RehearsalSettings, *, hits: bool, lag: float = 0.0, frames: int = FRAMES, gravity: float = 900.0
) -> Rehearsal:
    """Return a run of the game.

    Args:
        settings: of the run.
        hits: whether the bullet hits the wall, and is removed.
        lag: by which the ball is off in the end, in units.
        frames: number of frames.
        gravity: of the space along y; positive values are those of a game with y down.
    """
    numbers, states = list[list[int]](), list[FloatArray]()
    for frame in range(frames):
        present = [BALL, POST] if frame < FIRED or (hits and frame >= HIT) else [BALL, BULLET, POST]
        rows = np.zeros((3, 6))
        rows[BALL, :3] = 100.0 + lag * frame / (FRAMES - 1), 50.0 + 3.0 * frame, 0.05 * frame
        rows[BULLET, :2] = 100.0 + 20.0 * (frame - FIRED), 200.0
        rows[POST, :2] = 300.0, 500.0
        numbers.append(present)
        states.append(rows[present])
    return Rehearsal(
        settings=settings,
        offsets=np.cumsum([0, *map(len, numbers)]),
        bodies=np.concatenate([np.array(each) for each in numbers]),
        states=np.concatenate(states),
        callbacks=(GameCallback(f"Game.{HOSTILE}", "bullet", "wall", "begin"),),
        calls=(CallbackCalls(HIT, 0, (WALL, BULLET_SHAPE), 1),) if hits else (),
        shape_bodies=dict(enumerate((-1, -1, BALL, POST, BULLET))),
        shapes=dict(
            enumerate(
                (
                    GameShape("segment", ((690.0, 0.0), (690.0, 600.0)), 4.0, False),
                    GameShape("circle", ((200.0, 100.0),), 9.0, True),
                    GameShape("circle", ((0.0, 0.0),), 20.0, False),
                    GameShape("polygon", ((-10.0, -5.0), (10.0, -5.0), (10.0, 15.0), (-10.0, 15.0)), 0.0, False),
                    GameShape("circle", ((0.0, 0.0),), 2.0, False),
                )
            )
        ),
        changes=(),
        shape_changes=((FIRED, True, BULLET_SHAPE), (TAKEN, False, COIN)),
        body_names={BALL: f"{HOSTILE} ball"},
        own_settings={"iterations": 10.0, "slop": 0.1},
        gravity=(0.0, gravity),
        window=WINDOW,
        dts=(1 / 60, 1 / 60, 1 / 60),
        step_calls=(("game.py", 12),),
        has_forces=False,
        impulse_readers=(),
        hashes=(),
        steps=frames,
        ended="inputs",
        failure=None,
        seconds=1.0,
        step_seconds=0.1,
        output="",
    )


def runs() -> dict[str, Rehearsal]:
    """Return the runs to show."""
    return {
        "truth": rehearsal(RehearsalSettings(substeps=64), hits=True),
        "present": rehearsal(RehearsalSettings(), hits=False, lag=LAG),
        "recommended": rehearsal(RehearsalSettings(substeps=4), hits=True, lag=0.5),
    }


def setting(run: Rehearsal, truth: GameTruth, changed: Mapping[str, float], physics_ms: float) -> GameSetting:
    """Return the setting of a run."""
    found = difference_from(truth, run, TOLERANCE_PX / ZOOM)
    return GameSetting(
        substeps=run.settings.substeps,
        iterations=10,
        changed=changed,
        error_px=ZOOM * found.error,
        body=found.body,
        time=None if found.frame is None else found.frame / 60,
        within_until=None if found.within_until is None else found.within_until / 60,
        callbacks=found.callbacks,
        physics_ms=physics_ms,
        is_within=ZOOM * found.error <= TOLERANCE_PX and not found.differing,
        errors_px=tuple((ZOOM * found.by_frame).tolist()),
    )


def game_advice(shown: Mapping[str, Rehearsal]) -> GameAdvice:
    """Return the advice for the game with its runs."""
    truth = GameTruth(shown["truth"], {}, frozenset())
    present = setting(shown["present"], truth, {}, 0.2)
    recommended = setting(shown["recommended"], truth, {"substeps": 4}, 0.7)
    return GameAdvice(
        program="game.py",
        frames=FRAMES,
        duration=DURATION,
        bodies=3,
        tolerance_px=TOLERANCE_PX,
        zoom=ZOOM,
        dts=(1 / 60, 1 / 60, 1 / 60),
        truth_frames=FRAMES,
        truth_substeps=64,
        truth_error_px=0.125,
        known_fraction=0.75,
        unknown_from={f"{HOSTILE} ball": 1.5},
        present=present,
        recommended=recommended,
        most_accurate=None,
        changes=(GameSettingChange("substeps 1 → 4", recommended), GameSettingChange("iterations 10 → 20", present)),
        plays=PlaysHeld(Proportion(1, 10), Proportion(9, 10), 0.2),
        code=StepCode("game.py", 12, "    space.step(dt)", ("    for _ in range(4):", f"        x({HOSTILE!r})")),
        remarks=(f"a remark on {HOSTILE}",),
        tried=7,
        runs=41,
        seconds=12.0,
        out_of_time=False,
        machine={"cpu": "a <processor>"},
        versions={"python": "3"},
    )
