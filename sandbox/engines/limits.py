"""Limits: what counts as finite and bounded while a scene runs."""

FARTHEST = 1e17
"""m; ten times farther out than a scene may start"""

FASTEST = 1e13
"""m/s; ten times faster than a scene may start"""

BEYOND = "is not finite, or beyond all bounds"
