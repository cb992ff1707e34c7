"""Stiffening by stretching: a body held all round gets longer as it bends, and so stiffer.

Berger's tension takes the stretch of the whole body as if it were even. For a plate with edges that cannot slip, with
``s = int |grad w|**2``, area A and plane-stress modulus ``E / (1 - nu**2)``, it is ``N = E h s / (2 A (1 - nu**2))``,
and the energy is ``N s / 4``: a quartic of the modes. Of wood, ``sqrt(E / (1 - nu**2)) s`` becomes
``int sqrt(C11) w_x**2 + sqrt(C22) w_y**2`` in the axes of the grain (Iwinski and Nowinski). Of a beam the tension is
``N = E A s / (2 L)``, which is exact. For varying sections A/h and L/(E A) become integrals.

It is the leading term: good for deflections up to about the thickness, where the frequency of a hinged square rises by
half. Plates are then 14 % too stiff (of the rise). The stretch of a dent small beside the plate is local, and larger
than Berger's.

References
----------
Berger (1955), J. Appl. Mech. 22, 465-472; Iwinski and Nowinski (1957), Arch. Mech. Stos. 9, 593-603; Woinowsky-Krieger
(1950), J. Appl. Mech. 17, 35-36 (beams); Chu and Herrmann (1956), J. Appl. Mech. 23, 532-540.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from .._base import check
from ..fe import slopes
from ..fe.assembly import support_of_facets, support_words
from ..fe.section import SOFT, Plate, evaluate
from .air import MixedShapes
from .analytic import BeamShapes, DiskShapes, RectangleShapes
from .modal import FieldShapes, Modes, ScaledShapes, Shapes
from .ritz import RitzShapes
from .timoshenko import TimoshenkoShapes

HELD = "clamped", "hinged", SOFT  # supports that hold an edge in the plane, too
NODES = 40  # [-] Gauss points along a radius or a beam, and so many more for each mode
CANNOT = "stretching=True is known for plates and beams with their section, held along the whole edge"


@dataclass(frozen=True, eq=False)
class Stretching:
    """The energy ``V = 1/4 sum_k (q' B_k q)**2`` [J] that stretching adds to modes q [m kg**0.5]."""

    forms: np.ndarray  # (n_forms, n_modes, n_modes) [kg**-0.5 m**-1 s**-1] the matrices B, symmetric

    def __post_init__(self) -> None:
        check.lock_arrays(self)

    def truncated(self, n_modes: int) -> "Stretching":
        """That of the first modes only."""
        return Stretching(np.ascontiguousarray(self.forms[:, :n_modes, :n_modes]))


def stretch(modes: Modes) -> Stretching:
    """How the modes of a plate or beam with edges that cannot slip stretch it; raise ValueError for other bodies."""
    section = modes.section
    if section is None or not modes.dimension or modes.n_rigid:
        why = "its section is not known" if section is None else "it can move rigidly"
        raise ValueError(f"{CANNOT}, but {'a mass has none' if not modes.dimension else why}; leave it out")
    moduli = np.eye(1)
    if isinstance(section, Plate):
        material = section.material
        local = replace(material, angle=0.0).plane_stress
        c, s = np.cos(material.angle), np.sin(material.angle)
        turn = np.array([[c, s], [-s, c]])  # to the axes of the grain
        moduli = turn.T @ np.diag(np.sqrt(local.diagonal()[:2])) @ turn
    gram, soft = _integrals(modes.shapes, modes, moduli)
    return Stretching((gram / np.sqrt(2.0 * soft))[None])


def _integrals(shapes: Shapes, modes: Modes, moduli: np.ndarray) -> tuple[np.ndarray, float]:
    """``int grad w_i . moduli grad w_j`` (n, n), and the integral of one over thickness or E A."""
    if isinstance(shapes, ScaledShapes):
        gram, soft = _integrals(shapes.base, modes, moduli)
        return shapes.amplitude**2 * gram, soft
    if isinstance(shapes, MixedShapes):
        gram, soft = _integrals(shapes.base, modes, moduli)
        return shapes.mix.T @ gram @ shapes.mix, soft
    if isinstance(shapes, (FieldShapes, RitzShapes)):
        system = shapes.system
        words = support_words(system.theory)
        loose = set(support_of_facets(system.mesh, dict(system.supports), words)) - set(HELD)
        if loose:
            raise ValueError(f"{CANNOT}, but an edge is free or elastic; hold it, or leave stretching out")
        if system.element == "morley":
            raise ValueError("stretching=True is unknown for element 'morley'; take 'argyris', or leave stretching out")
        return slopes.products(system, _vectors(shapes), moduli), slopes.softness(system)
    section = modes.section
    assert section is not None
    if isinstance(shapes, (RectangleShapes, DiskShapes)):
        assert isinstance(section, Plate)
        h = float(evaluate("thickness", section.thickness, np.zeros((1, 2)), "m")[0])
        if isinstance(shapes, RectangleShapes):
            area = shapes.length * shapes.width
            wave = np.pi * shapes.numbers / (shapes.length, shapes.width)
            return np.diag(area * (wave**2 @ moduli.diagonal())), area / h
        return moduli[0, 0] * _disk(shapes), np.pi * shapes.radius**2 / h
    if isinstance(shapes, (BeamShapes, TimoshenkoShapes)):
        if not set(shapes.ends) <= set(HELD):
            raise ValueError(f"{CANNOT}, but an end is free; hold it, or leave stretching out")
        area = float(section.inertia(np.zeros((1, 1)))[0]) / section.material.rho
        return _beam(shapes), shapes.length / (section.material.E * area)
    raise ValueError(f"{CANNOT}, but its shapes are known at points only; leave it out")


def _vectors(shapes: FieldShapes | RitzShapes) -> np.ndarray:
    """The shapes in the unknowns of their system, (n_dofs, n)."""
    if isinstance(shapes, FieldShapes):
        return shapes.vectors
    return (shapes.basis.T @ shapes.turn)[:, : shapes.kept]


def _disk(shapes: DiskShapes) -> np.ndarray:
    """``int grad w_i . grad w_j`` (n, n) of a disk, by quadrature along its radius."""
    z, n = shapes.z, shapes.order
    node, weight = np.polynomial.legendre.leggauss(NODES + 2 * int(z.max()))
    r, dr = 0.5 * (node + 1.0)[:, None], (0.25 * weight * (node + 1.0))[:, None]  # times r
    grown = shapes.weight * np.exp(z * (r - 1.0))
    value = special.jv(n, z * r) + special.ive(n, z * r) * grown
    turn = 0.5 * z * (special.ive(n - 1, z * r) + special.ive(n + 1, z * r)) * grown
    steep, round_ = z * special.jvp(n, z * r) + turn, n * value / r
    alike = (n[:, None] == n) & (shapes.phase[:, None] == shapes.phase)
    gram = (dr * steep).T @ steep + (dr * round_).T @ round_
    angle = np.where(n == 0, 2.0 * np.pi, np.pi)
    return np.where(alike, angle * shapes.scale[:, None] * shapes.scale * gram, 0.0)


def _beam(shapes: BeamShapes | TimoshenkoShapes) -> np.ndarray:
    """``int w_i' w_j'`` (n, n) of a uniform beam, by quadrature along it."""
    k = shapes.k if isinstance(shapes, BeamShapes) else shapes.stoutness.waves(shapes.p)[0]
    node, weight = np.polynomial.legendre.leggauss(NODES + int(k.max()))
    x = 0.5 * (node + 1.0)
    if isinstance(shapes, BeamShapes):
        (a, b, c, d), x = shapes.weights.T, x[:, None]
        slope = k * (b * np.cos(k * x) - a * np.sin(k * x) - c * np.exp(-k * x) + d * np.exp(k * (x - 1.0)))
    else:
        slope = shapes.slopes(x)
    return (0.5 * weight[:, None] * slope).T @ slope / shapes.length
