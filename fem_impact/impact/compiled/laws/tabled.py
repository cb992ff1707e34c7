"""A law of the user's own: any force that only grows, as cubics between knots where force and slope are his.

Below the first knot, the corner, the force is the power of the approach that meets it with its slope; beyond the last
it goes on along its tangent. Of the cubics, energies and average slopes are exact and free of cancellation.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ...._base import check
from ..build import COMPILED, inner
from ..layout import HEAD, WIDTH
from .base import Law, Spring
from .power import PowerNumbers

KIND = 4.0
KNOTS = 96  # [-] most knots: with them a force of the exponent 5 errs by 1e-5; test_tabled.py
NUDGE = 1e-5  # [-] of the approach, for slopes by differences: they err by 1e-10
TABLE = (KNOTS, 4)  # approach [m], force [N], slope [N/m] and stored energy [J] at each knot, at the end of a law's row


def _number_at(address: Any, i: Any) -> Any:
    """The float i behind an address."""
    return ctypes.c_double.from_address(int(address) + 8 * int(i)).value


number_at: Any = _number_at
if COMPILED:
    from numba.core import types
    from numba.extending import intrinsic

    @intrinsic
    def _loaded(typing: Any, address: Any, i: Any) -> Any:
        def load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            start = builder.inttoptr(arguments[0], context.get_value_type(types.float64).as_pointer())
            return builder.load(builder.gep(start, [arguments[1]]))

        return types.float64(types.int64, types.int64), load

    number_at = _loaded


@dataclass(frozen=True)
class TableNumbers(PowerNumbers):
    """The knots of a law of the user's own."""

    knots: tuple[tuple[float, float, float], ...] = ()  # approach [m], force [N] and slope [N/m] at each
    misfit: float = 0.0  # [-] by which the force between the knots differs from that given, at most

    @property
    def n_knots(self) -> int:
        """How many knots it has; 0 if it is not of the user's own."""
        return len(self.knots)

    @classmethod
    def of(
        cls, force: Callable[[Any], Any], *, deepest: float, loss: float = 0.0, gap: float = 0.0,
        tolerance: float = 1e-5,
    ) -> Self:  # fmt: skip
        """A law of your own: any force over the approach that starts from zero and only grows.

        It is asked for a few hundred forces when the contact is made, and kept as cubics between at most 96 knots, so
        blows are as fast as with any other law, and energies exact. ``misfit`` states how far the two differ.

        Parameters
        ----------
        force : callable
            Of approaches > 0 (n,) [m], or of one, to forces [N].
        deepest : float [m]
            Up to which it is asked. From a thousandth of that down the force is a power of the approach; a blow that
            goes deeper is refused.
        loss : float [s/m]
            Hunt and Crossley's: the force is multiplied by ``1 + loss * rate``.
        gap : float [m]
        tolerance : float [-]
            Largest difference between the force kept and the force given, over the latter.

        Raises
        ------
        ValueError
            If the force is not finite, not positive, or falls somewhere, or the tolerance cannot be met.

        Examples
        --------
        >>> foam = fi.Contact.of(lambda d: 20.0 * np.expm1(d / 1e-3), deepest=5e-3)
        >>> foam.force([1e-3, 4e-3]).round(2).tolist(), foam.misfit < 1e-5
        ([34.37, 1071.96], True)
        """
        deepest = check.positive("deepest", deepest, "m")
        own = _Own(force, deepest)
        knots, misfit = own.fitted(check.between("tolerance", tolerance, 0.0, 0.1))
        x, f, slope = knots[0]
        exponent = x * slope / f
        return cls(f / x**exponent, exponent, loss, gap, knots=tuple(map(tuple, knots.tolist())), misfit=misfit)


