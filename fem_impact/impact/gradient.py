"""`hit.gradient`: derivatives of what a blow does in the numbers that make it, each with its error.

They are differences of the same blow run again with one number changed a little, in steps of their own.
"""

import html
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import check, markup
from .._base.check import SimulationError
from ..fe.variation import SectionChange
from . import engine, force_spectrum
from .compiled import layout
from .compiled.law import columns
from .history import History, mode_energy
from .parameters import ONE_SIDED, Parameters, unit
from .quantities import UNITS, checked_band, name_and_band, rebound

if TYPE_CHECKING:
    from .response import Response

QUANTITIES = (
    "restitution", "impulse", "contact_time", "peak_force", "peak_time", "spectral_centroid", "spectral_level",
    "modal_energy",
)  # fmt: skip
NUDGE = 1e-5  # [-] relative change of a number: its square is far below any tolerance, rounding over it below 1e-9
# [-] steps of the blow over those of the runs, and changes of a number in them: the first give the slopes, the others,
# which err some ten times less, the error
RUNS = (2.0, 2.0 * NUDGE), (4.0, NUDGE)
# Gauss nodes of a step and their weights: a force that sets in like x**1.5 loses 1e-9 of its impulse
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
FEW = 2  # [-] looks per step for the largest force
ZOOMS, ABOUT = 3, np.linspace(-1.0, 1.0, 17)  # how often and where about the largest of these looks it is looked for
INSTEAD = "take differences of runs with the number changed, at a smaller tolerance"


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(check.Locked):
    """Derivatives of one quantity of a blow in n of its numbers.

    `gradient["striker.mass"]` is one of them, in units of the quantity over units of the number.
    """

    quantity: str
    value: Any  # of the quantity; (n_modes,) for the modal energy
    names: tuple[str, ...]  # (n,)
    numbers: np.ndarray  # (n,) their values
    slopes: np.ndarray  # (n,), or (n, n_modes), quantity over number
    error: np.ndarray  # like slopes, their estimated error from the time steps

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
        >>> bool(abs(slopes.change(striker_mass=0.02, contact_stiffness=0.02)) < 1e-6 * slopes.value)
        True
        """
        known = {name.replace(".", "_"): i for i, name in enumerate(self.names)}
        for name in relative:
            check.one_of("relative", name, known)
        return sum(part * self.numbers[known[name]] * self.slopes[known[name]] for name, part in relative.items())

    def __str__(self) -> str:
        own = UNITS[self.quantity.partition("=")[0]]
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
        columns = zip(self.names, self.numbers, self.slopes, self.error, self.relative)
        rows = [
            (name, f"{number:.5g} {unit(name)}", f"{slope:.5g}", f"{error:.0e}", f"{part:.4f}")
            for name, number, slope, error, part in columns
        ]
        head = ["number", "value", f"slope of {self.quantity}", "error", "% per %"]
        return markup.table(rows, head)


def gradients(
    hit: "Response", quantity: Any, wrt: Any, sections: Mapping[str, tuple[float, SectionChange]]
) -> dict[str, Gradient]:
    """The gradient of each quantity, see `Response.gradient`.

    ``sections`` are further numbers, each with its value and with how the target's section changes with it.
    """
    several = (quantity,) if isinstance(quantity, str) else check.tuple_of("quantity", quantity, str)
    wanted = []
    for item in several:
        name, band = name_and_band(item)
        name = check.one_of("quantity", {"force": "peak_force"}.get(name, name), QUANTITIES)
        wanted.append((name, checked_band(name, band, name.startswith("spectral"))))
    _check_possible(hit, wanted, bool(sections))
    parameters = Parameters(hit, sections)
    names = parameters.checked(wrt)
    numbers = parameters.numbers(names)
    span = max(impact.end for impact in hit.impacts)
    bands = [band for name, band in wanted if band is not None and name == "spectral_centroid"]
    frequencies = {band: force_spectrum.dense_frequencies(band, span) for band in bands}
    read = partial(read_quantities, wanted=wanted, frequencies=frequencies)
    found = {}
    values = [value_of(hit, name, band) for name, band in wanted]
    for (name, band), value, (slopes, error) in zip(wanted, values, differences(parameters, names, read)):
        label = name if band is None else f"{name}={band:g}"
        if name == "peak_time":  # the top of a force is flat, and ripples move it
            error = 5.0 * error
        found[label] = Gradient(label, value, names, numbers, slopes, error)
    return found


def differences(
    parameters: Parameters, names: tuple[str, ...], read: Callable[["Response"], list[Any]]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Slopes in numbers (n,) of each quantity that ``read`` reads from a blow, and their errors: (n,), (n, m)."""
    hit, numbers = parameters.hit, parameters.numbers(names)
    change, faster, whole = parameters.change(names), parameters.faster(names), step_of(hit)
    sizes = np.array([abs(number) or parameters.size(name) for name, number in zip(names, numbers)])
    one_sided = np.array([number == 0.0 and name.endswith(ONE_SIDED) for name, number in zip(names, numbers)])

    def again(step: float, i: int = 0, by: float = 0.0) -> list[Any]:
        """The quantities with number i larger by so much, in steps [s] in contact of one's own."""
        h, changed = hit.history, {}
        for name, each, slopes in zip(change._fields, h.system, change) if by else ():
            more = columns(each) + by * columns(slopes[i])
            changed[name] = more.view(each.dtype).reshape(each.shape)
        history = engine.follow_again(h, step, **changed)
        if len(history.contacts) != len(h.contacts):
            raise SimulationError(
                f"no gradient: runs of different steps find {len(history.contacts)} and {len(h.contacts)} impacts; "
                "give a smaller tolerance and no dt, or max_impacts"
            )
        return read(replace(hit, history=history, speed=hit.speed + by * faster[i]))

    runs = [_slopes(partial(again, whole / finer), sizes, one_sided, nudge) for finer, nudge in RUNS]
    found = []
    for slopes, finer in zip(*runs):
        # the last is rounding over NUDGE
        error = 3.0 * np.abs(slopes - finer) + 1e-8 * np.abs(slopes).max(axis=0)
        by = sizes.reshape(-1, *[1] * (slopes.ndim - 1))
        found.append((slopes / by, error / by))
    return found


