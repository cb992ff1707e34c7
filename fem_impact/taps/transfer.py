"""Frequency responses of measured taps, and measured modes beside computed ones."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import linear_sum_assignment
from scipy.stats import f

from .._base import check, isolated
from .._base.files import replacing
from .._base.threads import one_thread
from ..modes import picked, universal_files
from ..modes.modal import Modes
from . import readers, triggers
from .records import Taps
from .units import UFF_UNITS, axis_factor, uff_unit
from .units import si_unit as known_unit
from .windows import join_tables

METHODS = ("H1", "H2", "Hv")
SURE = 0.9  # [-] probability that the true response lies within the error stated
WAY = ("node", "direction", "reference", "reference_direction")  # of a response in data set 58
ENDS = ("place", "struck")  # where it is measured and struck
RESPONSE_CODE = {unit: code for code, unit in UFF_UNITS.items() if unit != "N"}


@one_thread
def frf(
    records: Any,
    *,
    method: str = "H1",
    force_window: float | None = None,
    response_window: float | None = None,
    n_times: int | None = None,
) -> xr.Dataset:
    """Frequency responses of a structure from taps, averaged, or as a universal file holds them.

    Every tap counts by the spectrum of its whole force. A double hit serves as well as a single one: only where its
    spectrum nearly vanishes it adds little, and there another tap, of another delay, adds more. It costs where the
    noise of the force fills these holes, and where the record ends before what the second pulse excites has died.

    Parameters
    ----------
    records : Taps or sequence of Taps, with responses, or path of a universal file
        With the path of a file that holds frequency responses (data set 58, function type 4) they are read as they
        stand, in SI units; the other arguments are for taps.
    method : "H1", "H2" or "Hv"
        H1 holds for noise in the response, H2 for noise in the force; Hv, their geometric mean, for equal shares of
        noise in both.
    force_window : float [s], optional
        The force counts for this time from a tenth of it before each pulse on; its last quarter falls as a cosine.
    response_window : float [s], optional
        Time constant of an exponential window over force and response; it adds 1 / (omega time) to the damping ratio
        of every mode, which the caller takes off.
    n_times : int, optional
        Samples of the transform: more than the record pads it with zeros.

    Returns
    -------
    xarray.Dataset
        ``H`` (frequency, channel), complex, in the response's unit per N; ``coherence`` (frequency, channel); ``error``
        (frequency, channel), the radius around ``H`` that holds the true response with a probability of 0.9, from how
        far the taps differ or, of one tap, from the noise before it, and from what noise takes off H1 or adds to H2
        (what all taps share, such as a record that ends too early, or a channel that comes late, whose delay
        `fi.Modes.from_frf` takes off, is not in it; NaN if the noise is not known);
        ``force`` (frequency), the mean amplitude spectrum [N s], and ``force_error`` (frequency), the part of the
        relative error that is noise of the force, which a force window makes alike in neighbouring lines; attributes
        ``averages``, ``method``, ``rate`` and ``notes`` (of taps of which a channel is cut off or dead, and of
        windows that cut off more). Of a file
        ``H``, and ``coherence`` if it holds one for each; of each channel ``node`` and ``direction``, ``reference`` and
        ``reference_direction`` (where it is struck), and, if the file has nodes, ``place`` and ``struck`` (channel,
        axis) [m]; attribute ``notes``. `fi.Modes.from_frf`, `fi.update` and `fi.matched` take it.

    Raises
    ------
    ValueError
        If taps have no response, or the force of all is cut off or dead, or a file is cut off, holds no complex
        responses of a motion to a force at the same ascending frequencies, values that are no finite numbers, or units
        that contradict its codes.

    References
    ----------
    ISO 7626-5; Bendat and Piersol, Random Data, chapters 6 and 9.

    Examples
    --------
    >>> known = {"points": [[0.0]], "mass": 1.0, "damping_ratio": 0.02, "complete": True}
    >>> rod = fi.Modes.from_arrays([0.0, 700.0], [[1.0, 1.0]], **known)
    >>> hit = fi.strike(rod, fi.Striker.rigid(0.02), fi.Contact.linear(1e5), at=[0.0], speed=1.0)
    >>> tap = fi.measure(hit, rate=25600.0, at=[[0.0]], duration=0.5)
    >>> found = fi.frf(tap)
    >>> peak = np.abs(found.H.values[:, 0]).argmax()
    >>> round(float(found.frequency.values[peak]))  # Hz
    700
    """
    if isinstance(records, (str, Path)):
        return read_frf(check.path("records", records))
    check.one_of("method", method, METHODS)
    taps, notes = _whole_taps(join_tables(records, "records"))
    shade, fade = np.ones((taps.n_taps, 1)), np.ones(taps.force.shape)
    if response_window is not None:
        fade = _response_window(taps, check.positive("response_window", response_window, "s"))
        notes += _faded(taps, fade)
    count = len(taps.time) if n_times is None else check.count("n_times", n_times, low=2, high=2**24)
    notes += [f"only the first {count} of {len(taps.time)} samples are used"] * (count < len(taps.time))
    if force_window is not None:
        shade = _force_window(taps, check.positive("force_window", force_window, "s"))
        notes += _lost(taps, shade)
    windows = shade * fade, fade
    F, X = (
        np.fft.rfft(rows * window[:, :, None], count, axis=1) / taps.rate  # (n_taps, n_frequencies, 1 or n_channels)
        for rows, window in zip((taps.force[:, :, None], taps.response), windows)
    )
    ff, xx, xf = (np.abs(F) ** 2).mean(0), (np.abs(X) ** 2).mean(0), (X * F.conj()).mean(0)
    tiny = np.finfo(float).tiny
    coherence = np.clip(np.abs(xf) ** 2 / np.maximum(ff * xx, tiny), 0.0, 1.0)
    H1 = xf / np.maximum(ff, tiny)
    H2 = np.divide(H1, coherence, out=np.array(H1), where=coherence > np.finfo(float).eps ** 2)  # below it is rounding
    H = {"H1": H1, "H2": H2, "Hv": np.sqrt(np.abs(H1) * np.abs(H2)) * np.exp(1j * np.angle(xf))}[method]
    # of white noise in every line of force and response, from its deviations before the taps
    powers = [(rest**2 * np.square(window).sum(axis=1, keepdims=True)).mean(axis=0) / taps.rate**2
              for rest, window in zip((taps.noise[:, None], _rest(taps)), windows)]  # fmt: skip
    shares = [power / np.maximum(whole, tiny) for power, whole in zip(powers, (ff, xx))]
    bias = {"H1": shares[0], "H2": shares[1], "Hv": 0.5 * np.abs(shares[0] - shares[1])}[method]
    if taps.n_taps == 1:
        scatter = np.sqrt(-np.log(1.0 - SURE) * (shares[0] + shares[1]))
    else:
        scatter = _scatter(F, X - H1 * F) / np.maximum(np.abs(H1), tiny)
    return xr.Dataset(
        {
            "H": (("frequency", "channel"), H),
            "coherence": (("frequency", "channel"), coherence),
            "error": (("frequency", "channel"), np.abs(H) * (scatter + bias)),
            "force": ("frequency", np.sqrt(ff[:, 0]), {"units": "N s"}),
            "force_error": ("frequency", np.sqrt(shares[0][:, 0] / taps.n_taps)),
        },
        {
            "frequency": ("frequency", np.fft.rfftfreq(count, 1.0 / taps.rate), {"units": "Hz"}),
            "channel": taps.table["channel"].values,
            "units": ("channel", [f"{unit}/N" for unit in taps.units]),
        },
        {
            "averages": taps.n_taps, "method": method, "rate": taps.rate,
            "added_damping": 0.0 if response_window is None else 1.0 / response_window,
            "force_window": 0.0 if force_window is None else force_window, "notes": notes,
        },
    )  # fmt: skip


def _whole_taps(taps: Taps) -> tuple[Taps, list[str]]:
    """Those whose channels are neither cut off nor dead, as far as there are any; and what else there is."""
    if not taps.response.shape[2]:
        raise ValueError("records must have a response channel; read them with response=")
    still = triggers.is_still(np.concatenate([taps.force[:, :, None], taps.response], axis=2))
    good, notes = ~(taps.overload | still[:, 0] | still[:, 1:].all(axis=1)), []
    if not good.any():
        raise ValueError(
            "records must hold one tap at least whose force is not cut off, and changes as a response does"
        )
    causes = {"does not change": still.any(axis=1), "is cut off": taps.table["overload"].values.any(axis=1),
              "stands still amid its motion": triggers.filled(taps.force, taps.response).any(axis=1),
              "begins or ends within a pulse": taps.cut_short | (taps.onset <= 0.0)}  # fmt: skip
    for why, which in causes.items():
        if which.any():
            some = (good & ~which).any()
            good = good & ~which if some else good
            said = "left out, because" if some else "used, although"
            notes.append(f"{said} a channel {why}: {', '.join(np.array(taps.labels)[which])}")
    return taps.pick(good), notes


def _force_window(taps: Taps, length: float) -> np.ndarray:
    """One around every pulse of every tap, zero elsewhere, (n_taps, n_times)."""
    found = np.zeros(taps.force.shape)
    for row, onset, pulses in zip(found, taps.onset, taps.pulses):
        for start in (onset, *(first / taps.rate for first, _ in pulses if first > onset * taps.rate)):
            x = (taps.time - start) / length
            fall = np.clip((x - 0.75) / 0.25, 0.0, 1.0)  # its last quarter falls as a cosine: it ends smoothly
            np.maximum(row, np.where(x < -0.1, 0.0, 0.5 + 0.5 * np.cos(np.pi * fall)), out=row)
    return found


def _response_window(taps: Taps, tau: float) -> np.ndarray:
    """One up to each tap, falling exponentially with a time constant [s] from there, (n_taps, n_times)."""
    return np.exp(-np.maximum(taps.time - taps.onset[:, None], 0.0) / tau)


def _lost(taps: Taps, shade: np.ndarray) -> list[str]:
    """A note if a window of the force (n_taps, n_times) cuts off more than a hundredth of the pulses of a tap."""
    inside = np.zeros(taps.force.shape)
    for row, pulses in zip(inside, taps.pulses):
        for first, end in pulses:
            row[first:end] = 1.0
    lost = 1.0 - (shade * inside * taps.force).sum(axis=1) / np.maximum((inside * taps.force).sum(axis=1), 1e-300)
    if lost.max() <= 0.01 or not inside.any():
        return []
    return [f"force_window cuts off up to {100.0 * lost.max():.2g} % of the force of a tap; make it longer"]


def _faded(taps: Taps, fade: np.ndarray) -> list[str]:
    """A note if a window of the responses (n_taps, n_times) leaves less than a fiftieth of what they hold over noise.

    One that is a fifth of a record leaves a tenth of a response that does not decay at all.
    """
    power = np.square(taps.response) - np.nan_to_num(_rest(taps))[:, None] ** 2
    share = (power * fade[:, :, None] ** 2).sum(axis=(0, 1)) / np.maximum(power.sum(axis=(0, 1)), 1e-300)
    least = float(np.min(share, initial=1.0, where=power.sum(axis=(0, 1)) > 0.0))
    if least > 0.02:
        return []
    return [f"response_window leaves {100.0 * max(least, 0.0):.1g} % of the power of a response; make it longer"]


def _rest(taps: Taps) -> np.ndarray:
    """Standard deviation of each response before its tap, (n_taps, n_channels); NaN where that is too short."""
    ends = (taps.onset * taps.rate).astype(int) - triggers.GUARD
    short = np.full(taps.response.shape[2], np.nan)
    return np.array([rows[:n].std(axis=0) if n >= triggers.FEWEST else short for rows, n in zip(taps.response, ends)])


def _scatter(force: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Radius around H1 by how far it moves without each tap (the jackknife), whatever noise larger taps have.

    Of spectra of the force and of what H1 leaves of the responses, (n_taps, n_frequencies, 1 or n_channels).
    """
    n_taps, power = len(force), np.abs(force) ** 2
    others = np.maximum(power.sum(axis=0) - power, np.finfo(float).eps * power)
    moved = np.abs(force.conj() * left) / np.maximum(others, np.finfo(float).tiny)
    freedom = 2 * n_taps - 2
    return np.sqrt(f.ppf(SURE, 2, freedom) * (1.0 - 1.0 / n_taps) * np.square(moved).sum(axis=0))


