"""Landing: a lunar lander with a main engine and side thrusters, gusts of wind and a limited amount of fuel."""

from sandbox.game_spec import Environment, GameSpec

GAME = GameSpec(
    names=("landing",),
    rules="sandbox.games.landing.rules:Landing",
    vector_rules="sandbox.games.landing.vector_rules:VectorLanding",
    bot="sandbox.games.landing.bot:LandingBot",
    environments=(Environment("Landing", "games/landing", 5),),
    real_time=True,
)