def _check_possible(hit: "Response", wanted: list[tuple[str, float | None]], sections: bool) -> None:
    """Raise SimulationError for a blow without a gradient, or next to another blow; ValueError for other arguments."""
    h, asked = hit.history, [name for name, _ in wanted]
    if not hit.ends:
        raise ValueError(f"gradient needs a blow of `strike` or `collide`, not one of several strokes; {INSTEAD}")
    if sections and hit.striker is None:
        raise ValueError("sections are those of the target of `strike`; leave them out")
    if h.stretched is not None or (hit.striker is not None and hit.striker.hand is not None):
        why = "the target stretches" if h.stretched is not None else "a hand holds the striker"
        raise SimulationError(f"no gradient: {why}, and what that changes is not followed; {INSTEAD}")
    if not hit.n_impacts:
        raise SimulationError("no gradient: the bodies never touched; check gap and speed")
    if h.n_blind:
        raise SimulationError(
            "no gradient: the bodies chatter, and the run passed over contacts without locating them; give "
            "max_impacts, a shorter duration or no dt"
        )
    if "modal_energy" in asked and (hit.rings is not None or hit.ringing is not None):
        raise SimulationError(
            "no gradient of modal_energy: the modes that ring did not carry the blow; strike modes of find_modes"
        )
    if h.nearest_turn < 1e-3:
        raise SimulationError(
            f"no gradient next to a grazing contact: {h.nearest_turn:.1g} of the deepest approach more or less, and "
            "the bodies touch once more or less often; take a slightly heavier or lighter striker, or strike elsewhere"
        )
    if any(name.startswith("peak") for name in asked) and (apart := _lead_of_peak(h)) < 1e-4:
        raise SimulationError(
            f"no gradient of the peak force: two maxima differ by {apart:.1e} of it, and a small change may make "
            "the other the largest"
        )


def value_of(hit: "Response", name: str, band: float | None) -> Any:
    """Value of a quantity of the blow itself."""
    if name == "spectral_centroid" and band is not None:
        return hit.spectral_centroid(band)
    if name == "restitution" and hit.restitution is None:
        raise SimulationError(f"no gradient of restitution: {rebound(hit, 5)}")
    if band is not None or name in ("peak_time", "modal_energy"):
        return read_quantities(hit, [(name, band)], {})[0]
    return getattr(hit, name)


def _slopes(
    again: Callable[..., list[Any]], sizes: np.ndarray, one_sided: np.ndarray, nudge: float
) -> list[np.ndarray]:
    """Of each quantity its slopes per relative change of each number, from changes by ``nudge`` of their sizes."""
    plain, rows, bends = again(), [], []
    for i, (by, one) in enumerate(zip(nudge * sizes, one_sided)):
        low, high = (plain, again(i, 2.0 * by)) if one else (again(i, -by), again(i, by))
        middle = again(i, by) if one else plain
        bends.append([(b - 2.0 * m + a) / nudge for a, m, b in zip(low, middle, high)])
        rows.append([(b - a) / (2.0 * nudge) - one * c for a, b, c in zip(low, high, bends[-1])])
    found = [np.array(each) for each in zip(*rows)]
    for value, slopes, bend in zip(plain, found, zip(*bends)):
        # slopes on both sides differ by 1e-4 to 5e-4 where a blow is smooth
        if np.max(np.abs(bend)) > 0.02 * max(np.max(np.abs(value)), np.max(np.abs(slopes))):
            raise SimulationError(
                "no gradient: slopes on both sides of this blow differ, as with a small change of some number another "
                "force becomes the largest, or a later push yields further; change some number slightly"
            )
    return found


