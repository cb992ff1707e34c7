"""Modes of uniform beams: by Euler and Bernoulli here, with shear and rotary inertia by `timoshenko`."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check
from ..fe import plausible
from ..fe.section import KINDS, Beam
from . import timoshenko
from .modal import Damping, Modes
from .rectangle import MOST_MODES
from .request import check_beyond_rigid, check_number, request
from .timoshenko import ENDS, BeamlikeShapes

SHEAR_RATIO = 2.6  # [-] fact: E / G of an isotropic material with nu = 0.3
LIMIT = 1e5  # [-] largest slenderness of a Timoshenko beam: beyond, shear is below rounding


def _roots(ends: tuple[str, str], n: int) -> np.ndarray:
    """The first n flexible roots kL, from cos kL = +-1/cosh kL, tan kL = tanh kL or sin kL = 0."""
    i = np.arange(1, n + 1)
    pair = frozenset(ends)
    if pair == {"hinged"}:
        return i * np.pi
    if pair in ({"clamped", "hinged"}, {"hinged", "free"}):
        root = (i + 0.25) * np.pi
        for _ in range(4):  # Newton on sin - cos tanh, whose slope is about sqrt(2)
            root = root - (np.sin(root) - np.cos(root) * np.tanh(root)) / (np.cos(root) + np.sin(root) * np.tanh(root))
        return root
    sign = -1.0 if len(pair) == 2 else 1.0  # clamped-free against clamped-clamped and free-free
    root = (i + 0.5 * sign) * np.pi
    for _ in range(6):
        sech = 1.0 / np.cosh(np.minimum(root, 700.0))
        root = root - (np.cos(root) - sign * sech) / (-np.sin(root) + sign * sech * np.tanh(root))
    return root


@dataclass(frozen=True, eq=False, repr=False)
class BeamShapes(BeamlikeShapes, check.Brief):
    """Shapes of a uniform Euler-Bernoulli beam of unit mass, length and rigidity over x / length in 0 ... 1.

    A flexible shape is A cos kx + B sin kx + C exp(-kx) + D exp(k (x - 1)): bounded terms, so that mode 1000 keeps
    its digits where cosh and sinh would cancel.
    """

    k: np.ndarray  # (n_modes,) wavenumber times length; 0 for rigid motions
    weights: np.ndarray  # (n_modes, 4)

    def at(self, points: np.ndarray) -> np.ndarray:
        x = points[:, :1] / self.length  # (n_points, 1)
        flexible = self.k > 0.0
        k, (a, b, c, d) = self.k[flexible], self.weights[flexible].T
        values = np.empty((len(points), len(self.k)))
        values[:, flexible] = a * np.cos(k * x) + b * np.sin(k * x) + c * np.exp(-k * x) + d * np.exp(k * (x - 1.0))
        values[:, ~flexible] = self.weights[~flexible, 0] + x * self.weights[~flexible, 1]
        return values

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """w' (n_points, n_modes) over x / length at x (n_points,) of a beam that cannot move rigidly."""
        k, (a, b, c, d), x = self.k, self.weights.T, x[:, None]
        return k * (b * np.cos(k * x) - a * np.sin(k * x) - c * np.exp(-k * x) + d * np.exp(k * (x - 1.0)))


