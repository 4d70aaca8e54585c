"""Controls: what a player of pinball can do."""

from sandbox.games.rules import Control

LEFT, RIGHT, PLUNGER = "left flipper", "right flipper", "plunger"

FLIPPERS = {LEFT: "left", RIGHT: "right"}
"""control → side"""

NUDGES = {"nudge": 1.0 + 0j, "nudge left": 1j, "nudge right": -1j}
"""control → where the balls go, as a turn from up the table"""

SELDOM = 0.05
"""of the presses of other controls, those of a nudge by whoever presses at chance: three of a ball are a tilt"""

CONTROLS = (
    Control(LEFT, "left flipper; lane lights move left", ("left shift", "z"), "lb lt"),
    Control(RIGHT, "right flipper; lane lights move right", ("right shift", "/"), "rb rt"),
    Control(PLUNGER, "hold to pull the plunger, release to shoot", ("enter",), "a +righty", True),
    Control("nudge", "nudge the table: balls move up", ("space",), "y up", True, SELDOM),
    Control("nudge left", "nudge the table: balls move left", ("left",), "left", True, SELDOM),
    Control("nudge right", "nudge the table: balls move right", ("right",), "right", True, SELDOM),
)
