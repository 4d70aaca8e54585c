"""Games: scene tables, rules, bots and views. `GAMES` lists them; the folder of a game states a `GameSpec`."""

GAMES = {
    "billiards": "sandbox.games.billiards:GAME",
    "pinball": "sandbox.games.pinball:GAME",
    "artillery": "sandbox.games.artillery:GAME",
    "curling": "sandbox.games.curling:GAME",
    "landing": "sandbox.games.landing:GAME",
}
"""Import string of each game's `GameSpec`. A new game is a folder, and a line here."""
