"""Coefficients: how pymunk, which multiplies the figures of two shapes, is made to use a pair's own.

Each surface gets a factor such that the product of two factors is the coefficient of the pair. Where no such
factors exist, the pairs that stay wrong are listed, and set contact by contact.
"""

import math

import numpy as np

from sandbox.trajectory import BoolArray, FloatArray

TOLERANCE = 2.0**-51
"""Relative; two roundings, of a square root or quotient and of the product."""


def factors(wanted: FloatArray, touching: BoolArray, stated: list[float | None]) -> list[float]:
    """Return a factor for each of S surfaces whose products best meet the wanted coefficients.

    Args:
        wanted: (S, S) coefficients, symmetric.
        touching: (S, S) which pairs can meet; the others do not matter.
        stated: what each surface states of its own.

    The plain reading comes first: a stated figure, and 1 where none is. If some product is wrong then, the
    factors are solved for: they are square roots on the diagonal, quotients along each further pair.
    """
    plain = [1.0 if value is None else value for value in stated]
    if not wrong_pairs(wanted, touching, plain):
        return plain
    solved = _solved(wanted, touching)
    return min(plain, solved, key=lambda f: len(wrong_pairs(wanted, touching, f)))


def wrong_pairs(wanted: FloatArray, touching: BoolArray, factor: list[float]) -> list[tuple[int, int]]:
    """Return the pairs that can meet and whose product of factors is not the wanted coefficient."""
    with np.errstate(over="ignore"):  # of a factor that is the quotient by a tiny one; it is wrong then
        off = np.abs(np.outer(factor, factor) - wanted) > TOLERANCE * wanted
    rows, columns = np.nonzero(np.triu(off & touching))
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def _solved(wanted: FloatArray, touching: BoolArray) -> list[float]:
    """Solve f_a·f_b = wanted over the pairs that can meet, as far as it can be solved.

    Starting from surfaces that meet their own kind, whose factor is fixed, values spread along the pairs.
    """
    size = len(wanted)
    factor: list[float | None] = [None] * size
    own = [a for a in range(size) if touching[a, a]]
    for seed in (*own, *range(size)):
        if factor[seed] is not None:
            continue
        factor[seed] = math.sqrt(wanted[seed, seed]) if touching[seed, seed] else _free_factor(wanted, touching, seed)
        queue = [seed]
        while queue:
            a = queue.pop()
            base = factor[a]
            for b in range(size):
                if factor[b] is None and touching[a, b] and not touching[b, b] and base:
                    quotient = float(wanted[a, b]) / base
                    if math.isfinite(quotient):
                        factor[b] = quotient
                        queue.append(b)
    return [0.0 if value is None else value for value in factor]


def _free_factor(wanted: FloatArray, touching: BoolArray, surface: int) -> float:
    """Return 1, or 0 for a surface none of whose pairs has a coefficient."""
    return 1.0 if (wanted[surface][touching[surface]] > 0).any() else 0.0