def step_of(hit: "Response") -> float:
    """Step [s] of a blow in contact."""
    h = hit.history
    return float(h.steps[h.pressed.any(axis=1), layout.LENGTH].max())


def read_quantities(
    blow: "Response", wanted: list[tuple[str, float | None]], frequencies: Mapping[float, np.ndarray]
) -> list[Any]:
    """The quantities of a blow; ``frequencies`` [Hz] are those of the spectrum of each band."""
    found: list[Any] = []
    for name, band in wanted:
        if name == "modal_energy":
            part, h = blow.body_slice(len(blow.bodies) - 1), blow.history
            state = h.state(max(impact.end for impact in blow.impacts))  # felt is followed for longer
            found.append(mode_energy(h.omega[part], *state[:, part]))
        elif band is not None:
            time, impulse = _impulses(blow.history)
            if name == "spectral_centroid":
                asked = frequencies[band]
                spectrum = force_spectrum.transform_impulses(time, impulse, asked[1], len(asked))
                found.append(force_spectrum.centroid(asked, spectrum))
            else:
                low, high = np.abs(np.exp(-2j * np.pi * np.array([[0.0], [band]]) * time) @ impulse)
                found.append(20.0 * float(np.log10(high / low)))
        elif name.startswith("peak"):
            found.append(peak_of_force(blow.history)[name == "peak_force"])
        else:
            found.append(getattr(blow, name))
    return found


def _forces_in_steps(history: History, c: int, count: int) -> np.ndarray:
    """Force [N] of contact c at so many equal fractions of every step, in order of time; zero where it is open."""
    rows = np.arange(len(history.steps)).repeat(count)
    force = history.force_of(rows, c, np.tile(np.arange(count) / count, len(history.steps)))[0]
    return np.where(history.pressed[rows, c], force, 0.0)


def peak_of_force(history: History) -> tuple[float, float]:
    """When a force is largest [s], and that force [N]."""
    looks = [_forces_in_steps(history, c, FEW) for c in range(history.n_contacts)]
    c = int(np.argmax([each.max(initial=0.0) for each in looks]))
    row, part = divmod(int(looks[c].argmax()), FEW)
    length = history.steps[:, layout.LENGTH]
    time = history.steps[row, layout.START] + part * length[row] / FEW
    width = length[max(row - 1, 0) : row + 1].max() / FEW  # a short step may begin just after the peak in a long one
    for _ in range(ZOOMS):
        times = np.clip(time + width * ABOUT, 0.0, history.end_time)
        force, rate = history.force_at(times, c)
        k = min(max(int(force.argmax()), 1), len(times) - 2)
        k -= rate[k] < 0.0
        time, width = times[k], times[k + 1] - times[k]
    if rate[k] > 0.0 >= rate[k + 1]:
        time += width * rate[k] / (rate[k] - rate[k + 1])
    return float(time), float(history.force_at(np.array([time]), c)[0][0])


def _lead_of_peak(history: History) -> float:
    """By how much the largest force exceeds the next of the maxima [-]."""
    maxima = []
    for c in range(history.n_contacts):
        force = np.pad(_forces_in_steps(history, c, 16), 1)
        maxima.append(force[1:-1][(force[1:-1] > force[:-2]) & (force[1:-1] >= force[2:])])
    rival, top = np.sort(np.concatenate([[0.0, 0.0], *maxima]))[-2:]
    return float((top - rival) / top) if top > 0.0 else np.inf


def _impulses(history: History) -> tuple[np.ndarray, np.ndarray]:
    """Ascending times (n,) [s] and impulses (n,) [N s] with the spectrum of all forces together."""
    times, impulses = [], []
    for c, pressed in enumerate(history.pressed.T):
        rows = np.flatnonzero(pressed).repeat(len(NODES))
        part, length = np.tile(0.5 + 0.5 * NODES, pressed.sum()), history.steps[rows, layout.LENGTH]
        times.append(history.steps[rows, layout.START] + part * length)
        impulses.append(np.tile(0.5 * WEIGHTS, pressed.sum()) * length * history.force_of(rows, c, part)[0])
    time, impulse = np.concatenate(times), np.concatenate(impulses)
    order = np.argsort(time, kind="stable")
    return time[order], impulse[order]


def section_changes(sections: Any) -> dict[str, tuple[float, SectionChange]]:
    """The value of each further number, and how the section changes with it; see `Response.gradient`."""
    if sections is None:
        return {}
    if not isinstance(sections, Mapping) or not all(
        isinstance(name, str) and isinstance(pair, (tuple, list)) and len(pair) == 2 for name, pair in sections.items()
    ):
        raise ValueError(f"sections must be a dict of names to (value, function), got {check.shown(sections)}")
    return {
        name: (float(pair[0]), SectionChange.by_differences(f"sections[{name!r}]", *pair))
        for name, pair in sections.items()
    }
