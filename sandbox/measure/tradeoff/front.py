"""Front: the settings that nothing beats, and what is beaten by a clear margin."""

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

T = TypeVar("T")


def pareto(items: Iterable[T], cost: Callable[[T], float], error: Callable[[T], float]) -> list[T]:
    """Return the items that no other beats in both, cheapest first; of equals the first.

    Args:
        items: to choose from.
        cost: of one, the lower the better.
        error: of one, the lower the better.
    """
    found: list[T] = []
    for item in sorted(items, key=lambda each: (cost(each), error(each))):
        if not found or error(item) < error(found[-1]):
            found.append(item)
    return found


def outdone(cost: float, error: float, others: Sequence[tuple[float, float]], margin: float) -> bool:
    """Tell whether another, (cost, error) each, is at least as right and cheaper by a margin, such as 0.8."""
    return any(its_cost <= margin * cost and its_error <= error for its_cost, its_error in others)
