"""Games: scene tables, rules, bots and views. Each game is a package with a `GameSpec`, listed in `GAMES`."""

GAMES = {
    "billiards": "sandbox.games.billiards:GAME",
    "pinball": "sandbox.games.pinball:GAME",
    "artillery": "sandbox.games.artillery:GAME",
    "curling": "sandbox.games.curling:GAME",
    "landing": "sandbox.games.landing:GAME",
}
"""Import strings of the `GameSpec` objects. A new game is a package and a line here."""
