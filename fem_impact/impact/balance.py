"""What became of the energy and the momentum of a blow: what was lost, and how the bodies leave it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .compiled import law, layout
from .contact import Contact
from .history import History

if TYPE_CHECKING:
    from .response import Response


@dataclass(frozen=True)
class Balance:
    """Energies [J] of a whole run."""

    start: float
    end: float
    contact: float  # stored in the contacts at the end
    modal_loss: float  # that the modes lost besides the work of the contacts
    contact_loss: float  # that the contacts took and do not store
    yielded: float  # what their laws say of it, if they can
    largest: float
    damped: bool  # whether modes may lose any
    lossy: bool  # whether contacts may

    @classmethod
    def of(cls, h: History, contacts: Sequence[Contact]) -> "Balance":
        """The balance of a run."""
        start_contact = float(law.stored_energies(h.offset + h.shape @ h.start_q - law.dents(h.law), h.law))
        end_contact = float(law.stored_energies(h.now[layout.APPROACH] - law.dents(h.end_law), h.end_law))
        start, end = h.energy(h.start_q, h.start_p), h.energy(h.end_q, h.end_p)
        work = float(h.work.sum())
        lost = work - (end_contact - start_contact)
        rated = any(contact.rated for contact in contacts)
        kinetic = max(0.5 * float(p @ p) for p in (h.start_p, h.end_p))
        return cls(
            start=start + start_contact, end=end + end_contact, contact=end_contact, modal_loss=-(end - start) - work,
            contact_loss=lost, yielded=lost if rated else law.yielded_energy(h.end_law) - law.yielded_energy(h.law),
            largest=max(kinetic, start_contact, abs(start), abs(end)),
            damped=bool(((h.zeta > 0.0) & (h.omega > 0.0)).any()),
            lossy=any(contact.lossy for contact in contacts),
        )  # fmt: skip

    @property
    def dissipated(self) -> dict[str, float]:
        """Energy [J] lost to modal damping and to the contacts."""
        return {"modes": self.modal_loss if self.damped else 0.0, "contact": self.contact_loss if self.lossy else 0.0}

    @property
    def error(self) -> float:
        """Energy that numerical error created or destroyed, over the largest energy in the blow [-]."""
        lost = self.dissipated
        unexplained = [self.modal_loss - lost["modes"], self.contact_loss - lost["contact"]]
        unexplained += [min(0.0, value) for value in lost.values()]
        unexplained += [self.contact_loss - self.yielded if lost["contact"] else 0.0]
        return float(sum(abs(value) for value in unexplained) / self.largest) if self.largest else 0.0


def momentum_error(h: History) -> float:
    """Largest momentum change of a rigid motion that the forces do not explain, over the largest momentum [-]."""
    rigid = h.omega == 0.0
    if not rigid.any():
        return 0.0
    impulses = h.impulses.sum(axis=0)  # (n_contacts,)
    wanted = h.start_p + h.bias * h.end_time - impulses @ h.shape
    scale = max(np.abs(h.start_p[rigid]).max(), np.abs(impulses @ np.abs(h.shape[:, rigid])).max())
    return float(np.abs(h.end_p - wanted)[rigid].max() / scale) if scale else 0.0


def of_bodies(hit: "Response", q: np.ndarray, p: np.ndarray) -> dict[str, float]:
    """Energy [J] of each body of a blow in a state."""
    n = len(hit.bodies)
    names = ["striker", "target"] if n == 2 else [f"body {i}" for i in range(n)]
    return {name: hit.history.energy(q, p, hit.body_slice(i)) for i, name in enumerate(names)}


def loss_in_words(hit: "Response") -> str:
    """What becomes of the energy that no part holds: where a mode overdamps, waves carry it into an infinite plate."""
    return "carried off by waves or dissipated" if (hit.history.zeta > 1.0).any() else "dissipated"


def contacts_of_striker(hit: "Response") -> list[int]:
    """The contacts of the first body."""
    shape = hit.history.shape[:, hit.body_slice(0)]
    return np.flatnonzero((shape != 0.0).any(axis=1)).tolist()


def rigid_row(hit: "Response", body: int) -> np.ndarray:
    """Shape (n_modes,) of a body's rigid motion at its first contact point, zero in all other modes."""
    found, touched = np.zeros(len(hit.history.omega)), hit.ends[body].touched if hit.ends else ((0, 1.0),)
    if touched:
        (contact, sign), first = touched[0], hit.body_slice(body).start
        rigid = slice(first, first + (1 if body == 0 and _held_by_hand(hit) else hit.bodies[body].n_rigid))
        found[rigid] = sign * hit.history.shape[contact, rigid]
        if contact in [i for i, _ in touched[1:]]:  # with itself, which its rigid motion does not press
            found[rigid] = hit.bodies[body].shape_at(hit.ends[body].points[:1])[0, : rigid.stop - first]
    return found


def _held_by_hand(hit: "Response") -> bool:
    return hit.striker is not None and hit.striker.hand is not None


def restitution(hit: "Response") -> float | None:
    """Minus the striker's speed after its last separation over that before its first contact, see `Response`."""
    if hit.in_contact:
        return None
    row, history = rigid_row(hit, 0), hit.history
    arrives = hit.striker is not None or not hit.ends or hit.ends[0].speed != 0.0
    before, after = hit.speed if arrives else 0.0, float(row @ history.end_p)
    if _held_by_hand(hit) or (row * history.bias).any():  # a constant force or a hand changes its speed in flight
        contacts = contacts_of_striker(hit)
        mine = [each for each in hit.impacts if each.contact in contacts]
        if not mine:
            return -1.0 if before else None
        times = np.array([mine[0].start, max(each.end for each in mine)])
        before, after = (history.states(times)[1] @ row).tolist()
    return -after / before if before else None