def mac(first: Any, second: Any) -> np.ndarray:
    """Modal assurance criterion of shapes (n_points, n_first) and (n_points, n_second), (n_first, n_second) [-].

    References
    ----------
    Allemang and Brown (1982), Proc. 1st IMAC, 110-116.

    Examples
    --------
    >>> fi.mac([[1.0, 1.0], [1.0, -1.0]], [[2.0, 1.0], [2.0, 0.0]]).tolist()
    [[1.0, 0.5], [0.0, 0.5]]
    """
    one, two = _shapes("first", first), _shapes("second", second)
    if len(one) != len(two):
        raise ValueError(f"first and second must be shapes at the same points, got {one.shape} and {two.shape}")
    cross = np.abs(one.conj().T @ two) ** 2
    sizes = np.outer((np.abs(one) ** 2).sum(axis=0), (np.abs(two) ** 2).sum(axis=0))
    return cross / np.maximum(sizes, np.finfo(float).tiny)


def _shapes(name: str, value: Any) -> np.ndarray:
    """Real or complex shapes (n_points, n_modes), finite."""
    try:
        found = np.asarray(value)
    except ValueError:
        found = np.zeros(0, object)
    if found.dtype.kind not in "iufc" or found.ndim != 2 or not (np.abs(found) <= check.REACH).all():
        raise ValueError(f"{name} must be finite shapes (n_points, n_modes), got {check.shown(value)}")
    return found


