"""How the bodies of a blow leave it: their speeds, and the restitution of the striker."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .response import Response


def touched(hit: "Response", body: int) -> list[int]:
    """The contacts of a body."""
    shape = hit.history.shape[:, hit.body_slice(body)]
    return np.flatnonzero((shape != 0.0).any(axis=1)).tolist()


def rigid_row(hit: "Response", body: int) -> np.ndarray:
    """Shape (n_modes,) of a body's rigid motion at its first contact point, zero in all other modes."""
    shape, found, contacts = hit.history.shape, np.zeros(len(hit.history.omega)), touched(hit, body)
    if contacts:
        first = hit.body_slice(body).start
        rigid = slice(first, first + (1 if body == 0 and _held(hit) else hit.bodies[body].n_rigid))
        second = shape[contacts[0], :first].any()  # an earlier body is the first of that contact
        found[rigid] = (-1.0 if second else 1.0) * shape[contacts[0], rigid]
    return found


def _held(hit: "Response") -> bool:
    return hit.striker is not None and hit.striker.hand is not None


def in_contact(hit: "Response") -> bool:
    """Whether the first body still presses another at the end of the run."""
    mine = touched(hit, 0)
    return any(each.separation_speed is None for each in hit.impacts if each.contact in mine)


def speeds(hit: "Response") -> np.ndarray:
    """Speeds of the striker's rigid motion before and after each impact, (n_impacts, 2), see `Response`."""
    times = np.array([[each.start, each.end] for each in hit.impacts]).reshape(-1, 2)
    return (hit.history.states(times.ravel())[1] @ rigid_row(hit, 0)).reshape(-1, 2)


def restitution(hit: "Response") -> float | None:
    """Minus the striker's speed after its last separation over that before its first contact, see `Response`."""
    if in_contact(hit):
        return None
    row, history = rigid_row(hit, 0), hit.history
    before, after = hit.speed, float(row @ history.end_p)
    if _held(hit) or (row * history.bias).any():  # a constant force or a hand changes its speed in flight
        contacts = touched(hit, 0)
        mine = [each for each in hit.impacts if each.contact in contacts]
        if not mine:
            return -1.0 if before else None
        times = np.array([mine[0].start, max(each.end for each in mine)])
        before, after = (history.states(times)[1] @ row).tolist()
    return -after / before if before else None
