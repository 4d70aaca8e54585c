"""A camera rotated by a quarter turn, as used for tables that are longer than wide."""

import numpy as np
import pytest

from sandbox.scene.files.load import loads
from sandbox.window.camera import Camera
from sandbox.window.view_bounds import should_rotate

CAMERA = Camera((0.6, 1.3), 200.0, (640, 400), turned=True)
TABLE = loads('title = "t"\n[billiards]\ntable = "pool-7ft"\n[billiards.place]\ncue = [0.5, 0.5]\n')


def test_y_is_to_the_right_and_x_downwards() -> None:
    assert CAMERA.to_screen(np.array([0.6, 1.3])).tolist() == [320.0, 200.0]
    assert CAMERA.to_screen(np.array([0.6, 1.4])) == pytest.approx([340.0, 200.0], abs=1e-9)  # rounding
    assert CAMERA.to_screen(np.array([0.7, 1.3])) == pytest.approx([320.0, 220.0], abs=1e-9)


def test_turned_camera_rotates_without_mirroring() -> None:
    right, up = CAMERA.vectors_to_screen(np.eye(2))
    assert right[0] * up[1] - right[1] * up[0] < 0.0  # as for an upright camera: y on the screen is downwards


def test_pixel_to_world_and_back_is_the_identity() -> None:
    for pixel in ((0.0, 0.0), (640.0, 17.0), (123.4, 399.0)):
        assert CAMERA.to_screen(np.array(CAMERA.to_world(pixel))) == pytest.approx(pixel, abs=1e-9)  # rounding


def test_zoom_and_pan_keep_the_point_under_the_cursor() -> None:
    pixel = (100.0, 300.0)
    point = np.array(CAMERA.to_world(pixel))
    assert CAMERA.zoomed(1.7, pixel).to_screen(point) == pytest.approx(pixel, abs=1e-9)  # rounding
    assert CAMERA.panned((30.0, -20.0)).to_screen(point) == pytest.approx((130.0, 280.0), abs=1e-9)


def test_camera_box_is_spanned_by_the_corners_of_the_picture() -> None:
    corners = np.array([CAMERA.to_world((0.0, 0.0)), CAMERA.to_world((640.0, 400.0))])
    assert np.array(CAMERA.box) == pytest.approx(np.array([corners.min(axis=0), corners.max(axis=0)]), abs=1e-12)


def test_fitting_places_the_box_beside_panel_and_timeline() -> None:
    box = ((0.0, 0.0), (1.0, 2.0))
    camera = Camera.fitting(box, (900, 600), inset=260, foot=34, turned=True)
    corners = camera.to_screen(np.array(box))
    assert corners.min() > 0.0
    assert corners[:, 0].max() < 900 - 260
    assert corners[:, 1].max() < 600 - 34
    upright = Camera.fitting(box, (900, 600), inset=260, foot=34)
    assert camera.scale > upright.scale


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("head", [0, 80, 5000])
def test_fitting_keeps_the_head_free_up_to_two_thirds_of_the_height(head: int, turned: bool) -> None:
    camera = Camera.fitting(((0.0, 0.0), (1.0, 2.0)), (900, 600), foot=34, turned=turned, head=head)
    y = camera.to_screen(np.array([[0.0, 0.0], [1.0, 2.0]]))[:, 1]
    assert min(y) > min(head, 400)  # a third of the 600 px always belongs to the scene
    assert max(y) < 600 - 34 or head > 400


def test_tables_are_rotated_only_in_wide_pictures() -> None:
    assert should_rotate(TABLE, (800, 500))
    assert not should_rotate(TABLE, (500, 800))
    assert not should_rotate(loads('title = "t"\n[[ball]]\nposition = [0.0, 0.0]\nradius = 1.0\n'), (800, 500))