@dataclass(frozen=True)
class Pair:
    """A measured mode and the computed one that belongs to it."""

    measured: int
    computed: int
    measured_frequency: float  # [Hz]
    computed_frequency: float  # [Hz]
    mac: float | None  # [-] None without shapes

    @property
    def difference(self) -> float:
        """Computed over measured frequency, less one [-]."""
        return self.computed_frequency / self.measured_frequency - 1.0


def matched(measured: Any, computed: Any, *, points: Any = None, which: Any = None) -> tuple[Pair, ...]:
    """Pairs of measured and computed modes, in order of the measured frequencies.

    Parameters
    ----------
    measured : Modes, or array_like of frequencies (n_measured,) [Hz]
    computed : Modes, or array_like of frequencies (n_computed,) [Hz]
    points : array_like, (n_points, dimension) [m], optional
        Where both shapes are compared, for two `Modes`; by default the points of the measured ones. With shapes, modes
        are paired by MAC and frequency together; without, by frequency in ascending order.
    which : sequence of int, optional
        Numbers of the measured modes that are paired; the others, such as peaks of the rig, stay alone.

    Examples
    --------
    >>> pairs = fi.matched([100.0, 310.0], [99.0, 205.0, 300.0])
    >>> [(pair.computed, round(100 * pair.difference, 1)) for pair in pairs]  # number, %
    [(0, -1.0), (2, -3.2)]
    """
    one, two = frequencies("measured", measured), frequencies("computed", computed)
    used = np.unique(np.arange(len(one))[slice(None) if which is None else which])
    one = one[used]
    if not len(one) or len(two) < len(one):
        raise ValueError(f"computed must have at least the {len(one)} modes of measured, got {len(two)}")
    gap = np.abs(np.log(np.maximum(two, 1e-300) / np.maximum(one[:, None], 1e-300)))
    if isinstance(measured, Modes) and isinstance(computed, Modes):
        place = measured.shapes.grid()[0] if points is None else points
        likeness = mac(measured.shape_at(place)[:, used], computed.shape_at(place))
        rows, columns = linear_sum_assignment(1.0 - likeness + np.minimum(gap, 10.0))  # mostly shapes decide
        values: list[float | None] = [float(likeness[i, j]) for i, j in zip(rows, columns)]
    else:
        rows, columns = np.arange(len(one)), in_order(gap)
        values = [None] * len(one)
    return tuple(
        Pair(int(used[i]), int(j), float(one[i]), float(two[j]), value) for i, j, value in zip(rows, columns, values)
    )


