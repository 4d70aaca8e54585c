"""Rules of billiards games: state machines that read the events of one shot and return a new state.

A frame proceeds as follows:

    rules = RULESETS["9-ball"]
    state = rules.start(players=2)
    while not state.over:
        choices = rules.choices(state)              # decisions and calls that are possible now
        verdict = rules.decide(state, "play")       # if choices.decisions is not empty
        verdict = rules.judge(state, ShotCall(), shot)  # once every ball is at rest
        ...                                         # respot, rerack or restore the balls
        verdict = rules.settle(verdict.state, situation)  # balls that touch, and snookers
        state = verdict.state

States are immutable, so undo returns to an earlier one. The rules identify balls, cushions, pockets and spots by name.
`Match` has their positions, and checks whether a cue ball in hand crosses the head string before its first contact.
The barred corners of straight rail and the third miss in clear sight of snooker are not modelled.

Not included, because they cannot occur in the simulation: balls that leave the table, jump shots, double hits, pushes
and other fouls with cue, foot or hand, shots while other balls move, wrong cue balls, time limits.

Sources: the rules of play of the World Pool-Billiard Association, as of 2016-03-15 (WPA); the World Rules of Carom
Billiard of the Union Mondiale de Billard, 1989 (UMB); section 3 of the Official Rules of Snooker of the World
Professional Billiards and Snooker Association (WPBSA).
"""
