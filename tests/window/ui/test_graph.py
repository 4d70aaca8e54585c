"""Energy graph: stored samples, seeking back, limits of the axis, and drawing of any float values."""

import math
from itertools import pairwise

import numpy as np
import pygame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.window.render.palette import INK, PURPLE, SKY
from sandbox.window.ui.energy_plot import MAX_SAMPLES, EnergyGraph, spread_labels

RECT = pygame.Rect(10, 10, 340, 150)


def filled_graph(seconds: float = 5.0) -> EnergyGraph:
    graph = EnergyGraph()
    for time in np.arange(0.0, seconds, 0.02):
        kinetic = 10.0 * math.sin(time) ** 2
        graph.add(float(time), kinetic, 10.0 - kinetic, 10.0)
    return graph


def test_earlier_or_equal_time_discards_later_samples() -> None:
    graph = filled_graph(5.0)
    graph.add(2.0, 1.0, 2.0, 3.0)
    times = [sample[0] for sample in graph.samples]
    assert times == sorted(times)
    assert graph.samples[-1] == (2.0, 1.0, 2.0, 3.0)
    for sample in ((0.0, 1.0, 1.0, 2.0), (0.0, 3.0, 4.0, 7.0)):
        graph.add(*sample)
        assert graph.samples == [sample]


def test_clear_resets_samples_and_limits() -> None:
    graph = filled_graph()
    graph.draw(pygame.Surface((400, 200)), RECT)
    graph.clear()
    assert graph.samples == []
    assert graph.limits == EnergyGraph().limits


def test_number_of_samples_is_bounded_and_the_last_ten_seconds_are_covered() -> None:
    graph = EnergyGraph()
    for k in range(5 * MAX_SAMPLES):
        graph.add(k * 1e-4, 1.0, 1.0, 2.0)
    assert len(graph.samples) <= MAX_SAMPLES
    assert graph.samples[0][0] == 0.0  # all within the last 10 s
    for k in range(5 * MAX_SAMPLES):
        graph.add(100.0 + k * 0.01, 1.0, 1.0, 2.0)
    assert len(graph.samples) <= MAX_SAMPLES
    newest = graph.samples[-1][0]
    assert min(sample[0] for sample in graph.samples if sample[0] >= newest - 10.0) < newest - 9.9  # within 10 steps


def test_limits_stay_fixed_while_the_lines_use_most_of_the_range() -> None:
    graph = EnergyGraph()
    first = graph.fit_limits([(0.0, 9.0, 0.0, 9.0)])
    graph.limits = first
    assert first[0] == 0.0
    assert first[1] >= 9.0
    assert graph.fit_limits([(0.0, 5.0, 0.0, 5.0)]) == first
    assert graph.fit_limits([(0.0, 1.0, 0.0, 1.0)])[1] < first[1]
    assert graph.fit_limits([(0.0, 90.0, 0.0, 90.0)])[1] >= 90.0


@given(st.lists(st.tuples(st.just(0.0), st.floats(), st.floats(), st.floats()), max_size=8))
def test_limits_contain_all_finite_values_and_zero(samples: list[tuple[float, float, float, float]]) -> None:
    low, high = EnergyGraph().fit_limits(samples)
    assert low <= 0.0 <= high
    assert low < high
    values = [value for sample in samples for value in sample[1:] if abs(value) < 1e306]
    if len(values) == 3 * len(samples):
        assert all(low <= value <= high for value in values)


def test_three_lines_are_drawn_in_their_colours() -> None:
    surface = pygame.Surface((400, 200))
    filled_graph().draw(surface, RECT)
    colours = {tuple(colour) for colour in pygame.surfarray.array3d(surface).reshape(-1, 3).tolist()}
    assert {SKY, PURPLE, INK} <= colours


def test_nan_values_are_a_gap_in_the_lines() -> None:
    graph = EnergyGraph()
    for k in range(200):
        value = math.nan if 80 <= k < 120 else 5.0
        graph.add(k * 0.05, value, value, value)
    surface = pygame.Surface((200, 60))  # too small for text: only the chart
    graph.draw(surface, surface.get_rect())
    above = pygame.surfarray.array3d(surface)[:, :40]  # the zero line is below
    # The line of the total, antialiased over two rows, is brighter than grid lines.
    lit = (above > 110).all(axis=2).any(axis=1)
    assert lit[30:70].any()
    assert lit[130:170].any()
    assert not lit[90:110].any()


@pytest.mark.parametrize("size", [(1, 1), (3, 200), (200, 3), (30, 30), (1200, 500)])
def test_graph_draws_on_any_rectangle(size: tuple[int, int]) -> None:
    surface = pygame.Surface((1200, 500))
    filled_graph().draw(surface, pygame.Rect((0, 0), size), 2.0)
    outside = pygame.surfarray.array3d(surface)
    outside[: size[0], : size[1]] = 0
    assert not outside.any()


@given(st.lists(st.tuples(st.floats(), st.floats(), st.floats(), st.floats()), max_size=20))
@settings(deadline=None)
def test_any_energies_are_drawn(samples: list[tuple[float, float, float, float]]) -> None:
    graph = EnergyGraph()
    for sample in samples:
        graph.add(*sample)
    graph.draw(pygame.Surface((400, 200)), RECT)
    times = [sample[0] for sample in graph.samples]
    assert times == sorted(set(times))


@given(st.lists(st.floats(0, 100), min_size=1, max_size=4))
def test_labels_keep_their_distance_and_order(targets: list[float]) -> None:
    positions = spread_labels(targets, 15.0, 0.0, 100.0)
    ordered = sorted(positions)
    assert all(b - a >= 15.0 - 1e-9 for a, b in pairwise(ordered))  # rounding of sums
    assert all(-1e-9 <= position <= 100.0 for position in positions)  # rounding of sums; 4 labels fit
    for a, b in pairwise(range(len(targets))):
        assert targets[a] == targets[b] or (positions[a] < positions[b]) == (targets[a] < targets[b])
