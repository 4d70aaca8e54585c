"""Pinball: tables of devices that respond to switches with points, sounds and actions."""

from sandbox.game_spec import Environment, GameSpec

GAME = GameSpec(
    names=("pinball",),
    rules="sandbox.games.pinball.rules:PinballRules",
    tables={"pinball": "sandbox.games.pinball.scene:PINBALL"},
    bot="sandbox.games.pinball.bot:PinballBot",
    view="sandbox.games.pinball.view:PinballView",
    environments=(
        Environment("PinballClassic", "pinball/classic", 2),
        Environment("PinballFull", "pinball/full", 2),
    ),
    real_time=True,
    hint="Left, Right Shift: flippers · Enter: plunger · Space: nudge · F1: all keys",
    presents="sandbox.games.pinball.scene:presents",
)
