"""Finders: which kind of them suits a roster."""

from sandbox.engines.reference.ball_finder import BallFinder
from sandbox.engines.reference.finder import Finder
from sandbox.engines.reference.piece_finder import PieceFinder
from sandbox.engines.reference.sieve import Sieve
from sandbox.engines.roster import Roster


def finder_of(roster: Roster, broad_phase: str, sieve: Sieve | None) -> Finder:
    """Return what finds the contacts of a roster's bodies.

    Args:
        roster: of the bodies.
        broad_phase: by its word.
        sieve: what keeps apart those near each other that do not meet, where something does.
    """
    kind = PieceFinder if pieced(roster) else BallFinder
    finder = kind(roster, broad_phase)
    finder.sieve = sieve
    return finder


def suits(finder: Finder, roster: Roster) -> bool:
    """Tell whether a finder is still of the kind that a roster wants: if not, its keys mean other pairs."""
    return isinstance(finder, PieceFinder) == pieced(roster)


def pieced(roster: Roster) -> bool:
    """Tell whether bodies are looked at piece by piece, wherever those lie: not all are discs about their centres."""
    return roster.meet.solids or len(roster.drives) > 0
