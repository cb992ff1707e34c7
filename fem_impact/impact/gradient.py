"""`hit.gradient`: derivatives of what a blow does in the numbers that make it, each with its error."""

import html
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import check, markup
from .._base.check import SimulationError
from .._base.rounding import SAME
from ..fe.variation import SectionChange
from .compiled import record
from .compiled.layout import KIND
from .contact import sunk
from .parameters import POSSIBLE, Parameters, unit
from .quantities import rebound
from .sensitivity import Sensitivity, runs, together

if TYPE_CHECKING:
    from .response import History, Response

QUANTITIES = (
    "restitution", "impulse", "contact_time", "peak_force", "peak_time", "spectral_centroid", "spectral_level",
    "modal_energy",
)  # fmt: skip
UNIT_OF = {
    "impulse": "N s", "contact_time": "s", "peak_force": "N", "peak_time": "s", "spectral_centroid": "Hz",
    "spectral_level": "dB", "modal_energy": "J",
}  # fmt: skip
GRAZE = 1e-3  # [-] of the deepest approach: a touch or gap below it may come or go with a change of a thousandth
TIE = 1e-4  # [-] of the largest force: where two maxima are so alike, a change of 1e-4 may make the other the largest
# [-] least error of a slope per relative change over that of the value by its steps: onsets lie anywhere in a step, so
# two runs often agree by chance; 98 % of 320 slopes err less
SLOPES = 20.0
# [-] times per contact at which a flight is searched for near misses or two motions are compared, and their most
LOOKS = 16.0, 20_000
CUBIC = np.linspace(0.0, 1.0, 9) ** np.arange(4)[:, None]  # where in a piece of time its cubic is looked at, as powers
# halving the steps brings these no sure gain
ROUGH = "contact_time", "peak_force", "peak_time", "spectral_centroid", "spectral_level"
# [-] difference of two runs over the error of the finer one, as order 2 leaves; order 1 for collocation, cautious
RICHARDSON = {"A": 3.0, "A4": 3.0, "collocation": 1.0}
INSTEAD = "take differences of runs with the number changed, told to a smaller tolerance"


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of one quantity of a blow in n of its numbers.

    `gradient["striker.mass"]` is one of them, in units of the quantity over units of the number.
    """

    quantity: str
    value: Any  # of the quantity; (n_modes,) for the modal energy
    names: tuple[str, ...]  # (n,)
    numbers: np.ndarray  # (n,) their values
    slopes: np.ndarray  # (n,), or (n, n_modes), quantity over number
    error: np.ndarray  # like slopes, their estimated error from the time steps

    def __repr__(self) -> str:
        return check.brief(self)

    def __post_init__(self) -> None:
        check.lock_arrays(self)

    def __getitem__(self, name: str) -> Any:
        return self.slopes[self.names.index(check.one_of("name", name, self.names))]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    @property
    def relative(self) -> np.ndarray:
        """Relative change of the quantity per relative change of each number [-], shaped like `slopes`."""
        numbers = self.numbers.reshape(-1, *[1] * (self.slopes.ndim - 1))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.value == 0.0, 0.0, self.slopes * numbers / self.value)

    def change(self, **relative: float) -> Any:
        """First-order change of the quantity for relative changes of numbers, "." in their names written "_".

        Examples
        --------
        >>> modes, law = fi.Modes.rigid(1e6), fi.Contact.linear(1e5)
        >>> hit = fi.strike(modes, fi.Striker.rigid(0.1), law, at=None, speed=1.0, tolerance=1e-8)
        >>> slopes = hit.gradient("contact_time", wrt=("striker.mass", "contact.stiffness"))
        >>> round(slopes.change(striker_mass=0.02, contact_stiffness=0.02) / slopes.value, 6)
        0.0
        """
        known = {name.replace(".", "_"): i for i, name in enumerate(self.names)}
        for name in relative:
            check.one_of("relative", name, known)
        return sum(part * self.numbers[known[name]] * self.slopes[known[name]] for name, part in relative.items())

    def __str__(self) -> str:
        own = UNIT_OF.get(self.quantity.partition("=")[0], "")
        if self.slopes.ndim > 1:
            return f"{self.quantity} of {self.slopes.shape[1]} modes [{own}] in {', '.join(self.names)}"
        lines = [f"{self.quantity} {self.value:.6g}{f' {own}' if own else ''}"]
        for name, number, slope, error, part in zip(self.names, self.numbers, self.slopes, self.error, self.relative):
            at = f"{name} = {number:.6g} {unit(name)}".rstrip()
            lines.append(f"  {slope:+.5e} +- {error:.0e} per unit, {part:+.4f} % per %, in {at}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        if self.slopes.ndim > 1:
            return f"<p>{html.escape(str(self))}</p>"
        rows = [
            (name, f"{number:.5g} {unit(name)}", f"{slope:.5g}", f"{error:.0e}", f"{part:.4f}")
            for name, number, slope, error, part in zip(
                self.names, self.numbers, self.slopes, self.error, self.relative
            )
        ]
        head = ["number", "value", f"slope of {self.quantity}", "error", "% per %"]
        return markup.table(rows, head)


def gradients(
    hit: "Response", quantity: Any, wrt: Any, sections: Mapping[str, tuple[float, SectionChange]] | None = None
) -> dict[str, Gradient]:
    """The gradient of each quantity, see `Response.gradient`.

    ``sections`` are further numbers, each with its value and with how the target's section changes with it.
    """
    sections = sections or {}
    several = (quantity,) if isinstance(quantity, str) else check.several("quantity", quantity, str)
    wanted = [_asked(item) for item in several]
    if not hit.ends:
        raise ValueError(f"gradient needs a blow of `strike` or `collide`, not one of several strokes; {INSTEAD}")
    if sections and hit.striker is None:
        raise ValueError("sections are those of the target of `strike`; leave them out")
    if hit.history.law.shape[1] > KIND and not np.isin(hit.history.law[:, KIND], POSSIBLE).all():
        which = "the contact" if hit.history.n_contacts == 1 else "one of the contacts"
        raise SimulationError(f"no gradient: {which} is felt, whose past is not followed; {INSTEAD}")
    if hit.history.stretched is not None or (hit.striker is not None and hit.striker.hand is not None):
        why = "the target stretches" if hit.history.stretched is not None else "a hand holds the striker"
        raise SimulationError(f"no gradient: {why}, and what that changes is not followed; {INSTEAD}")
    if not hit.n_impacts:
        raise SimulationError("no gradient: the bodies never touched; check gap and speed")
    parameters = Parameters(hit, {name: change for name, (_, change) in sections.items()})
    names = parameters.checked(wrt)
    change = parameters.change(names)
    coarse = hit.coarse
    if coarse is not None and len(coarse.contacts) != len(hit.history.contacts):
        raise SimulationError(
            f"no gradient: runs of different steps find {len(coarse.contacts)} and {hit.n_impacts} impacts; give a "
            "smaller tolerance and no dt, or max_impacts"
        )
    peak = any(name.startswith("peak") for name, _ in wanted)
    joined = 1 if coarse is None else together(coarse)
    fine = Sensitivity.of(hit.history, change, peak, joined)
    _check_grazing(fine)
    rough = None if coarse is None else Sensitivity.of(coarse, change, peak, joined, coarse=True)
    numbers = np.array([sections[name][0] if name in sections else parameters.values[name] for name in names])
    found = {}
    if peak:
        _check_tie(fine.apart)
    for name, band in wanted:
        if name == "modal_energy" and (hit.rings is not None or hit.ringing is not None):
            raise SimulationError(
                "no gradient of modal_energy: the modes that ring did not tell the blow; strike modes, of find_modes"
            )
        value, spectrum = _value(hit, fine, name, band)
        slopes = _slopes(hit, fine, names, name, band, value, spectrum)
        if rough is None:
            error = np.full(slopes.shape, np.inf)
        else:
            apart = np.abs(slopes - _slopes(hit, rough, names, name, band, value, spectrum))
            gained = 1.0 if name in ROUGH else RICHARDSON[hit.scheme]
            if name == "peak_time":
                apart = np.maximum(apart, fine.peak_doubt)
            known = SLOPES * hit.error.step * (1.0 if name == "restitution" else np.max(np.abs(value)))
            error = _shared(apart / gained + SAME * np.abs(slopes), numbers, known)
        label = name if band is None else f"{name}={band:g}"
        found[label] = Gradient(label, value, names, numbers, slopes, error)
    return found


def _shared(error: np.ndarray, numbers: np.ndarray, known: float) -> np.ndarray:
    """Errors of slopes, (n,) or (n, n_modes), none of them below the largest, all per relative change of their number.

    Two runs may agree by chance on what one number does, but hardly on what all do. Nor is a slope per relative change
    known better than the value itself: ``known`` is SLOPES times what that errs.
    """
    size = np.abs(numbers).reshape(-1, *[1] * (error.ndim - 1))
    largest = np.maximum((size * error).max(axis=0), known)
    return np.maximum(error, np.divide(largest, size, out=np.zeros_like(error), where=size > 0.0))


def section_changes(sections: Any) -> dict[str, tuple[float, SectionChange]]:
    """The value of each further number, and how the section changes with it; see `Response.gradient`."""
    if sections is None:
        return {}
    if not isinstance(sections, Mapping) or not all(
        isinstance(name, str) and isinstance(pair, (tuple, list)) and len(pair) == 2 for name, pair in sections.items()
    ):
        raise ValueError(f"sections must be a dict of names to (value, function), got {check.shown(sections)}")
    return {
        name: (float(pair[0]), SectionChange.along(f"sections[{name!r}]", *pair)) for name, pair in sections.items()
    }


def _asked(item: Any) -> tuple[str, float | None]:
    """A quantity and its band [Hz]."""
    name, equals, band = str(item).partition("=")
    name = {"force": "peak_force"}.get(name.strip(), name.strip())
    check.one_of("quantity", name, QUANTITIES)
    if name.startswith("spectral") != bool(equals):
        rule = f"needs a frequency, such as '{name}=5000'" if not equals else f"has no frequency, write {name!r}"
        raise ValueError(f"quantity {name} {rule}")
    if not equals:
        return name, None
    try:
        return name, check.positive(f"frequency of {name}", float(band), "Hz")
    except ValueError:
        raise ValueError(
            f"frequency of {name} must be a positive number in Hz, got {check.shown(band.strip())}"
        ) from None


def _value(hit: "Response", found: Sensitivity, name: str, band: float | None) -> tuple[Any, np.ndarray | None]:
    """Value of a quantity, and the force's spectrum [N s] that it was read from, if any."""
    if name == "modal_energy":
        part, h = hit.body_slice(len(hit.bodies) - 1), hit.history
        return 0.5 * (h.end_p[part] ** 2 + (h.omega[part] * h.end_q[part]) ** 2), None
    if name == "spectral_centroid":
        assert band is not None
        return _centroid(band, hit.band_spectrum(band)[1])
    if name == "spectral_level":
        spectrum = hit.spectrum(np.array([0.0, band]))
        return level_of(spectrum), spectrum
    value = found.when_largest if name == "peak_time" else getattr(hit, name)
    if value is None:
        raise SimulationError(f"no gradient of {name}: {rebound(hit, 5)}")
    return value, None