def beam(
    length: float,
    *,
    ends: tuple[str, str] = ("hinged", "free"),
    mass: float | None = None,
    first_frequency: float | None = None,
    section: Any = None,
    n_modes: int | None = None,
    max_frequency: float | None = None,
    damping_ratio: Damping = 0.0,
    theory: str = "euler",
    slenderness: float | None = None,
    shear_ratio: float = SHEAR_RATIO,
) -> Modes:
    """Modes of a uniform beam from x = 0 to x = length [m], including rigid motions.

    Parameters
    ----------
    length : float [m]
    ends : two of "clamped", "hinged", "free", for x = 0 and x = length
    mass, first_frequency : float [kg], [Hz] of the lowest bending mode
        Give both of these, or a section.
    section : Beam of constant section
    n_modes : int (rigid motions included), or max_frequency : float [Hz]
    damping_ratio : float, array (n_modes,) or function of frequency [Hz]
    theory : "euler" (slender) or "timoshenko" (with shear and rotary inertia, see `timoshenko`)
    slenderness : float [-], only for "timoshenko" without a section
        Length over the diameter of a round beam, at least 1.
    shear_ratio : float [-], goes with slenderness
        E / G: 2.6 if isotropic with nu = 0.3, some 10 to 20 for wood along the grain.

    Returns
    -------
    Modes, with frequencies exact to rounding; at a free end of a slender beam the squared shape is 4 / mass for every
    bending mode

    Raises
    ------
    ValueError
        If a size is not positive, an end is unknown, or both or neither of two alternatives are given.

    References
    ----------
    Bishop and Johnson (1960), The mechanics of vibration, ch. 7; Huang (1961), J. Appl. Mech. 28, 579-584.

    Examples
    --------
    >>> modes = fi.analytic.beam(0.4, ends=("clamped", "free"), mass=0.1, first_frequency=100.0, n_modes=3)
    >>> modes.frequencies.round(2).tolist()
    [100.0, 626.69, 1754.75]
    """
    length = check.positive("length", length, "m")
    if not isinstance(ends, (list, tuple)) or len(ends) != 2:
        raise ValueError(f"ends must be two words, one for each end, got {check.shown(ends)}")
    pair = (check.one_of("ends", ends[0], KINDS), check.one_of("ends", ends[1], KINDS))
    asked = request(
        section, Beam, length, mass=mass, first_frequency=first_frequency,
        n_modes=n_modes, max_frequency=max_frequency, damping_ratio=damping_ratio,
    )  # fmt: skip
    stout = _stoutness(theory, section, length, slenderness, shear_ratio)
    notes = plausible.doubted_sizes((length,), section)
    stoutness = stout or timoshenko.SLENDER
    rigid = timoshenko.rigid_motions(pair, stoutness)
    n_rigid, most = len(rigid), MOST_MODES if stout is None else timoshenko.MOST

    def bent(n: int) -> np.ndarray:
        """The first n of omega**2 at unit mass and rigidity."""
        return _roots(pair, n) ** 4 if stout is None else stout.eigenvalues(pair, n_rigid, n)

    count, reach = asked.count(float(np.sqrt(bent(1)[0])), most)
    if np.isfinite(reach) and stout is None:
        check_number(np.sqrt(reach) / np.pi, most, length=length)
        count = n_rigid + int(np.count_nonzero(bent(int(np.sqrt(reach) / np.pi) + 2) <= reach**2))
    elif np.isfinite(reach) and stout is not None:
        count = int(stout.count(pair, np.array([reach**2]))[0])
        check_number(count, most, length=length)
    check_beyond_rigid(count, n_rigid, "bending")
    p = bent(count - n_rigid)
    own = _weights(pair, p**0.25) if stout is None else stout.weights(pair, p)
    weights = np.vstack([np.column_stack([rigid, np.zeros_like(rigid)]), own])
    values = np.concatenate([np.zeros(n_rigid), p])
    shapes: Any = BeamShapes(length, pair, stoutness, values**0.25, weights)
    if stout is not None:
        shapes = timoshenko.TimoshenkoShapes(length, pair, stoutness, values, weights)
    return replace(asked.answered(shapes, values, notes), thick=stout is not None)


def _stoutness(
    theory: str, section: Any, length: float, slenderness: float | None, shear_ratio: float
) -> timoshenko.Stoutness | None:
    """What distinguishes a Timoshenko beam from a slender one; None for the latter."""
    if check.one_of("theory", theory, ("euler", "timoshenko")) == "euler":
        if slenderness is not None:
            raise ValueError("slenderness needs theory = 'timoshenko'")
        return None
    if (slenderness is None) == (section is None):
        raise ValueError("slenderness must be given if there is no section, and only then")
    if section is not None:
        point = np.zeros((1, 1))
        bend, mass = section.stiffness(point)[0], section.inertia(point)[0]
        square = length**2
        stout = timoshenko.Stoutness(section.rotary(point)[0] / mass / square, bend / section.shear(point)[0] / square)
    else:
        square = 1.0 / (16.0 * check.between("slenderness", slenderness, 1.0, LIMIT) ** 2)
        ratio = check.between("shear_ratio", shear_ratio, 2.0, 1e3)
        # the shear coefficient of a round section, nu = 0.3 (Cowper 1966); 0.857 at nu = 0, 0.9 at 0.5
        stout = timoshenko.Stoutness(square, square * ratio / 0.886)
    if not min(stout.R, stout.S) >= LIMIT**-2 / 16.0:
        raise ValueError(f"length must be at most {LIMIT:g} times the height for theory = 'timoshenko'; use 'euler'")
    return stout


def _weights(ends: tuple[str, str], k: np.ndarray) -> np.ndarray:
    """Weights (n, 4) of cos, sin and the two exponentials that meet the end conditions, for unit mass."""
    far = np.exp(-k)
    one, nought = np.ones_like(k), np.zeros_like(k)
    c, s = np.cos(k), np.sin(k)
    left = [  # derivatives 0 to 3 over k**order, at x = 0
        [one, nought, one, far],
        [nought, one, -one, far],
        [-one, nought, one, far],
        [nought, -one, -one, far],
    ]
    right = [[c, s, far, one], [-s, c, -far, one], [-c, -s, far, one], [s, -c, -far, one]]
    rows = [left[i] for i in ENDS[ends[0]]] + [right[i] for i in ENDS[ends[1]]]
    matrix = np.moveaxis(np.array(rows), 2, 0)  # (n, 4, 4)
    weights = np.linalg.svd(matrix)[2][:, 3, :]
    value, slope, curve, shear = (np.einsum("in,ni->n", np.array(r), weights) for r in right)
    norm = 0.25 * (value**2 - 2.0 * slope * shear + curve**2)  # Rayleigh's identity for the integral of the square
    weights = weights / np.sqrt(norm)[:, None]
    start = np.einsum("in,ni->n", np.array(left[0]), weights)
    turn = np.einsum("in,ni->n", np.array(left[1]), weights)
    clear = np.where(np.abs(start) > 1e-6, start, np.where(np.abs(turn) > 1e-6, turn, weights[:, 0]))
    return weights * np.where(clear < 0.0, -1.0, 1.0)[:, None]