class _Own:
    """The user's force, and the knots that it asks for."""

    def __init__(self, force: Callable[[Any], Any], deepest: float) -> None:
        if not callable(force):
            raise ValueError(f"force must be a function of the approach, got {check.shown(force)}")
        self.given, self.deepest = force, deepest

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Its forces (n,) [N] at approaches (n,) [m]."""
        try:
            found = np.asarray(self.given(x), dtype=float)
        except (TypeError, ValueError):  # it takes one approach at a time
            found = np.array([float(self.given(each)) for each in x.tolist()])
        if found.shape != x.shape:
            raise ValueError(f"force must return a force for each approach, {x.shape}, got {found.shape}")
        for bad, rule in ((~np.isfinite(found), "finite"), (found <= 0.0, "positive, as a contact only pushes")):
            if bad.any():
                i = int(bad.argmax())
                raise ValueError(f"force must be {rule}, got {found[i]:g} N at an approach of {x[i]:g} m")
        return found

    def knot(self, x: np.ndarray) -> np.ndarray:
        """Approach, force and slope (n, 3) at approaches (n,) [m]; slopes so that the cubics only grow."""
        high = np.minimum(x * (1.0 + NUDGE), self.deepest)
        low = high - 2.0 * NUDGE * x
        force = self(x)
        secants = np.diff(force) / np.diff(x)
        if (secants <= 0.0).any():
            i = int((secants <= 0.0).argmax())
            raise ValueError(
                f"force must grow with the approach, got {force[i]:g} N at {x[i]:g} m and {force[i + 1]:g} N at "
                f"{x[i + 1]:g} m"
            )
        slope = (self(high) - self(low)) / (high - low)
        most = 3.0 * np.minimum(np.append(secants, np.inf), np.append(np.inf, secants))  # Fritsch and Carlson
        return np.column_stack([x, force, np.clip(slope, 0.0, most)])

    def fitted(self, tolerance: float) -> tuple[np.ndarray, float]:
        """Knots (n, 3), and by how much the force between them differs at most [-]."""
        x = np.geomspace(1e-3 * self.deepest, self.deepest, 24)  # below the first, 1e-6 of a blow's energy is stored
        shares = np.array([0.25, 0.5, 0.75])
        while True:
            knots = self.knot(x)
            between = x[:-1, None] + shares * np.diff(x)[:, None]
            wanted = self(between.ravel()).reshape(between.shape)
            missed = np.abs(course(knots, between)[0] / wanted - 1.0).max(axis=1)
            worst = missed >= max(0.3 * tolerance, np.partition(missed, -8)[-8] if len(x) + 8 <= KNOTS else np.inf)
            if not worst.any():
                break
            x = np.sort(np.append(x, np.sqrt(x[:-1] * x[1:])[worst]))
        misfit = float(missed.max())
        if misfit > tolerance:
            at = float(between[missed.argmax(), 1])
            raise ValueError(
                f"force must be smooth enough for {KNOTS} knots to follow it within {tolerance:g}, but near {at:g} m "
                f"they miss by {misfit:.1g}; give a larger tolerance or a smaller deepest"
            )
        return knots, misfit


def course(knots: Any, pressed: Any) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and stored energy [J] at approaches >= 0 [m], of knots (n, 3)."""
    x, f, slope = np.asarray(knots, dtype=float).T[:3]
    pressed = np.asarray(pressed, dtype=float)
    exponent, h = x[0] * slope[0] / f[0], np.diff(x)
    two, three = 3.0 * np.diff(f) - h * (2.0 * slope[:-1] + slope[1:]), h * (slope[:-1] + slope[1:]) - 2.0 * np.diff(f)
    whole = h * (f[:-1] + h * slope[:-1] / 2.0 + two / 3.0 + three / 4.0)
    energy = f[0] * x[0] / (exponent + 1.0) + np.append(0.0, np.cumsum(whole))
    i = np.clip(np.searchsorted(x, pressed) - 1, 0, len(h) - 1)
    t = (np.minimum(pressed, x[-1]) - x[i]) / h[i]
    a, b, c, d = f[i], h[i] * slope[i], two[i], three[i]
    over = np.maximum(pressed - x[-1], 0.0)
    force = a + t * (b + t * (c + t * d)) + slope[-1] * over
    stored = energy[i] + h[i] * t * (a + t * (b / 2.0 + t * (c / 3.0 + t * d / 4.0)))
    stored = stored + over * (f[-1] + 0.5 * slope[-1] * over)
    low = f[0] * (np.minimum(pressed, x[0]) / x[0]) ** exponent
    first = pressed <= x[0]
    return np.where(first, low, force), np.where(first, low * pressed / (exponent + 1.0), stored)


class TableLaw(Law):
    """A law of the user's own."""

    kind = KIND
    name = "of"
    mark = "n_knots"
    damped = True
    slopes = ()
    words = " of your own"

    def check(self, contact: Any) -> None:
        found = check.array("knots", contact.knots, (None, 3))
        if not 2 <= len(found) <= KNOTS or (np.diff(found[:, :2], axis=0) <= 0.0).any() or (found[0] <= 0.0).any():
            raise ValueError(f"knots must be 2 to {KNOTS} rows of approach, force and slope that grow; use Contact.of")
        x, f, slope = found[0]
        exponent = x * slope / f
        if not np.allclose([contact.exponent, contact.stiffness], [exponent, f / x**exponent], rtol=1e-9):
            raise ValueError(
                "stiffness and exponent must be those of the knots; for another force give another to Contact.of"
            )

    def check_reached(self, contact: Any, history: Any, i: int) -> None:
        deepest, force, _ = contact.knots[-1]
        reached = history.steps[:, HEAD + WIDTH * i].max(initial=0.0)
        peak = max((impact.peak_force for impact in history.impacts if impact.contact == i), default=0.0)
        if reached > deepest and peak > force:
            raise ValueError(
                f"deepest must be at least what the blow reaches, {reached:.3g} m, got {deepest:g} m; give Contact.of "
                "a larger one"
            )

    def table(self, contact: Any) -> np.ndarray:
        """Its knots as compiled loops read them, `TABLE`."""
        found = np.zeros(TABLE)
        found[: contact.n_knots, :3] = contact.knots
        found[: contact.n_knots, 3] = course(contact.knots, found[: contact.n_knots, 0])[1]
        return found

    def force(self, contact: Any, pressed: np.ndarray) -> np.ndarray:
        return course(_knots(contact), pressed)[0]

    def deepest(self, row: Any, energy: np.ndarray) -> np.ndarray:
        x = np.geomspace(1e-6, 1e2, 2000) * _knots(row)[-1, 0]
        return np.asarray(np.exp(np.interp(np.log(energy), np.log(course(_knots(row), x)[1]), np.log(x))))

    def approach(self, contact: Any, force: float) -> float:
        x, f, slope = _knots(contact).T
        if force <= f[0]:
            return super().approach(contact, force)
        return float(np.interp(force, f, x) + max(0.0, force - f[-1]) / slope[-1])


