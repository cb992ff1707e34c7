"""The modes of an assembled body, on a mesh as fine as they need, or as fine as it is."""

import logging
from pathlib import Path

import numpy as np

from .._base import check
from .._base.threads import one_thread
from ..fe import plausible, refinement
from ..fe.assembly import System
from .modal import Damping, Modes, damping_ratios
from .shapes import FieldShapes

LOG = logging.getLogger(__name__)


@check.typed
@one_thread
def find_modes(
    system: System,
    *,
    n_modes: int | None = None,
    max_frequency: float | None = None,
    damping_ratio: Damping = 0.0,
    tolerance: float | None = None,
    bounds: bool = False,
    keep: str | Path | None = None,
) -> Modes:
    """Find the lowest modes of a body without missing any; rigid motions come first, with frequency exactly zero.

    They are modes of bending; those of its plane are found of ribbed plates alone, among the others.

    Parameters
    ----------
    system : System
    n_modes : int, optional
        How many modes to find, rigid motions included. Give either this or ``max_frequency``.
    max_frequency : float [Hz], optional
        Find all modes up to this frequency.
    damping_ratio : float, array (n_modes,) or function of frequency [Hz] returning [-]
    tolerance : float [-], optional
        Largest relative error accepted in any frequency; the mesh is refined until the estimated error is below it.
    bounds : bool
        Whether to compute guaranteed bounds of each frequency (`Modes.bounds`), for isotropic plates of constant
        thickness with straight edges. A margin, not a proof, covers rounding and the eigensolver.
    keep : path of an .npz file, optional
        File where the modes are saved; the same call later reads them from there. Ignored if a tolerance is given.

    Returns
    -------
    Modes, always with `frequency_error`

    Raises
    ------
    ValueError
        If neither or both of n_modes and max_frequency are given, or the mesh has too few unknowns.
    SimulationError
        If the tolerance is not met, or modes are missing according to the inertia of the factorised matrix.

    Examples
    --------
    >>> plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    >>> system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, {"boundary": "hinged"})
    >>> modes = fi.find_modes(system, n_modes=3, damping_ratio=0.005)
    >>> modes.frequencies.round(2).tolist()
    [105.78, 199.05, 329.86]
    """
    if (n_modes is None) == (max_frequency is None):
        raise ValueError("find_modes needs either n_modes or max_frequency")
    if n_modes is not None:
        n_modes = check.count("n_modes", n_modes)
    if max_frequency is not None:
        max_frequency = check.positive("max_frequency", max_frequency, "Hz")
    if tolerance is not None:
        found = refinement.refine(
            system, n_modes, max_frequency, check.between("tolerance", tolerance, 1e-10, refinement.LOOSEST)
        )
    else:
        fine = refinement.fine_enough(system, refinement.size_for(system, n_modes, max_frequency))
        found = refinement.solve_or_read(fine, n_modes, max_frequency, keep)
    return modes_of(found, damping_ratio, bounds)


def modes_of(found: refinement.Spectrum, damping_ratio: Damping = 0.0, bounds: bool = False) -> Modes:
    """The modes of a spectrum, with the arguments of `find_modes`."""
    shapes = FieldShapes(found.system, found.vectors.copy(), found.flexibility)
    damping = damping_ratios(damping_ratio, found.omega)
    enclosed = refinement.enclosure(found) if bounds else None
    if bounds and enclosed is None:
        raise ValueError(
            "bounds need an isotropic plate of constant thickness with straight edges and nothing attached; "
            "give a tolerance instead, which works for any body"
        )
    in_hertz = None if enclosed is None else enclosed / (2.0 * np.pi)
    notes = plausible.together(
        found.system.notes, refinement.note_on_rise(found.parts), plausible.notes_on_damping(damping, found.omega)
    )
    LOG.info("%d modes up to %.5g Hz", len(found.omega), found.omega[-1] / (2.0 * np.pi))
    return Modes(
        found.omega, damping, shapes, found.system.mass, found.error, in_hertz, notes, section=found.system.section,
        thick=found.system.rules.thick,
    )  # fmt: skip
