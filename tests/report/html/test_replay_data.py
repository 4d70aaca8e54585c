"""Compression of replay data: decompressed values equal the original ones within the stated rounding."""

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
def test_any_codes_survive_compression(codes: np.ndarray) -> None:
    assert (decompress(compress(codes), codes.shape) == codes).all()


def test_positions_are_restored_within_half_a_step() -> None:
    rng = np.random.default_rng(1)
    position = (BOX.x, BOX.y) + BOX.side * rng.random((50, 7, 2))
    codes = encode_positions(position, np.ones((50, 7), np.bool_), BOX)
    restored = decompress(compress(codes), codes.shape) * BOX.step + (BOX.x, BOX.y)
    # Half a step, and the rounding of coordinates about 1e6 m.
    assert np.abs(restored - position).max() <= 0.5 * BOX.step + 1e-9


def test_corners_of_the_box_are_kept() -> None:
    corners = np.asarray([[[BOX.x, BOX.y], [BOX.x + BOX.side, BOX.y + BOX.side]]])
    codes = encode_positions(corners, np.ones((1, 2), np.bool_), BOX)
    assert codes.tolist() == [[[0, 0], [LEVELS, LEVELS]]]


@pytest.mark.parametrize("position", [(math.nan, 1e6), (math.inf, 1e6), (-4.0, 1e6), (0.0, 1e300), (0.0, 1e6 + 21.0)])
def test_position_outside_the_box_or_not_finite_is_absent(position: tuple[float, float]) -> None:
    codes = encode_positions(np.asarray([[position]]), np.ones((1, 1), np.bool_), BOX)
    assert codes[0, 0, 0] == ABSENT


def test_retired_body_is_absent_although_it_has_a_position() -> None:
    codes = encode_positions(np.full((2, 1, 2), (0.0, 1e6 + 1.0)), np.asarray([[True], [False]]), BOX)
    assert (codes[:, 0, 0] == ABSENT).tolist() == [False, True]


def test_angles_are_restored_within_half_a_step() -> None:
    angle = np.asarray([-100.0, -1e-12, 0.0, 1.0, 2.0 * math.pi - 1e-9, 7e5])
    restored = encode_angles(angle) * (2.0 * math.pi / 65536.0)
    error = np.mod(restored - angle + math.pi, 2.0 * math.pi) - math.pi
    assert np.abs(error).max() <= math.pi / 65536.0 + 1e-10  # rounding of 7e5 rad
    assert encode_angles(np.asarray([math.nan, math.inf])).tolist() == [0, 0]


def test_smooth_motion_is_compressed_to_less_than_a_letter_per_frame() -> None:
    time = np.linspace(0.0, 1.0, 600)
    position = np.stack((3.0 + 2.0 * time, 1e6 + 19.0 - 5.0 * time**2), axis=1)[:, None]
    text = compress(encode_positions(position, np.ones((600, 1), np.bool_), BOX))
    assert len(text) < 600  # one letter per frame; uncompressed, four bytes take 5.3 letters


def test_wrong_shape_is_rejected() -> None:
    with pytest.raises(ValueError, match="4 codes"):
        decompress(compress(np.zeros((2, 2), np.uint16)), (3, 2))
