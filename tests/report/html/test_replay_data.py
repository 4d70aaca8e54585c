"""Packing: what is decompress is what was compress, within the rounding that is stated."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sandbox.report.html.replay_data import (
    ABSENT,
    LEVELS,
    QuantisationBox,
    compress,
    decompress,
    encode_angles,
    encode_positions,
)

BOX = QuantisationBox(-3.0, 1e6, 20.0)


@given(arrays(np.uint16, st.tuples(st.integers(1, 6), st.integers(1, 4), st.integers(2, 3))))
def test_any_numbers_come_back(words: np.ndarray) -> None:
    assert (decompress(compress(words), words.shape) == words).all()


def test_positions_come_back_within_half_a_step() -> None:
    rng = np.random.default_rng(1)
    position = (BOX.x, BOX.y) + BOX.side * rng.random((50, 7, 2))
    words = encode_positions(position, np.ones((50, 7), np.bool_), BOX)
    back = decompress(compress(words), words.shape) * BOX.step + (BOX.x, BOX.y)
    # Half a step, and the rounding of coordinates about 1e6 m.
    assert np.abs(back - position).max() <= 0.5 * BOX.step + 1e-9


def test_corners_of_the_box_are_kept() -> None:
    corners = np.asarray([[[BOX.x, BOX.y], [BOX.x + BOX.side, BOX.y + BOX.side]]])
    words = encode_positions(corners, np.ones((1, 2), np.bool_), BOX)
    assert words.tolist() == [[[0, 0], [LEVELS, LEVELS]]]


@pytest.mark.parametrize("place", [(math.nan, 1e6), (math.inf, 1e6), (-4.0, 1e6), (0.0, 1e300), (0.0, 1e6 + 21.0)])
def test_position_outside_the_box_or_not_finite_is_absent(place: tuple[float, float]) -> None:
    words = encode_positions(np.asarray([[place]]), np.ones((1, 1), np.bool_), BOX)
    assert words[0, 0, 0] == ABSENT


def test_retired_body_is_absent_although_it_has_a_position() -> None:
    words = encode_positions(np.full((2, 1, 2), (0.0, 1e6 + 1.0)), np.asarray([[True], [False]]), BOX)
    assert (words[:, 0, 0] == ABSENT).tolist() == [False, True]


def test_angles_come_back_within_half_a_part_of_a_turn() -> None:
    angle = np.asarray([-100.0, -1e-12, 0.0, 1.0, 2.0 * math.pi - 1e-9, 7e5])
    back = encode_angles(angle) * (2.0 * math.pi / 65536.0)
    off = np.mod(back - angle + math.pi, 2.0 * math.pi) - math.pi
    assert np.abs(off).max() <= math.pi / 65536.0 + 1e-10  # the rounding of 7e5 rad
    assert encode_angles(np.asarray([math.nan, math.inf])).tolist() == [0, 0]


def test_smooth_motion_takes_little() -> None:
    time = np.linspace(0.0, 1.0, 600)
    fall = np.stack((3.0 + 2.0 * time, 1e6 + 19.0 - 5.0 * time**2), axis=1)[:, None]
    text = compress(encode_positions(fall, np.ones((600, 1), np.bool_), BOX))
    assert len(text) < 600  # a letter a frame; plain, four bytes are 5.3


def test_wrong_shape_is_refused() -> None:
    with pytest.raises(ValueError, match="4 codes"):
        decompress(compress(np.zeros((2, 2), np.uint16)), (3, 2))
