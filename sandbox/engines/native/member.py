"""Member: a body in a pymunk space with its shapes."""

from typing import NamedTuple

import pymunk


class Member(NamedTuple):
    """A body in the space, with its shapes; what can meet nothing has none."""

    body: pymunk.Body
    shapes: tuple[tuple[int, pymunk.Shape], ...]
    """each with its number among the pieces of all bodies"""

    @property
    def moves(self) -> bool:
        """It is not fixed."""
        return self.body.body_type != pymunk.Body.STATIC  # kinematic is what a zone holds, or a drive leads
