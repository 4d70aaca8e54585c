"""Blend: colours between two, as surfaces of four bytes a pixel hold them, compiled where it can be."""

from sandbox.engines.common.kernel import bare_kernel

FULL = 256
"""A share of all."""


@bare_kernel
def blended(under: int, over: int, share: int) -> int:
    """Return a pixel with another laid over it by a share of `FULL`, all four bytes alike, two of them at a time."""
    rest = FULL - share
    even = ((under & 0xFF00FF) * rest + (over & 0xFF00FF) * share + 0x800080) >> 8 & 0xFF00FF
    odd = ((under >> 8 & 0xFF00FF) * rest + (over >> 8 & 0xFF00FF) * share + 0x800080) & 0xFF00FF00
    return even | odd
