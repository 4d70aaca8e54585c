"""Study of a game: a truth by refinement of the game itself, and the cheapest setting that keeps to it.

All runs are rehearsals, each in a process of its own, as many at a time as the machine has cores.
"""

import os
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sandbox.game_inputs import GameInputs
from sandbox.measure.game_advice.difference import IN_TIME, GameTruth, apart_spans, difference_from, unmatched
from sandbox.measure.game_advice.repeatability import Mismatch, first_mismatch, likely_causes
from sandbox.measure.game_advice.result import GameAdvice, GameSetting, GameSettingChange, PlaysHeld
from sandbox.measure.game_advice.step_code import StepCode, step_code
from sandbox.measure.proportion import Proportion
from sandbox.progress import Progress, ProgressCallback
from sandbox.provenance import machine, versions
from sandbox.recording_remarks import MIN_PIXELS
from sandbox.rehearsal.rehearse import Rehearsal, RehearsalError, kill_rehearsals, rehearse
from sandbox.rehearsal.space_log import GameShape
from sandbox.rehearsal.step_settings import Nudge, RehearsalSettings

FIRST_TRUTH = 16
"""Substeps of the first run that is tried as the truth"""
LAST_TRUTH = 256
"""Substeps of the last one"""
TRUTH_FRACTION = 0.25
"""Fraction of the tolerance by which the truth may differ from the run with half its substeps, and from a run perturbed
by rounding; where it differs by more, the position of the body is not known"""
ROUNDING = 1e-9
"""Displacement at the start, relative to the tolerance, that stands for rounding"""
GAIN = 1.05
"""Ratio of the known positions from which on a finer truth is worth its time"""
SUBSTEPS = (2, 3, 4, 6, 8, 12, 16)
FACTORS = (2, 4)
"""Factors of the iterations of the game that are tried"""
ENOUGH = 3
"""Numbers of substeps within the tolerance after which no more are tried"""
SEARCH = 0.5
"""Fraction of the time limit that is left when no more settings are tried"""
MIN_PLAYS = 3
"""Plays that are made however long they take"""
PLAYED = 0.25
"""Fraction of the time limit that is left when no more plays are made"""
HELD = 0.9
"""Fraction of the plays in which a recommended setting keeps to the tolerance"""
SLOP_PX = 0.01
"""px, slop that is tried"""
STIFF_JOINT = 0.5
"""Fraction of the error of a joint that is left after a step, in a setting that is tried"""
DEFAULT_PLAYS = 10
"""Plays that differ a little from the recorded one"""
DISPLACEMENT = 0.1
"""px, displacement of all bodies at the start of such a play"""
DEFAULT_TOLERANCE_PX = 1.0
DEFAULT_TIME_LIMIT = 60.0
"""s"""
TIMINGS = 3
"""Runs of the present and the recommended setting of which the fastest gives the cost"""
MAX_NAMED = 8
"""Bodies whose unknown positions are named"""


class NotRepeatableError(Exception):
    """Two runs of a game with the same inputs and settings differ."""


class GameFailedError(Exception):
    """The game fails in a rehearsal."""


@dataclass(frozen=True, kw_only=True)
class _Play:
    """What a rehearsal depends on besides the inputs."""

    settings: RehearsalSettings
    nudge: Nudge | None = None
    jitter_seed: int | None = None


