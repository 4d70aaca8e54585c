"""Aim windows of pots, against the geometry of balls without friction and pockets without jaws."""

import math

import pytest
from scipy.optimize import brentq

from sandbox.games.billiards.shots.aim_windows import END_ACCURACY, windows
from sandbox.games.billiards.shots.shot import NoSuchShotError
from tests.games.billiards.shots.shots_by_hand import R, ball, pocket, scene_with, shot, straight_pot

pytestmark = pytest.mark.full  # long runs and sweeps


def object_heading(aim: float, d: float) -> float:
    """Return the heading of the object ball, rad: the line of centres when the cue ball is 2R away from it."""
    return aim - math.asin(d * math.sin(aim) / (2.0 * R))


@pytest.mark.parametrize(("d", "far"), [(0.2, 0.4), (0.5, 1.0), (1.0, 0.3)])
def test_window_of_a_straight_pot_is_the_closed_form(d: float, far: float) -> None:
    allowed = math.asin(0.06 / far)  # the centre of the ball must pass the rim
    edge = brentq(lambda aim: abs(object_heading(aim, d)) - allowed, 0.0, math.asin(2.0 * R / d) - 1e-12, xtol=1e-15)
    found = windows(straight_pot(d, far, speed=3.0), "object", "hole", reach=0.2, shots=801)
    (window,) = found.found
    assert (window.low, window.high) == pytest.approx((-edge, edge), abs=2.0 * END_ACCURACY)
    assert window.centre == pytest.approx(0.0, abs=2.0 * END_ACCURACY)
    assert window.half == pytest.approx(edge, abs=2.0 * END_ACCURACY)
    assert found.nearest is window
    # The approximation of players: the angle of the pocket over the amplification of an error by the hit.
    assert window.half == pytest.approx(allowed / (d / (2.0 * R) - 1.0), rel=0.1)  # angles of up to 0.2 are not small


def test_window_of_a_cut_is_the_closed_form() -> None:
    d, far, cut = 0.5, 0.6, 0.6
    hole = pocket("hole", d + far * math.cos(cut), -far * math.sin(cut))
    allowed = math.asin(0.06 / far)
    limits = [
        brentq(lambda aim, to=to: object_heading(aim, d) - to, 0.0, math.asin(2.0 * R / d), xtol=1e-15)
        for to in (-cut + allowed, -cut - allowed)
    ]
    aim = 0.5 * sum(limits) + 0.001
    found = windows(scene_with(ball("object", d), hole, shot(aim, 3.0)), "object", "hole", reach=0.02, shots=401)
    (window,) = found.found
    assert [window.low, window.high] == pytest.approx(limits, abs=2.0 * END_ACCURACY)
    assert aim in window


def test_a_window_beyond_the_searched_range_is_extended() -> None:
    scene = straight_pot(0.2, 0.1, speed=3.0)
    narrow = windows(scene, "object", "hole", reach=0.01, shots=101)
    (window,) = narrow.found
    assert narrow.reach > 0.01
    edge = brentq(
        lambda aim: abs(object_heading(aim, 0.2)) - math.asin(0.6), 0.0, math.asin(R / 0.1) - 1e-12, xtol=1e-15
    )
    assert window.half == pytest.approx(edge, abs=2.0 * END_ACCURACY)


def test_no_window_where_no_aim_pots_the_ball() -> None:
    found = windows(scene_with(ball("object", 0.5), pocket("hole", -0.5, 0.5), shot()), "object", "hole", shots=101)
    assert found.found == ()
    assert found.nearest is None
    assert found.document().within is False


def test_windows_are_the_same_on_any_number_of_threads() -> None:
    scene = straight_pot(0.5, 1.0)
    one, three = (windows(scene, "object", "hole", shots=301, threads=n) for n in (1, 3))
    assert one.found == three.found


def test_unknown_names_are_refused_with_those_known() -> None:
    scene = straight_pot(0.5, 1.0)
    with pytest.raises(NoSuchShotError, match="no ball is named 'x'; known names: cue, object"):
        windows(scene, "x", "hole")
    with pytest.raises(NoSuchShotError, match="no pocket is named 'x'; known names: hole"):
        windows(scene, "object", "x")
    with pytest.raises(NoSuchShotError, match="no shot is named 'x'; known names: it"):
        windows(scene, "object", "hole", "x")
