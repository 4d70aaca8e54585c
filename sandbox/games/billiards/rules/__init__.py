"""Rules: each game a small state machine that reads the events of one shot and returns a new state.

A frame goes like this:

    rules = RULES["9-ball"]
    state = rules.start(players=2)
    while not state.over:
        choices = rules.choices(state)              # what may be decided and called now
        verdict = rules.decide(state, "play")       # where choices.decisions is not empty
        verdict = rules.judge(state, Call(), shot)  # once every ball is at rest
        ...                                         # spot, rack or put back what the verdict says
        verdict = rules.settle(verdict.state, lie)  # how the balls lie now: who touches, who is snookered
        state = verdict.state

States are frozen, so undo is keeping an earlier one. Rules know balls, cushions, pockets and spots by name alone. The
`Match` knows their positions, and checks whether a cue ball in hand crosses the head string before its first contact.
The barred corners of straight rail and the third miss in clear sight of snooker are not modelled.

Not here, as they cannot happen on these tables: balls that leave the table, jump shots, double hits, pushes and every
other fault of cue, foot or hand, balls played while others move, wrong cue balls, time.

Sources: the rules of play of the World Pool-Billiard Association, as of 2016-03-15 (WPA); the World Rules of Carom
Billiard of the Union Mondiale de Billard, 1989 (UMB); section 3 of the Official Rules of Snooker of the World
Professional Billiards and Snooker Association (WPBSA).
"""
