"""Judge every record of taps that a folder gets: good, or what to do before the next one."""

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._base import check
from .._base.files import PARTIAL
from ..show.figures import in_hertz
from ..sweeps.hammers import falls
from . import triggers
from .records import Taps

ENDINGS = (".lvm", ".csv", ".tsv", ".txt", ".npy", ".npz", ".wav", ".mat", ".uff", ".unv", ".58")  # of records


class Advice(NamedTuple):
    """What is wrong with one tap, and what to do about it."""

    file: str
    tap: str
    good: bool
    said: str
    peak: float | None  # [N]
    reach: float | None  # [Hz] where the force spectrum first falls by the drop; None: not below half the rate


def reach_of(taps: Taps, i: int, drop: float = 10.0) -> float | None:
    """Frequency [Hz] at which the spectrum of a tap's pulses first falls ``drop`` [dB] below its value at 0 Hz.

    None if it stays above that up to half the rate. Only the samples of the pulses count, as noise beside them hides
    how a spectrum falls.
    """
    pulses = taps.pulses[i]
    if not pulses:
        return None
    first, last = max(0, pulses[0][0] - triggers.GUARD), pulses[-1][1] + triggers.GUARD
    row = taps.force[i, first:last]
    n = 64 * len(row)  # finer lines move where the spectrum falls by less than 0.1 %
    return falls(np.fft.rfftfreq(n, 1.0 / taps.rate), np.abs(np.fft.rfft(row, n)), drop)


def faults(taps: Taps, i: int) -> list[str]:
    """What is wrong with one tap, whatever the bandwidth."""
    wrong = []
    cut = taps.cut_off(i)
    if cut:
        wrong.append(f"overload of {', '.join(cut)}, repeat softer or with a larger range")
    lead = round(taps.onset[i] * taps.rate)
    if lead < triggers.FEWEST:
        wrong.append(f"trigger too late, only {lead} samples before the pulse: start records earlier")
    elif taps.cut_short[i]:
        wrong.append("the record ends within the pulse: record longer")
    if taps.n_pulses[i] > 1:
        wrong.append("double hit, repeat")
    return wrong


def advice(file: str, taps: Taps, i: int, bandwidth: float, drop: float = 10.0) -> Advice:
    """Judge one tap for a test up to ``bandwidth`` [Hz], where its spectrum may be ``drop`` [dB] down.

    Raises
    ------
    ValueError
        If the taps are sampled too slowly for the bandwidth.
    """
    drop = check.between("drop", drop, 1.0, 40.0, "dB")
    if not 0.0 < bandwidth < 0.5 * taps.rate:
        raise ValueError(
            f"bandwidth must be below half the rate of {file}, {0.5 * taps.rate:g} Hz, got {bandwidth:g} Hz; sample "
            "faster, or ask for less"
        )
    reach, wrong = reach_of(taps, i, drop), faults(taps, i)
    if not wrong and reach is not None and reach < bandwidth:
        wrong.append(
            f"too soft for {in_hertz(bandwidth, 3)}: take the next tip (this one reaches {in_hertz(reach, 3)}; the "
            # the time of contact goes with one over the root of the stiffness
            f"tip must be {(bandwidth / reach) ** 2:.2g} times as stiff)"
        )
    far = f"beyond {in_hertz(0.5 * taps.rate, 3)}" if reach is None else in_hertz(reach, 3)
    peak = float(taps.peak[i])
    said = "; ".join(wrong) or f"good: {peak:.3g} N, reaches {far}"
    return Advice(file, taps.labels[i], not wrong, said, peak, reach)


@dataclass(eq=False)
class Folder:
    """The records in a folder, and which of them were handed out."""

    path: Path
    last: dict[str, tuple[int, int]] = field(default_factory=dict)  # size and time of each file at the last look
    handed_out: dict[str, tuple[int, int]] = field(default_factory=dict)  # the same, when it was

    def __post_init__(self) -> None:
        if not self.path.is_dir():
            raise ValueError(f"FOLDER must be a folder that receives records, got {self.path}")

    def look(self) -> list[Path]:
        """Records that are new or changed and that nobody wrote to since the last look, the oldest first."""
        now = {}
        for path in self.path.iterdir():
            if path.suffix.lower() in ENDINGS and not path.name.startswith((PARTIAL, ".", "~")):
                with suppress(FileNotFoundError):  # renamed since it was listed
                    stat = path.stat()
                    if path.is_file() and stat.st_size:
                        now[path.name] = stat.st_size, stat.st_mtime_ns
        settled = [name for name, state in now.items() if state == self.last.get(name) != self.handed_out.get(name)]
        self.last = now
        self.handed_out |= {name: now[name] for name in settled}
        return [self.path / name for name in sorted(settled, key=lambda name: (now[name][1], name))]

    @property
    def waiting(self) -> bool:
        """Whether records are there that were not handed out."""
        return any(self.handed_out.get(name) != state for name, state in self.last.items())
