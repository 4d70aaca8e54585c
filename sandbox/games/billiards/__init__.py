"""Billiards: pool, carom and snooker on any engine that supports a `[surface]`.

- `rules`: rules of each game as state machines, independent of engine and table
- `match`: `Match`, a frame between two shots as an immutable value: rules, scores, positions
- `game`: `BilliardsRules`, the `Rules` of running games
- `bot`: `BilliardsBot`, which chooses shots, and `BilliardsPolicy`, which plays for both players of a headless game
- `headless`: frames between bots, for `sandbox match`
- `tables`, `scene`: dimensions, and the `[billiards]` table of scene files
- `view`: drawing and input in the window

A `Match` can be used without `BilliardsRules`, as follows:

    match = Match.begin(load("scenes/billiards/9-ball.toml"))
    match = match.decide("play")                                   # if match.choices.decisions is not empty
    match = match.place(match.nearest((x, y)))                     # if match.state.in_hand is not None
    simulation.apply(match.strike(Stroke(aim=1.57, speed=8.0), simulation.time))
    ...                                                            # step until every ball is at rest
    match = match.played(simulation.contacts(), simulation.frame().position, ShotCall(), began)
    for move in match.moves(simulation.frame().position, simulation.time):
        simulation.apply(move)

Applying the moves of the match before a shot undoes the shot.
"""

from sandbox.game_spec import Environment, GameSpec, WindowGame

GAME = GameSpec(
    names=("8-ball", "9-ball", "three-cushion", "straight-rail", "snooker", "free"),
    rules="sandbox.games.billiards.game:start_game",
    tables={"billiards": "sandbox.games.billiards.scene:BILLIARDS"},
    bot="sandbox.games.billiards.bot:BilliardsPolicy",
    view="sandbox.games.billiards.view.view:BilliardsView",
    environments=(
        Environment("EightBall", "billiards/8-ball", 50, "exact", duration=3600.0),
        Environment("NineBall", "billiards/9-ball", 50, "exact", duration=1800.0),
    ),
    presents="sandbox.games.billiards.scene:presents",
    window=WindowGame(
        controls="sandbox.games.billiards.view.controls:BilliardsControls",
        plays="sandbox.games.billiards.game:plays",
        prepare="sandbox.games.billiards.game:without_shots",
        rules_on_request=True,
    ),
    needs_player="sandbox.games.billiards.game:needs_player",
)