def frequencies(name: str, value: Any) -> np.ndarray:
    """Ascending frequencies [Hz] of `Modes`, of the peaks of frequency responses, or of an argument that lists them."""
    if picked.is_frf(value):
        return picked.pick(name, value).frequencies
    return value.frequencies if isinstance(value, Modes) else check.ascending(name, value, "Hz")


def in_order(gap: np.ndarray) -> np.ndarray:
    """Ascending columns that make the sum of gaps (n_rows, n_columns) between ascending numbers smallest.

    Pairs that cross are never nearer than those in order, so that any assignment gives the columns.
    """
    return np.sort(linear_sum_assignment(gap)[1])


def write_uff(path: str | Path, data: xr.Dataset) -> None:
    """Write frequency responses of `frf` to data sets 58 of a universal file; needs pyuff."""
    pyuff = check.extra("pyuff", "uff", "a universal file")
    codes = {"func_type": readers.FREQUENCY_RESPONSE, "ord_data_type": 6, "abscissa_spec_data_type": 18}
    frequency, sets = data["frequency"].values, []
    for k, name in enumerate(data["channel"].values):
        unit = str(data["units"].values[k]).removesuffix("/N")
        made = universal_files.function(str(name), k + 2, 3, frequency, data["H"].values[:, k]) | codes
        ends = zip(("rsp_node", "rsp_dir", "ref_node", "ref_dir"), WAY)
        way = {key: int(data[name].values[k]) for key, name in ends if name in data.coords}
        sets.append(made | {"ordinate_spec_data_type": RESPONSE_CODE[unit], "orddenom_spec_data_type": 13} | way)
        if "coherence" in data:
            sure = {"func_type": readers.COHERENCE, "ord_data_type": 4, "data": data["coherence"].values[:, k]}
            sets.append(sets[-1] | sure)
    with replacing(path) as temporary:
        pyuff.UFF(str(temporary)).write_sets(sets, mode="overwrite")


