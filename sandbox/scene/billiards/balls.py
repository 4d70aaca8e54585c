"""Sets of balls: size, mass, the cloth that they are played on, and the colours that people know them by."""

from dataclasses import dataclass

WHITE = "#f4f1e6"


@dataclass(frozen=True)
class BallSet:
    """Balls that are played with each other, all alike but for name and colour."""

    radius: float
    """m"""
    mass: float
    """kg"""
    colours: dict[str, str]
    """by name; the first is struck"""
    nose: float | None = None
    """height of the cushions' noses where rules state it in itself, m"""
    sliding: float = 0.2
    rolling: float = 0.01
    spinning: float = 0.444
    """of the radius, 1/m: μ_sp = 0.444 R, so that every ball loses 10.9 rad/s of its spin about z each second"""


SOLIDS = {
    "1": "#f0c020",
    "2": "#1c4fa0",
    "3": "#d02424",
    "4": "#5b2a86",
    "5": "#ee7420",
    "6": "#12703c",
    "7": "#7c1e26",
}


def _striped(colour: str) -> str:
    """Return a solid's colour lightened halfway to white: a disc of one colour can have no stripe."""
    parts = [(int(colour[k : k + 2], 16) + int(WHITE[k : k + 2], 16)) // 2 for k in (1, 3, 5)]
    return "#" + "".join(f"{part:02x}" for part in parts)


POOL = BallSet(
    # WPA, balls: 2.25 in; 5.5 to 6 oz, here the 6 of which most sets are
    radius=0.028575,
    mass=0.170097,
    colours={
        "cue": WHITE,
        **SOLIDS,
        "8": "#2a2a2e",
        **{str(int(name) + 8): _striped(colour) for name, colour in SOLIDS.items()},
    },
)

SNOOKER = BallSet(
    # WPBSA 2: 52.5 mm, all of equal weight to 3 g, which it does not give; sets weigh about 140 g
    radius=0.02625,
    mass=0.140,
    colours={
        "cue": WHITE,
        **{f"red-{number}": "#b81f24" for number in range(1, 16)},
        "yellow": "#f0d020",
        "green": "#0e7a3e",
        "brown": "#7a4a22",
        "blue": "#1f5fb8",
        "pink": "#f08fb0",
        "black": "#2a2a2e",
    },
)

CAROM = BallSet(
    # UMB 12: 61 to 61.5 mm, 205 to 220 g; UMB 11: noses 37 mm high
    radius=0.03075,
    mass=0.210,
    colours={"white": WHITE, "yellow": "#f0d020", "red": "#c8201f"},
    nose=0.037,
)

BALLS = {"pool": POOL, "snooker": SNOOKER, "carom": CAROM}
