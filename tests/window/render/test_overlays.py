import math

import numpy as np
import pytest

from sandbox.trajectory import Contacts
from sandbox.window.playback.snapshot import MissedContactMarker
from sandbox.window.render.palette import ORANGE, YELLOW
from sandbox.window.render.vectors import HEAT
from tests.window.render.drawn import CAMERA, ball, changed_pixels, colour_at, contact, frame, render, scene, snapshot

ONE = scene(balls=[ball(0, 0, velocity=[5.0, 0.0])])
WEIGHT = 9.81
HEAVY = scene(balls=[ball(0, 0)], world={"gravity": [0.0, -WEIGHT]}, plane=[{"point": [0, -1], "normal": [0, 1]}])


def pixel_box(differ: np.ndarray) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom of the differing pixels, px; right and bottom are exclusive."""
    column, row = np.nonzero(differ)
    return int(column.min()), int(row.min()), int(column.max()) + 1, int(row.max()) + 1


def overlay_pixels(model, *overlays, camera=CAMERA, **more) -> np.ndarray:
    """Return which pixels change by overlays."""
    return changed_pixels(render(snapshot(model), camera), render(snapshot(model, *overlays, **more), camera))


def test_velocity_arrow_is_the_displacement_in_a_tenth_of_a_second():
    for velocity, tip in (([20.0, 0.0], (140, 60)), ([0.0, 15.0], (100, 30)), ([-20.0, 0.0], (60, 60))):
        model = scene(balls=[ball(0, 0, 0.2, velocity=velocity)])
        left, top, right, bottom = pixel_box(overlay_pixels(model, "velocities"))
        reached = left if tip[0] < 100 else right if tip[0] > 100 else top
        assert reached == pytest.approx(tip[1] if tip[0] == 100 else tip[0], abs=2)  # the edge of the arrow's head
        assert left >= min(tip[0], 100) - 8
        assert bottom <= 68


def test_colour_of_velocities_differs_from_the_colours_of_forces():
    model = scene(balls=[ball(0, 0, 0.2, velocity=[20.0, 0.0])])
    assert colour_at(render(snapshot(model, "velocities")), 1.0, 0.0) == ORANGE
    assert min(sum(abs(a - b) for a, b in zip(heat, ORANGE, strict=True)) for heat in HEAT) > 100


def test_arrow_of_a_fast_body_is_limited_in_length():
    left, _, right, _ = pixel_box(overlay_pixels(scene(balls=[ball(0, 0, velocity=[1e9, 0.0])]), "velocities"))
    assert left >= 90
    assert right == pytest.approx(100 + 120 / 3, abs=2)  # the edge of the arrow's head


@pytest.mark.parametrize("overlay", ["joints", "energy", "velocities"])
def test_overlays_without_content_change_no_pixel(overlay):
    assert not overlay_pixels(scene(balls=[ball(0, 0)]), overlay).any()


POST = scene(balls=[ball(0, 1.5)], post=[{"position": [0.0, 0.0], "radius": 0.5}])
WALL = scene(balls=[ball(0, 1.5)], wall=[{"points": [[0.0, 0.0], [4.0, 0.0]], "thickness": 1.0}])


@pytest.mark.parametrize(
    ("model", "recorded", "columns", "rows", "bottom"),
    [
        # a normal is 16 px long
        (HEAVY, contact((0, -1), (-4.0, -1.0), (0.0, -1.0)), (95, 105), (76, 120), 80 + 16),
        (scene(balls=[ball(-1, 0), ball(1, 0)]), contact((0, 1), (9.0, 9.0), (0.0, 1.0)), (94, 118), (54, 66), None),
        (POST, contact((0, -1), (0.5, 0.0), (-1.0, 0.0)), (94, 106), (0, 120), 60 - 10 + 16),
        (WALL, contact((0, -1), (0.5, 0.0), (-1.0, 0.0)), (94, 106), (0, 120), None),
    ],
    ids=["plane", "two balls", "post", "end of a wall"],
)
def test_contact_is_drawn_between_the_bodies_as_they_lie_now(model, recorded, columns, rows, bottom):
    found = pixel_box(overlay_pixels(model, "contacts", contacts=recorded))
    assert columns[0] <= found[0] < found[2] <= columns[1]
    assert rows[0] <= found[1] < found[3] <= rows[1]
    assert bottom is None or found[3] == pytest.approx(bottom, abs=2)  # smooth ends


def force(newtons: float, model=HEAVY, seconds=0.01) -> np.ndarray:
    row = contact((0, -1), (0.0, -1.0), (0.0, -1.0), (0.0, -newtons * seconds))
    return overlay_pixels(model, "impulses", contacts=row, seconds=seconds)


def test_impulse_arrows_are_scaled_by_the_weight_and_limited_in_length():
    arrows = [pixel_box(force(newtons)[96:104]) for newtons in (WEIGHT, 2.0 * WEIGHT, 3.0 * WEIGHT, 1e9)]
    assert [box[3] - box[1] for box in arrows] == pytest.approx([26, 52, 78, 80], abs=2.5)  # smooth ends
    assert not force(1.0, seconds=0.0).any()  # an impulse without a duration is no force


def test_impulse_arrows_without_gravity_are_scaled_by_the_largest():
    model = scene(balls=[ball(-3, 0), ball(3, 0)], plane=[{"point": [0, -1], "normal": [0, 1]}])
    rows = Contacts(
        np.zeros(2),
        np.asarray([(0, -1), (1, -1)]),
        np.asarray([(-3.0, -1.0), (3.0, -1.0)]),
        np.asarray([(0.0, -1.0), (0.0, -1.0)]),
        np.asarray([(0.0, -4e-7), (0.0, -2e-7)]),
    )
    differ = overlay_pixels(model, "impulses", contacts=rows, seconds=0.1)
    left, right = pixel_box(differ[36:44]), pixel_box(differ[156:164])
    assert (left[3] - left[1]) / (right[3] - right[1]) == pytest.approx(2.0, abs=0.15)  # smooth ends


BOX = scene(box=[{"position": [0, 0], "size": [4, 2], "angle": math.pi / 2}])


@pytest.mark.parametrize(("model", "surrounded"), [(ONE, (80, 40, 120, 80)), (BOX, (80, 20, 120, 100))])
def test_bounds_surround_each_body(model, surrounded):
    assert pixel_box(overlay_pixels(model, "bounds")) == pytest.approx(surrounded, abs=1)  # a line's width


def test_centres_are_marked():
    left, top, right, bottom = pixel_box(overlay_pixels(ONE, "centres"))
    assert (left + right) / 2 == pytest.approx(100, abs=1)  # whole pixels
    assert (top + bottom) / 2 == pytest.approx(60, abs=1)  # the same
    assert overlay_pixels(scene(balls=[ball(0, 0, 0.001)]), "centres").any()


@pytest.mark.parametrize(
    ("model", "top"),
    [
        (scene(balls=[ball(0, -1, 1.0, name="cue")]), 60),
        (scene(box=[{"position": [0, 0], "size": [8, 0.4], "name": "beam"}]), 60 - 4),
    ],
)
def test_names_are_written_above_the_outline(model, top):
    left, upper, right, bottom = pixel_box(overlay_pixels(model, "names"))
    assert left < 100 < right
    assert top - 20 < upper < bottom <= top + 1
    assert bottom - upper < 16


def test_overlapping_names_are_omitted():
    apart = scene(balls=[ball(-3, 0, 0.3, name="left"), ball(3, 0, 0.3, name="right")])
    near = scene(balls=[ball(-0.1, 0, 0.3, name="left"), ball(0.1, 0, 0.3, name="right", collides="none")])
    alone = scene(balls=[ball(-0.1, 0, 0.3, name="left")])
    both = overlay_pixels(apart, "names").any(1)
    assert both[:100].any()
    assert both[100:].any()
    # The factor allows for different colours below the names.
    assert (overlay_pixels(near, "names").sum() <= overlay_pixels(alone, "names").sum() * 1.2).all()


def trail(count: int = 20) -> tuple[np.ndarray, ...]:
    x = np.linspace(-4.0, 0.0, count)
    return (np.stack((x, np.zeros(count)), 1)[:, None, :],)


def test_trails_end_at_the_body_and_fade():
    differ = overlay_pixels(ONE, "trails", trails=trail())
    left, top, right, bottom = pixel_box(differ)
    assert left == pytest.approx(20, abs=1)  # a line's width
    assert right <= 80 + 2
    assert bottom - top <= 3
    picture = render(snapshot(ONE, "trails", trails=trail()))
    assert picture[30, 58:62].sum() < picture[75, 58:62].sum(), "older parts are fainter"


def test_trails_in_pieces_equal_the_whole_trail():
    (whole,) = trail()
    pieces = whole[:7], whole[7:8], whole[8:]
    assert not changed_pixels(
        render(snapshot(ONE, "trails", trails=(whole,))), render(snapshot(ONE, "trails", trails=pieces))
    ).any()


def test_trails_have_gaps_at_invalid_positions():
    (whole,) = trail()
    whole[8:12] = math.nan
    row = overlay_pixels(ONE, "trails", trails=(whole,)).any(1)
    assert row[22:50].all()
    assert not row[55:68].any()


def test_trails_of_a_crowd_are_points():
    grid = {"origin": [-4.0, -2.0], "columns": 40, "rows": 20, "spacing": [0.2, 0.2], "radius": 0.05}
    model = scene(grid=[grid])
    past = model.bodies.position[None] + np.linspace(-0.1, 0.0, 5)[:, None, None]
    assert overlay_pixels(model, "trails", trails=(past,)).any()


def test_ghost_is_hollow_and_connected_to_its_body():
    ghost = frame(ONE, position=np.asarray([[3.0, 0.0]]))
    differ = overlay_pixels(ONE, ghost=ghost)
    assert differ[160 + 19, 60], "its rim"
    assert not differ[160 + 6, 60 + 6], "its inside"
    assert differ[130, 58:62].any(), "the connecting line"


def test_ghost_close_to_its_body_has_no_line_and_a_fixed_body_no_ghost():
    ghost = frame(ONE, position=np.asarray([[0.1, 0.0]]))
    assert not overlay_pixels(ONE, ghost=ghost)[95:105, 55:65].any()
    model = scene(balls=[ball(0, 0, fixed=True)])
    assert not overlay_pixels(model, ghost=frame(model)).any()


def test_ghost_with_fewer_bodies_is_drawn():
    two = scene(balls=[ball(0, 0, velocity=[5.0, 0.0]), ball(4, 0, 0.5)])
    ghost = frame(ONE, position=np.asarray([[0.0, 1.0]]))
    assert overlay_pixels(two, ghost=ghost).any()


def test_marker_of_a_missed_contact_grows_and_fades():
    widths, brightness, without = [], [], render(snapshot(ONE)).astype(int)
    for age in (0.0, 0.5, 1.0, 1.4):
        picture = render(snapshot(ONE, flashes=(MissedContactMarker((0.0, 0.0), age),)))
        left, _, right, _ = pixel_box(changed_pixels(without, picture))
        widths.append(right - left)
        brightness.append(int((picture - without)[..., 0].max()))
    assert widths == sorted(set(widths))
    assert brightness == sorted(set(brightness), reverse=True)
    assert brightness[0] > 100
    assert not overlay_pixels(ONE, flashes=(MissedContactMarker((0.0, 0.0), 1.5),)).any()


def test_pull_is_drawn_as_a_line_from_body_to_mouse():
    differ = overlay_pixels(ONE, pull=((0.0, 0.0), (4.0, 0.0)))
    left, _, right, _ = pixel_box(differ)
    assert left == pytest.approx(97, abs=1)  # a dot of 3 px
    assert right == pytest.approx(186, abs=1)  # one of 6 px
    assert differ[97:186].any(1).all()
    assert colour_at(render(snapshot(ONE, pull=((0.0, 0.0), (4.0, 0.0)))), 4.0, 0.0) == YELLOW


def test_picked_body_has_a_ring():
    differ = overlay_pixels(ONE, picked=0)
    assert pixel_box(differ) == pytest.approx((76, 36, 124, 84), abs=1)  # smooth edges
    assert not differ[85:115, 45:75].any()
    assert not overlay_pixels(ONE, picked=5).any()


def test_course_of_a_path_is_drawn_in_the_joints_overlay():
    """A line from the first point to the last, dotted, with a disc at each; nothing else changes."""
    box = {"position": [-3.0, 0.0], "size": [0.4, 0.4], "kinematic": True}
    path = {"points": [[0.0, 0.0], [6.0, 0.0]], "speed": 1.0}
    model = scene(box=[{**box, "path": path}])
    left, top, right, bottom = pixel_box(overlay_pixels(model, "joints"))
    assert left >= 36 and right == pytest.approx(163, abs=2)  # from 2 m inside the box to a disc of 3 px around 160 px
    assert top >= 55 and bottom <= 65
    dots = overlay_pixels(model, "joints")[70:150, 60]
    assert 0.3 < dots.mean() < 0.9  # a dotted line, with antialiased ends
    door = scene(box=[{**box, "path": {"angles": [0.0, 3.0], "pivot": [2.0, 0.0], "period": 1.0}}])
    _, top, _, bottom = pixel_box(overlay_pixels(door, "joints"))
    assert 15 <= top <= 25 or 95 <= bottom <= 105  # an arc of 2 m radius about the pivot
