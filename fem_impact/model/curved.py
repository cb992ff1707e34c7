"""How far a body whose plane answers to its linear motion may bend: shells, plates with ribs or uneven layers.

Their stretching has quadratic forces, too, see `modes.stretching`: pressed on its top a dome softens, and where its
tangent stiffness turns negative it may snap through.
"""

import numpy as np

from ..modes.stretching import Stretching
from .bending import Known


def slopes(found: Stretching, q: np.ndarray) -> np.ndarray:
    """Stiffness (n_times, n, n) [s**-2] that stretching adds to the modes in states q (n_times, n)."""
    bent = np.einsum("kij,tj->tki", found.forms, q)
    pull = np.einsum("tki,ti->tk", bent, q)
    result = 2.0 * np.einsum("tki,tkj->tij", bent, bent)
    if len(found.linear):
        mixed = np.einsum("ki,tkj->tij", found.linear, bent)
        result += mixed + mixed.transpose(0, 2, 1)
        pull = pull + q @ found.linear.T
    return np.asarray(result + np.einsum("tk,kij->tij", pull, found.forms))


def may_snap(found: Stretching, omega: np.ndarray, q: np.ndarray) -> bool:
    """Whether the tangent stiffness of modes (n,) turns negative in one of some states (n_times, n)."""
    flexible = omega > 0.0
    added = slopes(found, q)[:, flexible][:, :, flexible] / np.outer(omega[flexible], omega[flexible])
    return bool(np.linalg.eigvalsh(added)[:, 0].min(initial=0.0) < -1.0)


def shift(found: Stretching, omega: np.ndarray, energy: np.ndarray) -> np.ndarray:
    """Relative shift of the frequencies of modes (n,) that ring with some energies (n,) [J], each in its own phase.

    Quartic energies raise them by the mean stiffness, of its own motion by half of it; cubic ones lower them in second
    order.
    """
    still = omega == 0.0
    soft = np.divide(1.0, omega, out=np.zeros(len(omega)), where=~still)
    forms = found.forms * np.outer(soft, soft)
    raised = 2.0 * np.einsum("kij,kij,j->i", forms, forms, energy)
    raised += np.einsum("kjj,j,kii->i", forms, energy, forms)
    raised -= 1.5 * np.einsum("kii,kii,i->i", forms, forms, energy)
    if not len(found.linear):
        return np.asarray(0.5 * raised)
    part = np.einsum("km,kij->ijm", found.linear * soft, forms)
    mixed = part + part.transpose(2, 0, 1) + part.transpose(0, 2, 1)
    # a force a q**2 lowers the frequency of q'' + w**2 q by 5/12 (a / w**2)**2 of the squared amplitude, whose
    # stiffness 2 a q has the mean square 2 a**2 of it
    return np.asarray(0.5 * raised - 5.0 / 24.0 * np.einsum("ijm,ijm,m->i", mixed, mixed, energy))


def height(body: Known) -> float:
    """Rise [m] from the lowest to the highest point of a plate; zero if it is flat."""
    if body.plate is None or body.plate.rise is None:
        return 0.0
    return float(np.ptp(body.plate.rise(body.modes.shapes.grid()[0])))
