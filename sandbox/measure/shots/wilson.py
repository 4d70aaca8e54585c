"""Wilson: between what bounds a probability lies, of which only so many trials are known.

Source: E. B. Wilson 1927, J. Am. Stat. Assoc. 22, 209; it holds near 0 and 1 too, where p ± z √(p(1−p)/n) does not.
"""

import math

LEVEL = 1.959963984540054
"""z of 95 %"""


def wilson(hits: int, trials: int, z: float = LEVEL) -> tuple[float, float]:
    """Return the lower and the upper bound of a probability.

    Args:
        hits: how many of the trials went so.
        trials: how many there were; of none nothing is known.
        z: how many standard deviations wide; by default 95 %.

    Raises:
        ValueError: there cannot be so many hits.
    """
    if not 0 <= hits <= trials:
        raise ValueError(f"{hits} of {trials} is not a count of trials")
    if trials == 0:
        return 0.0, 1.0
    share, square = hits / trials, z * z / trials
    middle = (share + 0.5 * square) / (1.0 + square)
    half = math.sqrt(share * (1.0 - share) * square + 0.25 * square * square) / (1.0 + square)
    low = 0.0 if hits == 0 else middle - half  # rounding would leave 1e-19
    return low, 1.0 if hits == trials else middle + half
