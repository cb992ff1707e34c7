"""Rigid motions in three dimensions: the six of a body, and those with which one arrives at a blow."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import check
from .._base.rounding import SAME

if TYPE_CHECKING:
    from .body import Body

FITS = 1e-2  # [-] misfit of a rigid motion, or of the mass it moves: as many digits as programs and tests agree to


def rigid_shapes(nodes: np.ndarray, mass: float, inertia: Any, centre: Any) -> np.ndarray:
    """Mass-normalised shapes (n_nodes, 3, 6) [kg**-0.5] of the rigid motions; five of a rod.

    Parameters
    ----------
    nodes : ndarray, shape (n_nodes, 3) [m]
    mass : float [kg]
    inertia : float, (3,) or (3, 3) [kg m^2] about the centre of mass, along the axes of the nodes
    centre : array_like, shape (3,) [m]
    """
    given = check.numbers("inertia", inertia, "kg m^2")
    tensor = np.diag(np.broadcast_to(given, 3)) if np.ndim(given) < 2 and np.size(given) in (1, 3) else given
    tensor = check.array("inertia", tensor, (3, 3), "kg m^2")
    size, axes = np.linalg.eigh(0.5 * (tensor + tensor.T))
    skew, allowed = float(np.abs(tensor - tensor.T).max()), 1e-6 * size[2]  # a plate's largest is the sum of the others
    positive = size[2] > 0.0 and size[0] >= -SAME * size[2]
    if not positive or size[2] > size[0] + size[1] + allowed or skew > allowed:
        raise ValueError(
            "inertia must be that of a body, symmetric and positive and none of its principal moments larger than the "
            f"sum of the others, got {', '.join(f'{each:.4g}' for each in size)} kg m^2"
        )
    check.between("inertia over mass", float(size[2] / mass), 1e-18, 1e18, "m^2")  # from some atoms to a star
    apart = nodes - check.array("centre", centre, (3,), "m")
    kept = size > SAME * size[2]  # not about a rod's own axis
    return motions(apart, axes.T[kept]) / np.sqrt(np.append(np.full(3, mass), size[kept]))


def motions(apart: np.ndarray, axes: Iterable[np.ndarray]) -> np.ndarray:
    """Displacements (n_nodes, 3, 3 + n) of shifts along x, y and z, and of turns about axes (n, 3) through the origin.

    ``apart`` (n_nodes, 3) [m] are places of nodes relative to it.
    """
    shifts = np.broadcast_to(np.eye(3), (len(apart), 3, 3))
    return np.concatenate([shifts, *(np.cross(axis, apart)[..., None] for axis in axes)], axis=2)


def arrival_velocities(body: "Body", row: int, way: np.ndarray, along: Any, pivot: Any) -> np.ndarray | None:
    """Modal velocities (n_rigid,) [kg**0.5] with which the node of a row comes at unit speed along ``way``.

    ``along`` (3,) is the direction of a straight motion, by default ``way``; about a ``pivot`` (3,) [m] the body turns
    so that nothing but ``way`` and the line to the pivot bears on the node's velocity. None of a body on a hinge.
    """
    shapes, nodes = body.shapes[:, :, : np.count_nonzero(body.frequencies == 0.0)], body.nodes
    n = shapes.shape[2]
    if not n:
        raise ValueError(
            f"body must be able to move rigidly, but its lowest mode is at {body.frequencies[0]:g} Hz; give its rigid "
            "motions as modes of 0 Hz, or `Body.freed` from its inertia"
        )
    if along is not None and pivot is not None:
        raise ValueError("give either along, of a body that moves straight, or pivot, of one that turns")
    travel = way if along is None else check.array("along", along, (3,))
    if travel @ way <= FITS * np.linalg.norm(travel):
        raise ValueError("along must lead towards the struck body, less than a right angle off the direction")
    field = np.tile(travel / (travel @ way), (len(nodes), 1))
    if pivot is None:
        found, misfit = _fitted(shapes, field)
        if misfit > FITS and along is None and n == 1:
            return None
        moved = float(found @ found) / float(field[0] @ field[0])
        if misfit <= FITS < abs(moved / body.mass - 1.0):
            raise ValueError(
                f"mass must be what the rigid motions move, {moved:.4g} kg by their shapes at these nodes, got "
                f"{body.mass:.4g} kg; check it and the scale of shapes, or give more nodes: the blow needs three that "
                "are not on a line"
            )
    else:
        arm = nodes[row] - check.array("pivot", pivot, (3,), "m")
        turn = np.cross(arm, way)
        if turn @ turn <= FITS**2 * (arm @ arm):
            raise ValueError("pivot must lie off the line of the blow, or turning about it would not move the point")
        found, misfit = _fitted(shapes, np.cross(turn / (turn @ turn), nodes - (nodes[row] - arm)))
    if misfit > FITS:
        raise ValueError(
            f"{'direction' if pivot is None else 'pivot'} must be of a motion that nothing holds, but the {n} rigid "
            f"motions of this body miss it by {misfit:.0%}; give all six as modes of 0 Hz, or `Body.freed`"
        )
    return found


def _fitted(shapes: np.ndarray, field: np.ndarray) -> tuple[np.ndarray, float]:
    """Modal velocities (n,) that move nodes as a field (n_nodes, 3), and the misfit [-]."""
    columns = shapes.reshape(-1, shapes.shape[2])
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    found = np.linalg.lstsq(columns / size, field.ravel(), rcond=1e-9)[0] / size
    return found, float(np.abs(shapes @ found - field).max() / np.abs(field).max())


def shapes_sideways(shapes: np.ndarray, ways: np.ndarray, n_modes: int) -> np.ndarray:
    """Shapes (n_nodes, 2, n_modes) along two directions at right angles to the ways (n_nodes, 3) and to each other.

    Modes that come before those of ``shapes`` (n_nodes, 3, n) move along the ways alone.
    """
    least = np.eye(3)[np.abs(ways).argmin(axis=1)]
    first = np.cross(ways, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    both = np.stack([first, np.cross(ways, first)], axis=1)
    found = np.zeros((len(ways), 2, n_modes))
    np.einsum("nid,ndm->nim", both, shapes, out=found[:, :, n_modes - shapes.shape[2] :])
    return found