def _knots(contact: Any) -> np.ndarray:
    return np.asarray(contact.knots, dtype=float)[: int(contact.n_knots), :3]


@inner()
def spring(law, i):
    """The spring of contact i; its table is read where the law holds it."""
    place = law.ctypes.data + (i + 1) * law.itemsize - 32 * KNOTS  # where `TABLE` begins
    return Spring(
        law["stiffness"][i], law["exponent"][i], law["loss"][i], law["compliance"][i], KIND,
        law["knots"][i, 0, 0], float(place), law["n_knots"][i], 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip


@inner()
def knot_number(spring, i, column):
    """A number of knot i of a spring, see `TABLE`."""
    return number_at(np.int64(spring.hard), np.int64(4 * i + column))


@inner()
def piece_at(x, spring):
    """The piece between two knots that holds a compression, or the nearest."""
    low = 0
    high = int(spring.hard_exponent) - 2
    while low < high:
        middle = (low + high + 1) // 2
        if knot_number(spring, middle, 0) <= x:
            low = middle
        else:
            high = middle - 1
    return low


@inner()
def force_cubic(i, spring):
    """Of piece i: where it begins, how long it is, and the coefficients of its force in shares of that."""
    x, f, s = knot_number(spring, i, 0), knot_number(spring, i, 1), knot_number(spring, i, 2)
    h = knot_number(spring, i + 1, 0) - x
    rise, end = knot_number(spring, i + 1, 1) - f, h * knot_number(spring, i + 1, 2)
    return x, h, f, h * s, 3.0 * rise - 2.0 * h * s - end, h * s + end - 2.0 * rise


@inner()
def last_knot(spring):
    """Compression, force, slope and stored energy at the last knot."""
    i = int(spring.hard_exponent) - 1
    return knot_number(spring, i, 0), knot_number(spring, i, 1), knot_number(spring, i, 2), knot_number(spring, i, 3)


@inner()
def pushed_beyond(x, spring):
    """Force and stored energy at a compression beyond the corner."""
    end, f, s, energy = last_knot(spring)
    if x >= end:
        over = x - end
        return f + s * over, energy + over * (f + 0.5 * s * over)
    i = piece_at(x, spring)
    start, h, a, b, c, d = force_cubic(i, spring)
    t = (x - start) / h
    energy = knot_number(spring, i, 3) + h * t * (a + t * (b / 2.0 + t * (c / 3.0 + t * d / 4.0)))
    return a + t * (b + t * (c + t * d)), energy


@inner()
def slope_beyond(x, spring):
    """Slope of the force at a compression beyond the corner."""
    end, _, s, _ = last_knot(spring)
    if x >= end:
        return s
    start, h, _, b, c, d = force_cubic(piece_at(x, spring), spring)
    t = (x - start) / h
    return (b + t * (2.0 * c + 3.0 * t * d)) / h


@inner()
def slopes_beyond(small, large, spring):
    """Average slopes between two compressions beyond the corner."""
    end, f, s, _ = last_knot(spring)
    if small >= end:
        return f + s * (0.5 * (small + large) - end), s
    i = piece_at(small, spring)
    if large <= knot_number(spring, i + 1, 0):
        return slopes_in_piece(small, large, i, spring)
    work = gain = 0.0  # times the way
    x = small
    while x < large and x < end:
        stop = min(large, knot_number(spring, i + 1, 0))
        g, d = slopes_in_piece(x, stop, i, spring)
        work += g * (stop - x)
        gain += d * (stop - x)
        x = stop
        i += 1
    if x < large:
        work += (large - x) * (f + 0.5 * s * (large - end))
        gain += (large - x) * s
    return work / (large - small), gain / (large - small)


@inner()
def slopes_in_piece(small, large, i, spring):
    """Average slopes between two compressions in piece i."""
    start, h, a, b, c, d = force_cubic(i, spring)
    t, u = (small - start) / h, (large - start) / h
    squares = t * t + t * u + u * u
    g = a + 0.5 * b * (t + u) + c * squares / 3.0 + 0.25 * d * (t + u) * (t * t + u * u)
    return g, (b + c * (t + u) + d * squares) / h
