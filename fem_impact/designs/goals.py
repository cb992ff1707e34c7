"""What can be wanted of a design: frequencies of the body, quantities of a blow, one impact only."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .._base import check
from ..impact.quantities import UNITS

MODE = re.compile(r"mode([1-9]\d*)\.(frequency|ratio)")
KNOWN = (
    "restitution", "impulse", "contact_time", "peak_force", "peak_time", "spectral_centroid", "spectral_level",
    "n_impacts", "clearance", "mode1.frequency", "mode2.ratio",
)  # fmt: skip
CLEAR = 0.01  # [-] clearance of a blow that shall hit once: far beside what grazes, little beside an impact
EXAMPLE = '{"mode1.frequency": 262.0, "contact_time": (1e-3, 2e-3)}'


@dataclass(frozen=True)
class Goal:
    """One quantity of the body, or of one blow, and the range it is wanted in; both ends are one for a value."""

    name: str
    low: float
    high: float
    blow: str = ""

    @property
    def label(self) -> str:
        """The name, with that of its blow."""
        return f"{self.blow}: {self.name}" if self.blow else self.name

    @property
    def mode(self) -> int:
        """Number of the flexible mode whose frequency is meant, from 1; 0 for a quantity of a blow."""
        found = MODE.fullmatch(self.name)
        return int(found[1]) if found else 0

    @property
    def ratio(self) -> bool:
        """Whether the frequency over that of the first mode is meant."""
        return self.name.endswith(".ratio")

    @property
    def unit(self) -> str:
        """Unit of the quantity, empty for a ratio."""
        return ("" if self.ratio else "Hz") if self.mode else UNITS.get(self.name.partition("=")[0], "")

    @property
    def scale(self) -> float:
        """What a miss is relative to: the wanted value, 1 for a restitution."""
        if self.name in ("restitution", "clearance"):
            return 1.0
        if self.name.startswith("spectral_level"):
            return 20.0 / math.log(10.0)  # dB: a miss of a level counts as that of the force
        return max(abs(end) for end in (self.low, self.high) if math.isfinite(end)) or 1.0

    def miss(self, value: float) -> float:
        """How far a value is above the range (below, if negative), over the scale."""
        return (max(0.0, value - self.high) + min(0.0, value - self.low)) / self.scale

    @property
    def words(self) -> str:
        """The range, in words."""
        unit = f" {self.unit}".rstrip()
        if self.low == self.high:
            return f"{self.low:.6g}{unit}"
        ends = f"at least {self.low:.6g}", f"at most {self.high:.6g}"
        return " and ".join(words for words, end in zip(ends, (self.low, self.high)) if math.isfinite(end)) + unit


def read_goals(wanted: Any, blows: tuple[str, ...]) -> tuple[Goal, ...]:
    """All goals from what a user wants; those not given for one blow hold for each. ValueError says what is wrong."""
    example = f", as in {EXAMPLE}"
    table = check.table("wanted", wanted, example)
    if not table:
        raise ValueError(f"wanted must name at least one quantity, as in {EXAMPLE}")
    found: list[Goal] = []
    for name, value in table.items():
        if isinstance(value, Mapping):
            check.one_of("the blow in wanted", name, [blow for blow in blows if blow])
            found += [
                _goal(f"wanted[{name!r}]", own, what, name)
                for own, what in check.table("wanted", value, example).items()
            ]
        elif MODE.fullmatch(name):
            found.append(_goal("wanted", name, value, ""))
        else:
            found += [_goal("wanted", name, value, blow) for blow in blows]
    return tuple(found)


def _goal(where: str, name: str, value: Any, blow: str) -> Goal:
    label = f"{where}[{name!r}]"
    plain, equals, _ = name.partition("=")
    if not MODE.fullmatch(name):
        check.one_of(where, plain, KNOWN)
        if plain.startswith("spectral") != bool(equals):
            rule = f"needs a frequency, such as '{plain}=5000'" if not equals else f"has no frequency, write {plain!r}"
            raise ValueError(f"{where}: {plain} {rule}")
    if plain == "n_impacts":
        if value != 1 or isinstance(value, bool):
            raise ValueError(f"{label} must be 1, the only count with a smooth measure, got {check.shown(value)}")
        return Goal("clearance", CLEAR, math.inf, blow)
    ends = value if isinstance(value, (tuple, list)) else (value, value)
    if len(ends) != 2 or (ends[0] is None and ends[1] is None):
        raise ValueError(
            f"{label} must be a number or a range (low, high), got {check.shown(value)}; None leaves an end open"
        )
    low = -math.inf if ends[0] is None else check.number(label, ends[0])
    high = math.inf if ends[1] is None else check.number(label, ends[1])
    if low > high:
        raise ValueError(f"{label} must be a range (low, high), got ({low:g}, {high:g})")
    if high < 0.0 and plain not in ("spectral_level", "restitution"):
        raise ValueError(f"{label} must not be negative, got {high:g}; nothing could meet it")
    return Goal(name, low, high, blow)
