"""Delta debugging: the smallest part of a list for which something still holds.

Zeller and Hildebrandt, Simplifying and isolating failure-inducing input, IEEE Trans. Software Eng. 28 (2002), their
`ddmin`: keep a part, or leave a part out, of 2, 4, 8 … parts.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

T = TypeVar("T")


def least(items: Sequence[T], holds: Callable[[tuple[T, ...]], bool]) -> tuple[T, ...]:
    """Return a part of items, in their order, for which `holds` is true, and false if any one more is left out.

    About 2·log₂(N) calls where a single item matters, at worst N² + 3·N. A smaller part for which it is true too may
    exist, if it lacks several at once.

    Args:
        items: N of them; `holds` is true of all together.
        holds: asked of parts; the same part may be asked for again.
    """
    if items and holds(()):
        return ()
    kept, parts = tuple(items), 2
    while len(kept) > 1:
        bounds = [len(kept) * k // parts for k in range(parts + 1)]
        cuts = [(bounds[k], bounds[k + 1]) for k in range(parts)]
        for begin, end in cuts:
            if holds(kept[begin:end]):
                kept, parts = kept[begin:end], 2
                break
        else:
            for begin, end in cuts if parts > 2 else ():  # of two, each leaves out the other
                if holds(kept[:begin] + kept[end:]):
                    kept, parts = kept[:begin] + kept[end:], max(parts - 1, 2)
                    break
            else:
                if parts >= len(kept):
                    break
                parts = min(2 * parts, len(kept))
    return kept