def read_frf(path: Any) -> xr.Dataset:
    """Read the frequency responses (data set 58, function type 4) of a universal file, as `frf` returns them."""
    found = isolated.read_apart(check.path("path", path), "frequency responses", "taps.transfer:arrays")
    coords: dict[str, Any] = {"frequency": ("frequency", found["frequency"], {"units": "Hz"})}
    coords |= {name: ("channel", found[f"{name}s"].astype(str)) for name in ("channel", "unit")}
    coords["units"] = coords.pop("unit")
    coords |= {name: ("channel", each) for name, each in zip(WAY, found["ways"].T)}
    coords |= {name: (("channel", "axis"), found[name], {"units": "m"}) for name in ENDS if name in found}
    kept = [name for name in ("H", "coherence") if name in found]
    attributes = {"notes": [str(note) for note in found["notes"]]}
    return xr.Dataset({name: (("frequency", "channel"), found[name]) for name in kept}, coords, attributes)


def arrays(path: Path) -> dict[str, np.ndarray]:
    """The result of `read_frf` as arrays, for the separate process."""
    file = readers.Universal(path)
    factors = universal_files.factors(file.sets(164))
    sets = file.of_type(readers.FREQUENCY_RESPONSE, "frequency responses")
    frequency = np.zeros(0)
    names: list[str] = []
    units: list[str] = []
    columns: list[np.ndarray] = []
    notes: list[str] = []
    for one in sets:
        name = readers.uff_name(one)
        if not np.iscomplexobj(one["data"]):
            raise ValueError(f"{path.name} has magnitudes only of {name!r}; export complex responses")
        if int(one.get("abscissa_spec_data_type") or 0) not in (0, 18):  # not stated, or frequency
            raise ValueError(f"{path.name} has a response {name!r} over something else than frequency; export it again")
        label = str(one.get("abscissa_axis_units_lab") or "").strip()
        hertz = axis_factor(label, {"hz": 1.0, "khz": 1e3, "rad/s": 0.5 / np.pi, "rpm": 1.0 / 60.0})
        notes += [f"{name}: the unit {label!r} of its frequencies is not known, Hz assumed"] * (hertz is None)
        x = (hertz or 1.0) * np.asarray(one["x"], float)
        if not (len(x) and x[0] >= 0.0 and (np.diff(x) > 0.0).all() and x[-1] <= check.REACH):
            raise ValueError(f"{path.name} has frequencies of {name!r} that do not ascend from zero; export it again")
        frequency = frequency if names else x
        if len(x) != len(frequency) or not np.allclose(x, frequency, rtol=1e-5, atol=0.0):
            raise ValueError(f"{path.name} has responses at other frequencies for {name!r} than for {names[0]!r}")
        unit, factor, note = _per_force(path, name, one, factors)
        names.append(check.line(name))
        units.append(f"{unit}/N")
        columns.append(np.asarray(one["data"], complex) * factor)
        notes += note
    ways = np.array([_way(one) for one in sets])
    found = {"frequency": frequency, "H": np.column_stack(columns), "channels": np.array(names, dtype=str)}
    found |= {"units": np.array(units), "ways": ways, "notes": np.array(list(dict.fromkeys(notes)), dtype=str)}
    sure = {_way(one): np.real(one["data"]) for one in file.function_sets if one.get("func_type") == readers.COHERENCE}
    if all(way in sure and len(sure[way]) == len(frequency) for way in map(tuple, ways.tolist())):
        found["coherence"] = np.column_stack([sure[tuple(way)] for way in ways.tolist()]).astype(float)
        if not ((found["coherence"] >= 0.0) & (found["coherence"] <= 1.0 + 1e-6)).all():
            raise ValueError(f"{path.name} has a coherence that is not between 0 and 1; export it again")
    numbers, place = universal_files.places(file.sets(15, 164, 2411))
    row = {int(number): i for i, number in enumerate(numbers)}
    for end, column in zip(ENDS, (0, 2)):
        here = [row.get(int(node)) for node in ways[:, column]]
        if any(i is not None for i in here):
            found[end] = np.array([np.full(3, np.nan) if i is None else place[i] for i in here])
    if not (np.abs(found["H"]) <= check.REACH).all():
        raise ValueError(f"{path.name} holds values that are no finite numbers; export it again")
    return found


