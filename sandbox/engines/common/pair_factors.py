"""Factors of surfaces whose products are the coefficients of pairs, for engines that mix values of two shapes.

pymunk multiplies the coefficients of two shapes; Box2D takes the square root of the product of their frictions, so that
its factors are those of the squared coefficients.
"""

import math

import numpy as np

from sandbox.arrays import BoolArray, FloatArray

TOLERANCE = 2.0**-51
"""Relative; two roundings, of a square root or quotient and of the product."""


def factors(target: FloatArray, touching: BoolArray, stated: list[float | None]) -> list[float]:
    """Return a factor for each of S surfaces whose products best match the target coefficients.

    The stated values are tried first, with 1 where none is stated. If a product is wrong then, the factors are solved
    for: square roots on the diagonal, quotients along each further pair.

    Args:
        target: (S, S) coefficients, symmetric.
        touching: (S, S) pairs that can touch; the others do not matter.
        stated: value that each surface states itself.
    """
    stated_factors = [1.0 if value is None else value for value in stated]
    if not wrong_pairs(target, touching, stated_factors):
        return stated_factors
    solved = _solve_factors(target, touching)
    return min(stated_factors, solved, key=lambda f: len(wrong_pairs(target, touching, f)))


def wrong_pairs(target: FloatArray, touching: BoolArray, factor: list[float]) -> list[tuple[int, int]]:
    """Return the pairs that can touch and whose product of factors is not the target coefficient."""
    with np.errstate(over="ignore"):  # a quotient by a tiny factor may overflow; then the pair is wrong
        is_wrong = np.abs(np.outer(factor, factor) - target) > TOLERANCE * target
    rows, columns = np.nonzero(np.triu(is_wrong & touching))
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def _solve_factors(target: FloatArray, touching: BoolArray) -> list[float]:
    """Solve f_a·f_b = target over the pairs that can touch, as far as possible.

    Factors of surfaces that can touch themselves are roots; from these, other factors follow pair by pair.
    """
    size = len(target)
    factor: list[float | None] = [None] * size
    self_touching = [a for a in range(size) if touching[a, a]]
    for seed in (*self_touching, *range(size)):
        if factor[seed] is not None:
            continue
        factor[seed] = math.sqrt(target[seed, seed]) if touching[seed, seed] else _free_factor(target, touching, seed)
        queue = [seed]
        while queue:
            a = queue.pop()
            base = factor[a]
            for b in range(size):
                if factor[b] is None and touching[a, b] and not touching[b, b] and base:
                    quotient = float(target[a, b]) / base
                    if math.isfinite(quotient):
                        factor[b] = quotient
                        queue.append(b)
    return [0.0 if value is None else value for value in factor]


def _free_factor(target: FloatArray, touching: BoolArray, surface: int) -> float:
    """Return 1, or 0 for a surface whose pairs all have the coefficient 0."""
    return 1.0 if (target[surface][touching[surface]] > 0).any() else 0.0
