"""Odds of a shot as a page: how often each ball falls, and where balls come to rest."""

import base64
import io
from warnings import catch_warnings, filterwarnings

from sandbox.measure.shots.odds import Odds
from sandbox.report.page.document import Page, Section
from sandbox.report.page.markup import Child, Markup, tag
from sandbox.report.page.tables import Column, table
from sandbox.report.page.wording import NONE, number, plural
from sandbox.report.shots import draw_rests

COLUMNS = (
    Column("ball"),
    Column("potted", True, "of all strokes, with the 95 % interval"),
    Column("most often in"),
    Column("rests at x, m", True, "mean and standard deviation over the strokes that leave it on the table"),
    Column("rests at y, m", True, "mean and standard deviation over the strokes that leave it on the table"),
)
DOTS = 80
"""Dots per inch of the picture."""


def odds_page(odds: Odds) -> Page:
    """Return the page of a shot's odds."""
    attempt = odds.attempt
    title = attempt.table.scene.title or "Untitled scene"
    aim = f"{number(attempt.stroke.aim, 6)} rad at {number(attempt.stroke.speed, 4)} m/s"
    lead = tag(
        "p",
        f"Shot {attempt.name!r} at {attempt.ball!r}: aim {aim}. {plural(odds.count, 'stroke')}, seed {odds.seed}: "
        f"any other ball potted {odds.any_pot}, the struck ball potted {odds.scratch}, "
        f"{plural(odds.miscues, 'miscue')}.",
    )
    rows = [_row(odds, ball) for ball in attempt.table.names]
    sections = [
        Section("Odds", table(COLUMNS, rows, "Odds of each ball")),
        Section("Where balls come to rest", _picture(odds)),
    ]
    return Page(title, "Shot", sections, lead)


def _row(odds: Odds, ball: str) -> list[Child]:
    chances = {pocket: odds.chance(ball, pocket) for pocket in odds.attempt.pockets}
    pocket, most = max(chances.items(), key=lambda item: item[1].hits, default=("", None))
    rest = odds.rest(ball)
    at = [NONE, NONE] if rest is None else [f"{m:.3f} ± {s:.3f}" for m, s in zip(rest.mean, rest.spread, strict=True)]
    into = tag("bdi", pocket) if most is not None and most.hits else NONE
    return [tag("bdi", ball), str(odds.chance(ball)), into, *at]


def _picture(odds: Odds) -> Markup:
    """Return heat maps of where balls come to rest, as a picture in the page itself."""
    stream = io.BytesIO()
    with catch_warnings():
        filterwarnings("ignore", message="Glyph .* missing from")
        draw_rests(odds).savefig(stream, format="png", dpi=DOTS)
    text = base64.b64encode(stream.getvalue()).decode("ascii")
    return tag("img", src=f"data:image/png;base64,{text}", alt="Where balls come to rest")
