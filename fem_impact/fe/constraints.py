"""Attach point masses and point supports to the matrices of a body, apply its supports and find its rigid motions."""

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh, qr
from scipy.sparse import csr_matrix, diags

from .._base.rounding import ROUNDING, SAME
from .interpolation import Interpolation
from .theory import Domain, Held, unresisted_motions


class Attached(NamedTuple):
    """What is attached to a body at points."""

    masses: list[tuple[np.ndarray, float]]  # points [m] and masses [kg]
    posts: list[tuple[np.ndarray, float]]  # points [m] and stiffnesses [N/m] of what holds them; infinite if hinged


def load_and_release(
    K: Any, M: Any, held: Held, domain: Domain, attached: Attached, rows: Interpolation
) -> tuple[dict[str, Any], Any]:
    """Matrices, map and motions of a `System`, by its fields, and the stiffness of all springs (n_all, n_all).

    K and M (n_all, n_all) are those of all unknowns, without springs.
    """
    springs, expand, project = _on_posts(attached.posts, held, domain, rows)
    if attached.masses:
        points, weights = (np.array(column) for column in zip(*attached.masses))
        for i, point in enumerate(points):
            rows.check(f"point of point_masses[{i}]", point[None])
        felt = rows.rows(points, expand)
        M = M + felt.T @ diags(weights / domain.frame.mass) @ felt
    # unknowns in order along the x axis: in that left by dividing triangles into four, factorising takes five times as
    # long
    place, weight = np.zeros(expand.shape[0]), np.zeros(expand.shape[0])
    for row in held.dofs:
        np.add.at(place, row, domain.space.origin[:, 0])
        np.add.at(weight, row, 1.0)
    used = abs(expand).sign()
    shares = np.asarray(used.sum(axis=0)).ravel()
    order = np.argsort((used.T @ (place / np.maximum(weight, 1.0))) / shares, kind="stable")
    every = domain.space.rigid_unknowns(held.dofs, expand.shape[0])
    moving = (project @ every @ unresisted_motions(every, expand, project))[order]
    expand = expand[:, order].tocsr()
    K, M = (expand.T @ (K + springs) @ expand).tocsc(), (expand.T @ M @ expand).tocsc()
    rigid = sprung = moving  # mass-normalised, those that springs do not resist, and weakly
    if moving.shape[1]:
        values, turn = eigh(moving.T @ (expand.T @ (springs @ (expand @ moving))), moving.T @ (M @ moving))
        free = values <= SAME * max(values[-1], 0.0)
        # weakly: below one in the units of the frame, where eigenvalues of bending are hundreds
        rigid, sprung = moving @ turn[:, free], moving @ turn[:, ~free & (values < 1.0)]
    fixed = qr(np.hstack([rigid, sprung]).T, pivoting=True, mode="economic")[2][: rigid.shape[1] + sprung.shape[1]]
    size = 1.0 / np.sqrt(K.diagonal())
    even = diags(size)
    pull = even @ (expand.T @ (springs @ (expand @ sprung)))
    K, M = ((even @ matrix @ even).tocsc() for matrix in (K, M))
    K, M = (0.5 * (matrix + matrix.T).tocsc() for matrix in (K, M))
    motions = {"rigid": rigid / size[:, None], "sprung": sprung / size[:, None], "pull": pull, "held": fixed}
    return {"K": K, "M": M, "expand": (expand @ even).tocsr(), **motions}, springs


def _on_posts(posts: list, held: Held, domain: Domain, rows: Interpolation) -> tuple[Any, Any, Any]:
    """Springs and maps of `Held` with points held, too: each hinged one fixes the unknown that moves it most."""
    springs, expand, project, frame = held.springs, held.expand, held.project, domain.frame
    for i, (point, stiffness) in enumerate(posts):
        rows.check(f"point of point_supports[{i}]", point[None])
        row = rows.rows(point[None], expand)
        if np.isfinite(stiffness):
            springs = springs + stiffness / (frame.mass * frame.rate**2) * (row.T @ row)
            continue
        moves = (row @ expand).toarray()[0]
        most = int(np.abs(moves).argmax())
        if not abs(moves[most]) > ROUNDING:
            continue  # at rest already
        others = np.delete(np.arange(len(moves)), most)
        shares = -moves[others] / moves[most]
        given = np.flatnonzero(shares)
        place = np.concatenate([others, np.full(len(given), most)]), np.concatenate([np.arange(len(others)), given])
        entries = np.concatenate([np.ones(len(others)), shares[given]])
        expand = expand @ csr_matrix((entries, place), shape=(len(moves), len(others)))
        project = project[others]
    return springs.tocsc(), expand.tocsr(), project.tocsr()
