"""Which pieces of a drawing are lines of ribs, and the points along them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact.mesh import open_paths
from fem_impact.mesh.loops import Arc, segment

QUARTER = Arc(np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, 1.0]), 0.0, 0.5 * np.pi, "arc")


def names(pieces, close=1e-3):
    found = open_paths.lines(pieces, 1.0, close)
    return sorted("".join(pieces[i].name for i in chain) for chain in found)


def square(name="", last="", gap=0.0):
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, gap)], float)
    return [segment(a, b, n) for a, b, n in zip(corners, corners[1:], (name, name, name, last or name))]


def test_closed_loops_have_no_lines_whatever_their_names():
    assert names(square("rim")) == names(square("rim", "left")) == names(square()) == []
    assert names(square("rim", gap=5e-4)) == []  # an outline with a gap that will be bridged


@pytest.mark.parametrize("rim", ["", "rim"])
def test_a_named_line_is_found_inside_at_a_corner_and_from_corner_to_corner(rim):
    bars = [segment((0.2, 0.2), (0.8, 0.3), "a"), segment((0, 0), (0.5, 0.5), "b"), segment((0, 1), (1, 0), "c")]
    assert names(square(rim) + bars) == ["a", "b", "c"]
    assert names([*square(rim), segment((0.2, 0.2), (0.8, 0.3))]) == []  # without a name it may be a mistake


def test_lines_that_end_on_lines_are_lines_too():
    bars = [segment((0.5, 0.5), (0.2, 0.5), "a"), segment((0, 0), (0.5, 0.5), "b")]
    assert names(square("rim", "left") + bars) == ["a", "b"]


def test_pieces_of_one_name_are_one_line_up_to_a_branch():
    ends = (0.0, 0.0), (0.3, 0.1), (0.5, 0.1)
    pieces = [segment(ends[1], ends[0], "a"), segment(ends[1], ends[2], "a")]
    assert [sorted(chain) for chain in open_paths.chains(pieces, 1.0)] == [[0, 1]]
    assert len(open_paths.chains([*pieces, segment(ends[1], (0.3, 0.5), "a")], 1.0)) == 3


def test_a_chain_is_flattened_in_order_whichever_way_its_pieces_run():
    pieces = [segment((1.0, 0.0), (2.0, 0.0), "a").reversed(), QUARTER]
    path = open_paths.flattened(pieces, 0.1)
    assert_allclose(path[[0, -1]], [(2.0, 0.0), (0.0, 1.0)], atol=1e-12)
    assert len(path) == 2 + np.ceil(0.5 * np.pi / 0.1)
    assert np.linalg.norm(np.diff(path[1:], axis=0), axis=1).max() <= 0.1
    # a chord of length s stays within s**2 / 8 of a circle of radius 1
    assert open_paths.sag(QUARTER, 0.1) == pytest.approx((0.5 * np.pi / 16) ** 2 / 8, rel=1e-3)
    assert open_paths.sag(pieces[0], 0.1) == 0.0


def test_names_that_repeat_or_are_taken_get_numbers():
    path = np.zeros((2, 2))
    found = open_paths.named([("a", path), ("b", path), ("b", path), ("rim", path)], {"rim"})
    assert list(found) == ["a", "b0", "b1", "rim0"]