def _per_force(path: Path, name: str, one: dict[str, Any], factors: dict[str, float]) -> tuple[str, float, list[str]]:
    """SI unit of the motion in a response per force, the factor to it, and notes: by codes, or by labels without."""
    parts: list[tuple[str, float]] = []
    notes: list[str] = []
    ends = [str(one.get(f"{what}_axis_units_lab") or "").strip() for what in ("ordinate", "orddenom")]
    over, _, under = ends[0].rpartition("/")
    if (known_unit(under) or "")[:1] == ("N",):  # as "g/lbf"
        ends = [over, ends[1] if known_unit(ends[1]) else under]
    for what, label, default in zip(("ordinate", "orddenom"), ends, ("", "N")):
        code = int(one.get(f"{what}_spec_data_type") or 0)
        stated, kind, doubts = uff_unit(path, name, label, code, factors)
        notes += doubts
        if stated is None and kind is None and not code and default:
            notes.append(f"{name}: what it is divided by is not stated, N assumed")
            kind = default
        si = stated[0] if stated else kind or ""
        if si not in (RESPONSE_CODE if what == "ordinate" else ("N",)):
            raise ValueError(f"{path.name} has a response {name!r} that is no motion per force (quantity code {code})")
        parts.append((si, stated[1] if stated else 1.0 / factors.get(si, 1.0)))
    return parts[0][0], parts[0][1] / parts[1][1], notes


def _way(one: dict[str, Any]) -> tuple[int, ...]:
    """From where to where a function of data set 58 is measured."""
    return tuple(int(one.get(f"{end}_{part}") or 0) for end in ("rsp", "ref") for part in ("node", "dir"))
