"""Artillery: tanks take turns to fire shells over terrain that explosions deform."""

from sandbox.game_spec import Environment, GameSpec

GAME = GameSpec(
    names=("artillery",),
    rules="sandbox.games.artillery.rules:ArtilleryRules",
    tables={
        "terrain": "sandbox.games.artillery.scene:TERRAIN",
        "artillery": "sandbox.games.artillery.scene:ARTILLERY",
    },
    bot="sandbox.games.artillery.bot:ArtilleryBot",
    hint="Left, Right: barrel · Up, Down: power · W: weapon · Space: fire · F1: all keys",
    view="sandbox.games.artillery.view:ArtilleryView",
    environments=(
        Environment("ArtilleryDuel", "artillery/duel", 10),
        Environment("ArtilleryFour", "artillery/four", 10),
    ),
    needs_player="sandbox.games.artillery.scene:needs_player",
    presents="sandbox.games.artillery.scene:presents",
)