def _centroid(band: float, spectrum: np.ndarray) -> tuple[float, np.ndarray]:
    """Centroid [Hz] of a spectrum at equally spaced frequencies up to a band, and the spectrum."""
    size, number = np.abs(spectrum), np.arange(len(spectrum))
    whole = size.sum() - 0.5 * (size[0] + size[-1])
    return band / (len(size) - 1) * float((size @ number - 0.5 * size[-1] * number[-1]) / whole), spectrum


def _slopes(
    hit: "Response", found: Sensitivity, names: tuple[str, ...], name: str, band: float | None, value: Any,
    spectrum: np.ndarray | None,
) -> np.ndarray:  # fmt: skip
    """Derivatives (n,) or (n, n_modes) of a quantity, of which `_value` is known."""
    if name == "restitution":
        rigid, touched = np.arange(hit.bodies[0].n_rigid), [c for c, _ in hit.ends[0].touched]
        if touched and hit.history.bias[rigid].any():
            speed, faster, slower = found.rebound(rigid, touched)
            return -(slower + value * faster) / speed
        arriving = _arriving(hit)
        faster = np.array([float(other == arriving) for other in names])
        return -(found.speed(rigid, touched[0]) + value * faster) / hit.speed
    if name == "modal_energy":
        return found.energies(hit.body_slice(len(hit.bodies) - 1)).T
    if name == "spectral_centroid":
        assert band is not None and spectrum is not None
        step = band / (len(spectrum) - 1)
        even = found.even_spectrum(len(spectrum), step)
        if found.history is not hit.history:  # the error of the coarser run's own spectrum counts, too
            value, spectrum = _centroid(band, even.value)
        size, share = np.abs(spectrum), np.ones(len(spectrum))  # of the trapezoidal rule
        share[[0, -1]] = 0.5
        weights = share * (step * np.arange(len(size)) - value) / (share @ size)
        return even.change(weights * np.conj(spectrum) / np.where(size > 0.0, size, 1.0))
    if name == "spectral_level":
        assert band is not None and spectrum is not None
        rates = np.real(found.spectrum(np.array([0.0, band])) / spectrum[:, None])  # (2, n) of the logarithms
        return np.asarray(20.0 / np.log(10.0) * (rates[1] - rates[0]))
    return np.asarray(getattr(found, name))


