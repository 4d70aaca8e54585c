"""Billiards: pool, carom and snooker, played headless: no window, and any engine that rolls balls on a floor.

    match = Match.begin(load("scenes/billiards/9-ball.toml"))      # match.py: a frozen value between shots
    match.turn, match.state.scores, match.targets, match.choices   # who, how it stands, what may be said
    match = match.place(match.nearest((x, y)))                     # a ball in hand; match.refusal((x, y)) says why not
    match = match.decide("play")                                   # where match.choices.decisions is not empty
    simulation.apply(match.strike(Stroke(aim=1.57, speed=8.0), simulation.time))
    …                                                              # step until all rest; frame.py's roll_out does
    match = match.played(simulation.contacts(), simulation.frame().position, Call(), began)
    for move in match.moves(simulation.frame().position, simulation.time): simulation.apply(move)
    match.verdict.fouls, match.messages                            # to undo a shot, apply the moves of the match before

So a session is a scene and its actions: `Strike` and `Move`. `Bot(skill, seed)` (bot/) decides and plans shots, and
`play(match, players, engine)` (frame.py) plays a frame out between players and returns it with its session.
"""

from sandbox.games.spec import GameSpec

GAME = GameSpec(
    names=("8-ball", "9-ball", "three-cushion", "straight-rail", "snooker", "free"),
    tables={"billiards": "sandbox.games.billiards.scene:BILLIARDS"},
    view="sandbox.games.billiards.view.view:BilliardsView",
    presents="sandbox.games.billiards.scene:presents",
)
