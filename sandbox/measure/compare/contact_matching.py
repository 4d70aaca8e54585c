"""Matching of the contacts of a run with those of the truth, pair by pair."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from sandbox.measure.metrics.contacts import MAX_EPISODE_GAP, ContactEpisode, contact_episodes
from sandbox.measure.metrics.trajectory_error import divergence_times
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Trajectory

UNMATCHED_STEPS = 5.0
"""Cost, in steps, of a contact without a partner. Two contacts can match if they are less than twice this apart."""
END_MARGIN = 2.0
"""Steps before the end in which an unmatched contact does not count: its partner may lie beyond the end."""

MatchKind = Literal["matched", "missed", "phantom", "after_divergence"]
Choice = Literal["match", "above", "left"]


@dataclass(frozen=True)
class ContactMatch:
    """Contact of the truth and the matching contact of the run; values of a missing contact are None."""

    kind: MatchKind
    between: tuple[str, str]
    time: float | None
    """s, time in the truth"""
    engine_time: float | None
    """s, time in the run"""
    delta_time: float | None = None
    """s, positive if the run is late"""
    delta_position: float | None = None
    """m, distance between the contact points at the first touch"""
    delta_impulse: float | None = None
    """N·s, size of the difference of the impulses; None if the contact lasts beyond the end"""
    lasting: bool = False
    """whether it is a lasting contact, or a series of impacts too fast to be resolved, and not a single impact"""

    @property
    def when(self) -> float:
        """The earlier of the two times, s."""
        return min(time for time in (self.time, self.engine_time) if time is not None)


def match_contacts(
    run: Trajectory, truth: Trajectory, scene: Scene, dt: float, tolerance: float, until: float
) -> tuple[ContactMatch, ...]:
    """Match the contacts of a run with those of the truth, and return all of them in the order of time.

    Contact rows that no fixed step could separate are merged into episodes first (`contact_episodes`). The episodes of
    a pair are matched in order so that the sum of |Δt| and of `UNMATCHED_STEPS` steps for each unmatched one is
    smallest. An unmatched contact of the truth is missed, one of the run is phantom, with three exceptions: part of a
    contact that lasts in both is neither; a contact within `END_MARGIN` steps of the end does not count; and if one of
    the two bodies had an error larger than the tolerance before, it is `after_divergence`, because the contact can then
    have another time, position or partner.

    Args:
        run: the run.
        truth: the truth.
        scene: scene of both.
        dt: common step, s.
        tolerance: tolerance of positions, m; surfaces that are no farther apart count as being in contact.
        until: end of the contacts that count, s.
    """
    beyond = until + 2.0 * UNMATCHED_STEPS * dt
    # The impulse of a contact beyond the end includes the part beyond it, unless both runs end there.
    end_of_sums = until if until < max(run.time[-1], truth.time[-1]) else math.inf
    run_episodes, truth_episodes = (contact_episodes(each, scene, dt, tolerance, beyond) for each in (run, truth))
    found: list[ContactMatch] = []
    diverged_at = divergence_times(run, truth, tolerance)
    for pair in sorted({*run_episodes, *truth_episodes}):
        names = _body_name(scene, pair[0]), _body_name(scene, pair[1])
        of_truth, of_run = truth_episodes.get(pair, []), run_episodes.get(pair, [])
        partners = match_times([t.start for t in of_truth], [t.start for t in of_run], UNMATCHED_STEPS * dt)
        for k, n in partners:
            if of_truth[k].start <= until:
                found.append(_matched(names, of_truth[k], of_run[n], dt, end_of_sums))
        last_start = until - END_MARGIN * dt
        sides: tuple[tuple[Literal["missed", "phantom"], list[ContactEpisode], list[ContactEpisode], set[int]], ...] = (
            ("missed", of_truth, of_run, {k for k, _ in partners}),
            ("phantom", of_run, of_truth, {n for _, n in partners}),
        )
        for kind, episodes, others, taken in sides:
            unmatched = [touch for k, touch in enumerate(episodes) if k not in taken and touch.start <= last_start]
            first_divergence = min(float(diverged_at[number]) for number in pair if number >= 0)
            found += [
                _unmatched(kind, touch.start > first_divergence, names, touch, dt)
                for touch in unmatched
                if not _is_part_of_lasting(touch, others, dt)
            ]
    return tuple(sorted(found, key=lambda event: (event.when, event.between)))


def match_times(truth: Sequence[float], run: Sequence[float], gap: float) -> list[tuple[int, int]]:
    """Match two ascending lists of times in order, so that Σ|Δt| + cost · (number of unmatched times) is smallest.

    Equivalently, the gain Σ(2·cost − |Δt|) of the matches is largest. `best[j]` is the largest gain for the truth so
    far and the first j times of the run. Times that are 2·cost or more apart cannot match, so that `best` is constant
    beyond that band: time and memory are proportional to the width of the band, not to the product of the lengths.

    Args:
        truth: times of the truth.
        run: times of the run.
        gap: cost of an unmatched time.

    Returns:
        Pairs of indices, ascending in both.
    """
    best = [0.0]
    # For each time of the truth, the start of its band and the best choices in it.
    rows: list[tuple[int, list[Choice]]] = []
    low = high = 0
    for time in truth:
        while high < len(run) and run[high] < time + 2.0 * gap:
            high += 1
        while low < high and run[low] <= time - 2.0 * gap:
            low += 1
        best += [best[-1]] * (high + 1 - len(best))
        choices: list[Choice] = []
        diagonal = best[low]  # of the row above, which is overwritten
        for j in range(low, high):
            gained, above = diagonal + 2.0 * gap - abs(run[j] - time), best[j + 1]
            diagonal = above
            best[j + 1] = max(gained, above, best[j])
            choices.append("match" if gained == best[j + 1] else "above" if above == best[j + 1] else "left")
        rows.append((low, choices))

    found: list[tuple[int, int]] = []
    j = len(run)
    for i in range(len(rows) - 1, -1, -1):
        low, choices = rows[i]
        j = min(j, low + len(choices))
        while j > low and choices[j - low - 1] == "left":
            j -= 1
        if j > low and choices[j - low - 1] == "match":
            j -= 1
            found.append((i, j))
    return found[::-1]


def _is_part_of_lasting(touch: ContactEpisode, others: Sequence[ContactEpisode], dt: float) -> bool:
    """Return whether a lasting contact overlaps in time a lasting contact of the other run."""
    return _is_lasting(touch, dt) and any(
        _is_lasting(other, dt) and other.start <= touch.end and touch.start <= other.end for other in others
    )


def _is_lasting(touch: ContactEpisode, dt: float) -> bool:
    return touch.end - touch.start > MAX_EPISODE_GAP * dt


def _matched(
    names: tuple[str, str], of_truth: ContactEpisode, of_run: ContactEpisode, dt: float, cut: float
) -> ContactMatch:
    lasting = _is_lasting(of_truth, dt) or _is_lasting(of_run, dt)
    open_ended = max(of_truth.end, of_run.end) > cut and lasting
    return ContactMatch(
        "matched",
        names,
        of_truth.start,
        of_run.start,
        of_run.start - of_truth.start,
        math.dist(of_truth.point, of_run.point),
        None if open_ended else math.dist(of_truth.impulse, of_run.impulse),
        lasting,
    )


def _unmatched(
    kind: Literal["missed", "phantom"], diverged: bool, names: tuple[str, str], touch: ContactEpisode, dt: float
) -> ContactMatch:
    time, engine_time = (touch.start, None) if kind == "missed" else (None, touch.start)
    return ContactMatch(
        "after_divergence" if diverged else kind, names, time, engine_time, lasting=_is_lasting(touch, dt)
    )


def _body_name(scene: Scene, number: int) -> str:
    return scene.bodies.names[number] if number >= 0 else scene.fixed_names[-1 - number]
