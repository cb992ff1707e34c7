"""Pictures of patches: a panel for each mode, each patch where it is."""

import numpy as np
from numpy.testing import assert_allclose

from fem_impact.show import outlined


def test_patches_stand_where_they_are():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    cells = np.array([[0, 1, 2], [0, 2, 3]])
    maps = np.array([[1.0, -2.0], [0.5, 1.0], [-1.0, 0.0], [0.0, 0.3]])
    figure = outlined.marked(points, cells, maps, ["one", "two"], [(np.array([[0.3, 0.4]]), 0.1, ["1: a", "1: b"])])
    first, second = figure.axes[:2]
    circle = first.lines[0].get_xydata()
    assert_allclose(np.linalg.norm(circle - [0.3, 0.4], axis=1), 0.1, rtol=1e-12)
    assert [axes.get_title(loc="left") for axes in (first, second)] == ["one", "two"]
    assert "1: b" in [text.get_text() for text in second.texts]


def test_a_bar_is_drawn_along_its_length():
    points = np.linspace(0.0, 1.0, 5)[:, None]
    cells, marks = np.column_stack([np.arange(4), np.arange(1, 5)]), [(np.array([[0.2], [0.8]]), 0.1, ["1: a"])]
    (axes,) = outlined.marked(points, cells, points - 0.5, ["one"], marks).axes
    assert_allclose(axes.lines[0].get_xydata(), np.column_stack([points[:, 0], points[:, 0] - 0.5]))
    assert [round(each.get_x(), 12) for each in axes.patches] == [0.1, 0.7]