class GameStudy:
    """Study of one game.

    Args:
        program: path of the program.
        inputs: recorded inputs.
        tolerance_px: accepted error, px.
        zoom: px per unit of length of the game; None for 1 if its shapes have the sizes of pixel graphics, and for
            50 if not.
        plays: number of plays that differ a little from the recorded one.
        time_limit: s after which no further settings and plays are tried.
        on_progress: progress callback.
    """

    def __init__(
        self,
        program: str | Path,
        inputs: GameInputs,
        *,
        tolerance_px: float = DEFAULT_TOLERANCE_PX,
        zoom: float | None = None,
        plays: int = DEFAULT_PLAYS,
        time_limit: float = DEFAULT_TIME_LIMIT,
        on_progress: ProgressCallback | None = None,
    ) -> None:
        self._program, self._inputs = program, inputs
        self._tolerance_px, self._given_zoom = tolerance_px, zoom
        self._zoom, self._tolerance = 1.0, tolerance_px
        self._plays_wanted, self._time_limit, self._on_progress = plays, time_limit, on_progress
        self._start = time.monotonic()
        self._draws = True
        self.truth: GameTruth | None = None
        """truth of the advice; None before"""
        self.shown: dict[str, Rehearsal] = {}
        """runs to look at: `truth`, `present` and `recommended` or `most accurate`"""
        self._runs: dict[_Play, Future[Rehearsal]] = {}
        self._count = 0
        self._is_out_of_time = False
        self._pool = ThreadPoolExecutor(max_workers=os.cpu_count() or 1)

    def advise(self) -> GameAdvice:
        """Return the advice.

        Raises:
            NotRepeatableError: two runs with the same inputs and settings differ.
            GameFailedError: the game fails with its own settings.
        """
        try:
            own = self._own_run()
            self._zoom = self._given_zoom or guessed_zoom(own)
            self._tolerance = self._tolerance_px / self._zoom
            truth, truth_error = self._truth()
            present = self._measured(own, truth)
            changes = self._changes(own, truth)
            tried = self._tried(own, changes, truth)
            candidates = [present, *(each.setting for each in changes), *tried]
            recommended, best, plays = self._recommended(own, candidates, truth)
            self.truth = truth
            self.shown = {"truth": truth.run, "present": own}
            if best.changed:
                name = "most accurate" if recommended is None else "recommended"
                self.shown[name] = self._run(_Play(settings=RehearsalSettings(**_given(best)))).result()
            return self._advice(own, truth, truth_error, present, recommended, best, changes, plays, tried)
        except BaseException:  # such as Ctrl-C
            self._pool.shutdown(wait=False, cancel_futures=True)
            kill_rehearsals()
            raise
        finally:
            self._pool.shutdown(cancel_futures=True)

    # Runs

    def _own_run(self) -> Rehearsal:
        """Return the run with the settings of the game, after a check that it can be repeated."""
        self._report("the game with its own settings")
        drawn = [self._pool.submit(self._rehearse, _Play(settings=RehearsalSettings()), True) for _ in range(2)]
        plain = self._pool.submit(self._rehearse, _Play(settings=RehearsalSettings()), False)
        first, second = (each.result() for each in drawn)
        if first.failure is not None:
            raise GameFailedError(f"it fails in a rehearsal: {first.failure}\n{first.output.strip()}")
        mismatch = first_mismatch(first, second)
        if mismatch is not None:
            raise NotRepeatableError(mismatch_text(mismatch, self._program, self._inputs))
        if not first.steps:
            raise GameFailedError("no pymunk space makes a step")
        # Drawing is left out if the game does not depend on it.
        self._draws = first_mismatch(first, plain.result()) is not None
        return first if self._draws else plain.result()

    def _rehearse(self, play: _Play, draws: bool) -> Rehearsal:
        self._count += 1
        return rehearse(
            self._program,
            self._inputs,
            play.settings,
            nudge=play.nudge,
            jitter_seed=play.jitter_seed,
            draws=draws,
        )

    def _run(self, play: _Play) -> Future[Rehearsal]:
        """Start a run, unless it has been started before."""
        if play not in self._runs:
            self._runs[play] = self._pool.submit(self._rehearse, play, self._draws)
        return self._runs[play]

    @property
    def _time_left(self) -> float:
        return self._time_limit - (time.monotonic() - self._start)

    # GameTruth

    def _truth(self) -> tuple[GameTruth, float]:
        """Return the truth, and its distance from the run with half its substeps."""
        limit = TRUTH_FRACTION * self._tolerance
        substeps, best = FIRST_TRUTH, None
        coarse = self._run(_Play(settings=RehearsalSettings(substeps=substeps // 2)))
        while True:
            self._report(f"truth: {substeps} substeps")
            begun = time.monotonic()
            fine = self._run(_Play(settings=RehearsalSettings(substeps=substeps)))
            found = _truth_of(fine.result(), coarse.result(), limit)
            has_gained = best is None or found.known_fraction > GAIN * best.known_fraction
            best = found if best is None or found.known_fraction >= best.known_fraction else best
            next_time = 2.0 * (time.monotonic() - begun)
            is_known = not found.unknown and not found.uncertain
            if is_known or not has_gained or substeps >= LAST_TRUTH or next_time > 0.2 * self._time_left:
                break
            coarse, substeps = fine, 2 * substeps
        used = best.run.settings
        self._report("truth: perturbed by rounding")
        nudge = Nudge(ROUNDING * self._tolerance, seed=1)
        twin = self._run(_Play(settings=used, nudge=nudge)).result()
        truth = _without_chaos(best, twin, limit)
        half = self._run(_Play(settings=replace(used, substeps=used.substeps // 2))).result()
        return truth, self._zoom * difference_from(truth, half, self._tolerance).error

    # Settings

    def _measured(self, run: Rehearsal, truth: GameTruth) -> GameSetting:
        """Return the error and the cost of a run."""
        difference = difference_from(truth, run, self._tolerance)
        own = {name: run.own_settings[name] for name in run.own_settings}
        settings = run.settings
        ends_in_time = difference.missing_frames <= IN_TIME
        is_within = (
            run.failure is None and ends_in_time and difference.error <= self._tolerance and not difference.differing
        )
        return GameSetting(
            substeps=settings.substeps,
            iterations=settings.iterations or int(own.get("iterations", 10)),
            changed=settings.changed,
            error_px=None if run.failure is not None else self._zoom * difference.error,
            body=difference.body,
            time=None if difference.frame is None else self._time_of(difference.frame),
            within_until=None if difference.within_until is None else self._time_of(difference.within_until),
            callbacks=difference.callbacks,
            physics_ms=1e3 * run.step_seconds / max(run.frames, 1),
            failure=run.failure,
            frames=run.frames,
            is_within=is_within,
            errors_px=tuple((self._zoom * difference.by_frame).tolist()),
        )

    def _time_of(self, frame: int) -> float:
        times = self._inputs.frame_times
        return times[min(frame, len(times) - 1)] if times else 0.0

    def _settings(self, settings: Iterable[RehearsalSettings], truth: GameTruth) -> list[GameSetting]:
        """Run settings, and return what was measured of each; those that fail are left out."""
        runs = [self._run(_Play(settings=each)) for each in settings]
        found = []
        for each in runs:
            try:
                found.append(self._measured(each.result(), truth))
            except RehearsalError:  # it exceeds the limits of time or memory, so that it is no candidate
                continue
        return found

    def _changes(self, own: Rehearsal, truth: GameTruth) -> tuple[GameSettingChange, ...]:
        """Return the effect of each single change."""
        self._report("one change at a time")
        iterations = int(own.own_settings.get("iterations", 10))
        slop, dt = own.own_settings["slop"], own.dts[1]
        wanted = [
            ("substeps 1 → 2", RehearsalSettings(substeps=2)),
            ("substeps 1 → 4", RehearsalSettings(substeps=4)),
            (f"iterations {iterations} → {2 * iterations}", RehearsalSettings(iterations=2 * iterations)),
            (f"iterations {iterations} → {4 * iterations}", RehearsalSettings(iterations=4 * iterations)),
        ]
        if iterations > 1:
            half = max(iterations // 2, 1)
            wanted.append((f"iterations {iterations} → {half}", RehearsalSettings(iterations=half)))
        small = SLOP_PX / self._zoom
        if slop > small:
            wanted.append((f"collision_slop {slop:.3g} → {small:.3g}", RehearsalSettings(slop=small)))
        if "joint_bias" in own.own_settings:
            stiff = STIFF_JOINT ** (1.0 / dt) if dt else 0.0
            bias = own.own_settings["joint_bias"]
            if stiff < bias:
                wanted.append((f"error_bias of joints {bias:.3g} → {stiff:.3g}", RehearsalSettings(joint_bias=stiff)))
        measured = self._settings((settings for _, settings in wanted), truth)
        names = {_key(settings.changed): change for change, settings in wanted}
        return tuple(GameSettingChange(names[_key(each.changed)], each) for each in measured)

    def _tried(self, own: Rehearsal, changes: Sequence[GameSettingChange], truth: GameTruth) -> list[GameSetting]:
        """Return settings with more substeps, until a few are within the tolerance, and with other iterations."""
        iterations = int(own.own_settings.get("iterations", 10))
        cores = os.cpu_count() or 1
        tried: list[GameSetting] = []
        within = [each.setting for each in changes if each.setting.is_within]
        known = {each.setting.substeps for each in changes if each.setting.changed.keys() == {"substeps"}}
        left = [each for each in SUBSTEPS if each not in known and each < truth.run.settings.substeps]
        self._report("substeps")
        end = SEARCH * self._time_limit
        while left and sum(each.substeps > 1 for each in within) < ENOUGH and self._time_left > end:
            found = self._settings([RehearsalSettings(substeps=each) for each in left[:cores]], truth)
            left = left[cores:]
            tried += found
            within += [each for each in found if each.is_within]
        # More iterations may save substeps, and fewer may do.
        self._report("iterations")
        limit = min((each.substeps for each in within), default=SUBSTEPS[-1])
        counts = [
            (substeps, factor * iterations) for substeps in (1, *SUBSTEPS) if substeps < limit for factor in FACTORS
        ]
        if iterations > 1:
            counts += [(each.substeps, iterations // 2) for each in within if each.iterations == iterations]
        highest = max((_cost(each.substeps, each.iterations / iterations) for each in within), default=float("inf"))
        costs = {each: _cost(each[0], each[1] / iterations) for each in counts}
        left_counts = sorted((each for each in costs if costs[each] < highest), key=costs.__getitem__)
        while left_counts and self._time_left > end:
            batch, left_counts = left_counts[:cores], left_counts[cores:]
            tried += self._settings([RehearsalSettings(substeps=n, iterations=k) for n, k in batch], truth)
        self._is_out_of_time |= self._time_left <= end
        return tried

    def _recommended(
        self, own: Rehearsal, candidates: Sequence[GameSetting], truth: GameTruth
    ) -> tuple[GameSetting | None, GameSetting, PlaysHeld]:
        """Return the cheapest setting that keeps to the tolerance, also in plays that differ a little.

        Returns:
            It, or None; the setting to choose, which without it is the most accurate one; the odds of the latter.
        """
        iterations = int(own.own_settings.get("iterations", 10))
        plays = self._plays(truth)
        present = sum(self._held(RehearsalSettings(), plays))
        within = sorted(
            {_key(each.changed): each for each in candidates if each.is_within}.values(),
            key=lambda each: _cost(each.substeps, each.iterations / iterations),
        )
        best: tuple[int, GameSetting] | None = None
        for each in within:
            held = sum(self._held(RehearsalSettings(**_given(each)), plays))
            if held >= HELD * len(plays):
                return each, each, self._odds(present, held, plays)
            if best is None or held > best[0]:
                best = held, each
            if self._time_left <= 0.0:
                self._is_out_of_time = True
                break
        if best is None:
            most_accurate = min(candidates, key=lambda each: (each.differing, _error(each)))
            return None, most_accurate, self._odds(present, None, plays)
        return None, best[1], self._odds(present, best[0], plays)

    def _odds(self, present: int, held: int | None, plays: Sequence[tuple[_Play, GameTruth]]) -> PlaysHeld:
        return PlaysHeld(
            Proportion(present, len(plays)),
            None if held is None else Proportion(held, len(plays)),
            DISPLACEMENT / self._zoom,
        )

    # Other plays

    def _plays(self, truth: GameTruth) -> list[tuple[_Play, GameTruth]]:
        """Return plays that differ a little from the recorded one, each with its truth, as many as the time allows."""
        fine = truth.run.settings.substeps
        plays: list[tuple[_Play, GameTruth]] = []
        for seed in range(2, 2 + self._plays_wanted):
            self._report(f"plays that differ a little: {len(plays)} of {self._plays_wanted}")
            nudge = Nudge(DISPLACEMENT / self._zoom, seed)
            play = _Play(settings=RehearsalSettings(), nudge=nudge, jitter_seed=seed)
            runs = [self._run(replace(play, settings=RehearsalSettings(substeps=each))) for each in (fine // 2, fine)]
            coarse, exact = (each.result() for each in runs)
            plays.append((play, _truth_of(exact, coarse, TRUTH_FRACTION * self._tolerance)))
            if len(plays) >= MIN_PLAYS and self._time_left <= PLAYED * self._time_limit:
                self._is_out_of_time |= len(plays) < self._plays_wanted
                break
        return plays

    def _held(self, settings: RehearsalSettings, plays: Sequence[tuple[_Play, GameTruth]]) -> list[bool]:
        """Return whether a setting keeps to the tolerance, in each of some plays."""
        runs = [self._run(replace(play, settings=settings)) for play, _ in plays]
        return [self._measured(run.result(), truth).is_within for run, (_, truth) in zip(runs, plays, strict=True)]

    # Result

    def _advice(
        self,
        own: Rehearsal,
        truth: GameTruth,
        truth_error: float,
        present: GameSetting,
        recommended: GameSetting | None,
        best: GameSetting,
        changes: tuple[GameSettingChange, ...],
        plays: PlaysHeld,
        tried: Sequence[GameSetting],
    ) -> GameAdvice:
        self._report("timing")
        present = self._timed(present)
        if recommended is not None:
            recommended = self._timed(recommended) if recommended.changed else present
        fine = truth.run
        code = None
        chosen = recommended or best
        if chosen.changed and own.step_calls:
            file, line = own.step_calls[0]
            has_forces = fine.has_forces
            code = step_code(file, line, chosen.substeps, chosen.changed, has_forces=has_forces)
        lost = [(body, frame) for body in truth.unknown if (frame := truth.lost_from(body)) is not None]
        unknown = sorted(lost, key=lambda each: each[1])[:MAX_NAMED]
        return GameAdvice(
            program=str(self._program),
            frames=own.frames,
            duration=self._inputs.duration,
            bodies=int(np.diff(own.offsets).max(initial=0)),
            tolerance_px=self._tolerance_px,
            zoom=self._zoom,
            dts=own.dts,
            truth_frames=fine.frames,
            truth_substeps=fine.settings.substeps,
            truth_error_px=truth_error,
            known_fraction=truth.known_fraction,
            unknown_from={fine.body_name(body): self._time_of(frame) for body, frame in unknown},
            present=present,
            recommended=recommended,
            most_accurate=None if recommended is not None else best,
            changes=changes,
            plays=plays,
            code=code,
            remarks=(
                *_remark_on_code(code),
                *remarks_on(own, chosen, self._zoom if self._given_zoom is None else None),
            ),
            tried=1 + len(changes) + len(tried),
            runs=self._count,
            seconds=time.monotonic() - self._start,
            out_of_time=self._is_out_of_time,
            machine=machine(),
            versions=versions(),
        )

    def _timed(self, setting: GameSetting) -> GameSetting:
        """Return a setting with the least time of a few runs, one after the other."""
        settings = RehearsalSettings(**_given(setting))
        runs = [self._rehearse(_Play(settings=settings), self._draws) for _ in range(TIMINGS)]
        return replace(setting, physics_ms=min(1e3 * run.step_seconds / max(run.frames, 1) for run in runs))

    def _report(self, message: str) -> None:
        if self._on_progress is not None:
            self._on_progress(Progress(message))


def _given(setting: GameSetting) -> dict[str, Any]:
    whole = ("substeps", "iterations", "persistence")
    return {name: int(value) if name in whole else value for name, value in setting.changed.items()}


def _key(changed: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    return tuple(sorted(changed.items()))


def _error(setting: GameSetting) -> float:
    return float("inf") if setting.error_px is None else setting.error_px


def _cost(substeps: int, iterations: float) -> float:
    """Return the estimated cost of a setting; iterations are relative to those of the game."""
    return substeps * (OTHER_WORK + iterations)


OTHER_WORK = 1.0
"""Work of a substep besides the iterations of the game's own setting, relative to them: detection of contacts. It
orders the settings that are tried; costs that are printed are measured."""


def _truth_of(fine: Rehearsal, coarse: Rehearsal, limit: float) -> GameTruth:
    """Return a run as the truth, as far as a coarser run agrees with it."""
    uncertain = unmatched(fine, coarse)
    return GameTruth(fine, apart_spans(fine, coarse, limit), uncertain, unmatched(coarse, fine))


def _without_chaos(truth: GameTruth, twin: Rehearsal, limit: float) -> GameTruth:
    """Return a truth that does not know a body where a run perturbed by rounding is apart from it."""
    unknown = {body: list(spans) for body, spans in truth.unknown.items()}
    for body, spans in apart_spans(truth.run, twin, limit).items():
        unknown.setdefault(body, []).extend(spans)
    return GameTruth(
        truth.run,
        unknown,
        truth.uncertain | unmatched(truth.run, twin),
        truth.doubtful | unmatched(twin, truth.run),
    )


def mismatch_text(mismatch: Mismatch, program: str | Path, inputs: GameInputs) -> str:
    """Return how two runs differ, and why they may."""
    causes = likely_causes(program, inputs)
    text = f"two runs with the same inputs and settings differ: {mismatch}"
    return "\n".join([text, *(f"likely cause: {each}" for each in causes)])


def _remark_on_code(code: StepCode | None) -> Iterable[str]:
    if code is not None and ".step(" not in code.old:
        yield (
            "this line makes the step through another function: the lines have the general names `space` and `dt`, "
            "and belong where the game calls Space.step"
        )


def guessed_zoom(run: Rehearsal) -> float:
    """Return the px per unit of length of a game.

    It is 1 if the moving shapes have the sizes of pixel graphics, or if the level is about as many units wide as the
    window has pixels.
    """
    sizes = [
        2.0 * _reach(shape)
        for shape, body in zip(run.shapes.values(), run.shape_bodies.values(), strict=True)
        if body >= 0
    ]
    if sizes and float(np.median(sizes)) >= MIN_PIXELS:
        return 1.0
    if run.window is not None:
        static = [
            shape.points for shape, body in zip(run.shapes.values(), run.shape_bodies.values(), strict=True) if body < 0
        ]
        points = np.concatenate([run.states[:, :2], *(np.reshape(each, (-1, 2)) for each in static)])
        extent = float(np.max(np.ptp(np.quantile(points, MIDDLE, axis=0), axis=0))) if len(points) else 0.0
        return 1.0 if extent >= MIN_WINDOW * max(run.window) else METRE
    return METRE


MIDDLE = (0.02, 0.98)
"""Quantiles of positions between which a level lies; a body that falls out of it does not count"""
MIN_WINDOW = 0.1
"""Extent of a level in units, relative to the pixels of the window, from which on the unit is the pixel. At 50 px per
metre it is 0.02."""
METRE = 50.0
"""px per unit of length of a game whose bodies are too small for pixels"""


def _reach(shape: GameShape) -> float:
    """Return half the size of a shape, in units of the game."""
    points = np.asarray(shape.points)
    return shape.radius + 0.5 * float(np.max(np.ptp(points, axis=0), initial=0.0))


def remarks_on(own: Rehearsal, chosen: GameSetting, guessed: float | None) -> Iterable[str]:
    """Yield what else matters for the setting of a game; `guessed` is the zoom, if it was not given."""
    if guessed == METRE:
        yield f"the unit of length is taken for a metre of {METRE:g} px; --zoom or --pixels states it"
    low, middle, high = own.dts
    places = [f"{Path(file).name}:{line}" for file, line in own.step_calls]
    if chosen.changed and len(places) > 1:
        yield (
            f"the game makes steps in {len(places)} places, all of which have the setting here; change the others in "
            f"the same way: {', '.join(places[1:])}"
        )
    elif high > low * (1.0 + VARIES):
        yield (
            f"the game steps by measured time, {1e3 * low:.3g} to {1e3 * high:.3g} ms (median {1e3 * middle:.3g} ms): "
            "its physics differs from play to play; step by a constant dt, and as often as the time of the frame needs"
        )
    if chosen.substeps > 1:
        for number in own.impulse_readers:
            yield (
                f"{own.callbacks[number]} reads the impulse or the energy of a contact, which are those of a substep: "
                f"sum impulses over the frame, or divide a threshold by {chosen.substeps}"
            )
        often = [each for each in own.callbacks if each.phase in ("pre_solve", "post_solve")]
        for each in often:
            yield f"{each} is called in each substep of a contact: {chosen.substeps} times as often"


VARIES = 1e-3
"""Relative difference of steps from which on they are measured times and no constant"""