def _arriving(hit: "Response") -> str:
    """Name of the speed that the restitution is told by."""
    if hit.striker is not None:
        return "strike.speed"
    if not hit.speed or not hit.ends[0].touched:
        raise SimulationError("no gradient of restitution: no body arrives, or the first touches nothing")
    return f"speeds.{next(b for b, ends in enumerate(hit.ends) if ends.speed)}"


def level_of(spectrum: np.ndarray) -> float:
    """Level [dB] of the second of two values of a force spectrum re the first."""
    size = np.abs(spectrum)
    return 20.0 * float(np.log10(size[1] / size[0]))


def _check_tie(apart: float) -> None:
    """Raise SimulationError where two maxima of the force are so alike that either may be the largest."""
    if apart < TIE:
        raise SimulationError(
            f"no gradient of the largest force: two maxima differ by {apart:.1e} of it, and a small change may make "
            "the other the largest"
        )


def _check_grazing(found: Sensitivity) -> None:
    """Raise SimulationError next to a contact or a separation that barely happens, or barely does not."""
    way, n_contacts = _way(found), len(found.deepest)
    limit = GRAZE * float(found.deepest.max())  # of all, as a contact that only grazes has no depth to compare with
    for c in range(n_contacts):
        for what, least in (*_nearly(way, c), ("yield", _yields(found, c))):
            if least < limit:
                _refuse(what, least, f"contact {c}: " if n_contacts > 1 else "")


