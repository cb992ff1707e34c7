"""Sketches of a scene: a plate or beam with its strike points, and a stick that strikes through a spring."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from fem_impact.show.figures import BLUE, SKY, VERMILION, styled
from fem_impact.show.plots import BLACK

TILT = np.array([[1.0, 0.42], [0.0, 0.5]])  # oblique view of a plate's plane: rows give screen x and y


def plan(corners: Any, points: Any, labels: Sequence[str], *, title: str = "", colors: Sequence[str] = ()) -> Figure:
    """Draw a plate from above, or a beam from the side, with its strike points.

    Parameters
    ----------
    corners : array_like, shape (n_corners, 2) [m] of a plate; (2, 1) of a beam
    points : array_like, shape (n_points, 2 or 1) [m]
    labels : sequence of str, one for each point
    colors : sequence of str, one for each point

    Returns
    -------
    matplotlib.figure.Figure
    """
    outline, places = np.asarray(corners, float), np.atleast_2d(np.asarray(points, float))
    beam = outline.shape[1] == 1
    with styled(6.4, 1.9 if beam else 4.2) as figure:
        axes = figure.subplots()
        axes.grid(False)
        if beam:
            thick = 0.02 * float(np.ptp(outline))
            outline = np.array([[x, y] for x, y in zip(outline[[0, 1, 1, 0], 0], [-thick, -thick, thick, thick])])
            places = np.column_stack([places[:, 0], np.full(len(places), thick)])
        axes.add_patch(Polygon(outline, closed=True, facecolor=SKY, edgecolor=BLUE, alpha=0.5))
        size = float(np.ptp(outline, axis=0).max())
        for i, (place, label) in enumerate(zip(places, labels)):
            paint = colors[i] if colors else VERMILION
            if beam:
                arrow = {"arrowstyle": "-|>", "color": paint, "lw": 2.0}
                high = place + np.array([0.0, 0.1 * size])
                axes.annotate("", place, high, arrowprops=arrow)
                axes.text(high[0], high[1] + (0.012 + 0.04 * (i % 2)) * size, label, ha="center", color=paint)
            else:
                axes.plot(*place, "*", color=paint, ms=14)
                axes.annotate(label, place, (0, 11), textcoords="offset points", ha="center", color=paint)
        axes.set_title(title)
        axes.set_aspect("equal")
        axes.set(xlabel="position [m]", ylabel="" if beam else "position [m]")
        if beam:
            axes.set(ylim=(-0.06 * size, 0.2 * size), yticks=[])
            axes.spines["left"].set_visible(False)
        axes.margins(0.05)
    return figure


def blow(corners: Any, at: Any, *, title: str = "") -> Figure:
    """Draw a plate in oblique view, struck through a spring by the free end of a stick hinged at its far end.

    Parameters
    ----------
    corners : array_like, shape (n_corners, 2) [m]
    at : strike point, (2,) [m]

    Returns
    -------
    matplotlib.figure.Figure
    """
    outline = np.asarray(corners, float) @ TILT.T
    foot = np.asarray(at, float) @ TILT.T
    size = float(np.ptp(outline, axis=0).max())
    tip, hinge = (foot + size * np.array(shift) for shift in ((0.0, 0.16), (0.8, 0.33)))
    with styled(6.4, 3.4) as figure:
        axes = figure.subplots()
        axes.axis("off")
        axes.add_patch(Polygon(outline, closed=True, facecolor=SKY, edgecolor=BLUE, alpha=0.5, lw=1.5))
        turns = np.linspace(0.0, 1.0, 17)
        width = 0.018 * size * np.where((turns > 0.1) & (turns < 0.9), (-1.0) ** np.arange(17), 0.0)
        axes.plot(foot[0] + width, foot[1] + turns * (tip - foot)[1], color=VERMILION, lw=1.8)
        axes.plot(*foot, "*", color=VERMILION, ms=12)
        axes.plot(*np.transpose([tip, hinge]), color="#7A1F1F", lw=7, solid_capstyle="round")
        axes.plot(*hinge, "o", mfc="white", mec=BLACK, ms=9, mew=1.8)
        for text, place, align in (
            ("plate, hinged all round", outline.min(axis=0) + size * np.array([0.02, -0.05]), "left"),
            ("contact spring", 0.5 * (foot + tip) - size * np.array([0.04, 0.0]), "right"),
            ("stick", 0.5 * (tip + hinge) + size * np.array([0.0, 0.05]), "center"),
            ("hinge", hinge + size * np.array([0.03, 0.0]), "left"),
        ):
            axes.text(place[0], place[1], text, ha=align, va="center")
        axes.set_title(title)
        axes.set_aspect("equal")
        axes.margins(0.08)
    return figure
