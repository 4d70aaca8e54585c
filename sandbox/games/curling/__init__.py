"""Curling: two teams slide sixteen stones an end towards a house; bots aim by a closed-form solution."""

from sandbox.game_spec import Environment, GameSpec

GAME = GameSpec(
    names=("curling",),
    rules="sandbox.games.curling.rules:Curling",
    tables={"play.curling": "sandbox.games.curling.scene:MATCH"},
    hint="Arrows: broom and weight · T: turn · Space: throw · S: sweep · F1: all keys",
    bot="sandbox.games.curling.player:CurlingPlayer",
    view="sandbox.games.curling.view:CurlingView",
    environments=(Environment("Curling", "games/curling", 10),),
    needs_player="sandbox.games.curling.scene:needs_player",
    presents="sandbox.games.curling.scene:presents",
)