def _refuse(what: str, least: float, where: str) -> None:
    """Raise SimulationError that tells what barely happens, by how much [m] and at which contact."""
    words = {
        "touch": "an impact is only {} m deep, and would vanish",
        "gap": "the bodies come within {} m of parting, or part by no more, and one impact would be two",
        "miss": "the bodies pass each other at {} m, and would touch once more",
        "yield": "a later push stops {} m from yielding further, or yields by no more, and would do otherwise",
    }[what]
    raise SimulationError(
        f"no gradient next to a grazing contact: {where}{words.format(f'{least:.2g}')} with a small change of some "
        "number, at which contact time, peak and count have no derivative; take a slightly heavier or lighter "
        "striker, or strike elsewhere"
    )


@dataclass(frozen=True, eq=False)
class Way:
    """Approaches over a run, and beyond it as long as the bodies might touch once more."""

    time: np.ndarray  # (n + 1,) [s]
    approach: np.ndarray  # (n + 1, n_contacts) [m]
    rate: np.ndarray  # (n + 1, n_contacts) [m/s]
    closed: np.ndarray  # (n, n_contacts) between these times

    def __repr__(self) -> str:
        return check.brief(self)

    def between(self, c: int) -> np.ndarray:
        """Approach c [m] at the places of `CUBIC` between the times, (n, 9), by cubics through values and rates."""
        h, d, v = np.diff(self.time), self.approach[:, c], self.rate[:, c]
        d0, d1, v0, v1 = d[:-1], d[1:], v[:-1] * h, v[1:] * h
        return np.stack([d0, v0, 3.0 * (d1 - d0) - 2.0 * v0 - v1, 2.0 * (d0 - d1) + v0 + v1], axis=1) @ CUBIC


def _nearly(way: Way, c: int) -> Iterator[tuple[str, float]]:
    """What barely happens at contact c, or barely does not, and by how much [m]."""
    depth, v, closed = way.between(c), way.rate[:, c], way.closed[:, c]
    pressed, noise = runs(closed), SAME * float(np.abs(v).max())
    yield "touch", min((float(depth[a:b].max()) for a, b in pressed), default=np.inf)
    parts = float(np.abs(depth[closed & (v[:-1] < -noise) & (v[1:] >= -noise)]).min(initial=np.inf))
    yield "gap", min([parts, *(float(-depth[a:b].min(initial=0.0)) for (_, a), (b, _) in pairwise(pressed) if b > a)])
    turns = ~closed & (v[:-1] > noise) & (v[1:] <= noise)
    yield "miss", float((-depth[turns].max(axis=1, initial=-np.inf)).min(initial=np.inf))


def _yields(found: Sensitivity, c: int) -> float:
    """By how much a later push of plastic contact c exceeds the deepest one before, or falls short of it [m]."""
    if not found.pieces.yields.any():
        return np.inf
    ends = runs(found.pieces.yields[:, c])[:, 1]
    if not len(ends):
        return np.inf
    d, v = found.found.way[:, c].T
    noise = SAME * float(np.abs(v).max())
    turns = (v[:-1] > noise) & (v[1:] <= noise) & ~found.pieces.yields[1:, c]
    last = np.searchsorted(ends, np.arange(len(turns)), side="right") - 1
    deepest = Way(found.time, found.found.way[:, :, 0], found.found.way[:, :, 1], found.pieces.closed).between(c)
    short = (d[ends[last]] - deepest.max(axis=1))[turns & found.pieces.closed[:, c] & (last >= 0)]
    return float(min(np.abs(short).min(initial=np.inf), np.diff(d[ends]).min(initial=np.inf)))


def _way(found: Sensitivity) -> Way:
    """The approaches of a run, from the dents where contacts yielded.

    While no contact is closed, at many times, and so beyond an end that the run saw.
    """
    history, pressed, way = found.history, found.pieces.closed, found.found.way.copy()
    way[:, :, 0] -= sunk(history.law, found.pieces.memory)
    free = np.asarray(~pressed.any(axis=1))
    still = not (history.start_q.any() or history.start_p[history.omega > 0.0].any() or history.bias.any())
    flights = [(a, b) for a, b in runs(free).tolist() if a > 0 or not still]  # before the first impact nothing swings
    parts = [_flight(found, a, found.time[b]) for a, b in flights]
    free[: flights[0][0] if flights else None] = False
    parts += [(found.time[a:b], way[a:b], pressed[a:b]) for a, b in runs(~free).tolist()]
    parts.sort(key=lambda part: float(part[0][0]))
    ahead = _ahead(found) if history.status == record.FINISHED else 0.0
    if ahead > 0.0:
        parts.append(_flight(found, len(found.time) - 1, history.end_time + ahead))
    else:
        parts.append((found.time[-1:], way[-1:], pressed[-1:]))
    time, way, closed = (np.concatenate(column) for column in zip(*parts))
    return Way(time, way[:, :, 0], way[:, :, 1], closed[: len(time) - 1])


def _ahead(found: Sensitivity) -> float:
    """How long after the end of a run its modes together could nearly bridge a gap between two bodies [s]."""
    history = found.history
    rigid, shape = history.omega == 0.0, history.shape
    size = np.hypot(history.end_q, history.end_p / np.where(rigid, 1.0, history.omega))
    gap = -(history.offset + shape[:, rigid] @ history.end_q[rigid]) - GRAZE * found.deepest.max()
    apart = -shape[:, rigid] @ history.end_p[rigid]  # [m/s]
    reach = np.abs(shape[:, ~rigid]) @ size[~rigid] - gap
    if (reach[apart <= 0.0] > 0.0).any():  # bodies that swing, but do not part
        return LOOKS[1] / LOOKS[0] * _duration(history)
    return float((reach[apart > 0.0] / apart[apart > 0.0]).max(initial=0.0))


def _duration(history: "History") -> float:
    """Of the longest impacts of each contact, the shortest [s]."""
    rows = history.contacts
    return min(float(np.ptp(rows[rows[:, 4] == c, :2], axis=1).max()) for c in set(rows[:, 4].tolist()))


def _flight(found: Sensitivity, begin: int, end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The way from the start of a piece on to a later time [s], in which no contact is closed, without its end.

    Times (n,) [s], approaches [m] and rates [m/s] there (n, n_contacts, 2), and that all contacts are open.
    """
    history, start = found.history, found.time[begin]
    q, p = (x[0] for x in history.states(np.array([start])))
    free = replace(history, start_q=q, start_p=p, steps=history.steps[:0])
    count = int(np.clip(LOOKS[0] * (end - start) / max(_duration(history), 1e-300), 16, LOOKS[1]))
    times = np.linspace(0.0, end - start, count + 1)[:-1]
    q, p = free.states(times)
    way = np.stack(
        [history.offset - sunk(history.law, found.pieces.memory)[begin] + q @ history.shape.T, p @ history.shape.T],
        axis=2,
    )
    return start + times, way, np.zeros((count, history.n_contacts), bool)
