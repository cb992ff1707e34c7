"""Units of measured channels, and what they are in SI."""

import re
from collections.abc import Mapping
from pathlib import Path

FORCE = {
    "N": 1.0, "newton": 1.0, "newtons": 1.0, "kN": 1e3, "mN": 1e-3, "MN": 1e6, "daN": 10.0, "lbf": 4.4482216152605,
    "lb": 4.4482216152605, "kgf": 9.80665, "kp": 9.80665, "dyn": 1e-5,
}  # fmt: skip
ACCELERATION = {
    "m/s^2": 1.0, "m*s^-2": 1.0, "ms-2": 1.0, "g": 9.80665, "gn": 9.80665, "mg": 9.80665e-3,
    "mm/s^2": 1e-3, "cm/s^2": 1e-2, "in/s^2": 0.0254, "ft/s^2": 0.3048,
}  # fmt: skip
VELOCITY = {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "µm/s": 1e-6, "in/s": 0.0254, "ips": 0.0254}
DISPLACEMENT = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254}
KINDS = {"N": FORCE, "m/s^2": ACCELERATION, "m/s": VELOCITY, "m": DISPLACEMENT}  # SI unit -> factors
UFF_UNITS = {13: "N", 9: "N", 12: "m/s^2", 11: "m/s", 8: "m"}  # codes of quantities in data set 58
FORCE_NAMES = re.compile(r"force|hammer|kraft|excit|\bexc\b|input|^f$", re.IGNORECASE)
RESPONSE_NAMES = re.compile(r"accel|resp|veloc|displ|vibro|^a\d*$|^acc", re.IGNORECASE)
OTHERS = (  # not known by `si_unit`: such a channel needs a scale
    "V", "mV", "uV", "µV", "kV", "pC", "A", "mA", "counts", "count", "LSB", "bits", "digits", "%", "dB", "Hz", "kHz",
    "s", "ms", "us", "µs", "ns", "min", "h", "-", "a.u.", "kg",
)  # fmt: skip
# "Force [N]", "Force (N)", "Force / N", "Force in N", "Force, N", "F/N", "a/(m/s^2)"; but "velocity m/s" is a name
LABEL = re.compile(r"^(.*?)(?:\s*[\[(]|\s+(?:/|in)\s+|,\s+|(?<=^\w)/\(?)([^\])]*)[\])]?$")

# "acc_g", as names in MATLAB and of columns hold no brackets; of units that begin no other word
SUFFIX = re.compile(r"_(m?g|m?N|kN|lbf|ips|mV)$")


def si_unit(unit: str) -> tuple[str, float] | None:
    """The SI unit of a unit's kind, and the factor to it; None for a unit that is not known."""
    text = re.sub(r"(?<=/s)(²|\*\*2|2)$", "^2", unit.strip("() ").replace("μ", "µ"))
    every = [(name, si, factor) for si, factors in KINDS.items() for name, factor in factors.items()]
    folds = str, str.casefold  # "mN" and "MN" differ, so the exact spelling comes first
    return next(((si, factor) for fold in folds for name, si, factor in every if fold(name) == fold(text)), None)


def axis_factor(unit: str, factors: Mapping[str, float]) -> float | None:
    """The factor of an axis's unit in data set 58, 1 where none is stated; None for a unit that is not known."""
    unit = unit.lower().replace("μ", "µ")
    return factors.get(unit, 1.0 if unit in ("", "none") else None)


def is_unit(text: str) -> bool:
    """Whether a text is a unit, known or not."""
    return si_unit(text) is not None or text in OTHERS


def label(text: str) -> tuple[str, str]:
    """Name and unit of a heading such as "Force [N]"; what holds no unit, or is one word as "acc_g", is the name."""
    text = text.replace("μ", "µ")  # the letter and the sign
    found = LABEL.match(text.strip())
    if found and is_unit(found[2].strip()) and not is_unit(text):
        return found[1].rstrip(" /"), found[2].strip()
    last = SUFFIX.search(text.strip())
    return text.strip(), last[1] if last else ""


def uff_unit(
    path: Path, name: str, label: str, code: int, factors: Mapping[str, float]
) -> tuple[tuple[str, float] | None, str | None, list[str]]:
    """What the label of a unit in data set 58 is known as, the unit of its code, and notes: on what was chosen.

    The code decides where the label is not known, and the label against ``factors``, those of data set 164.
    """
    known, kind = si_unit(label), UFF_UNITS.get(code)
    if known and kind and known[0] != kind:
        raise ValueError(
            f"{path.name} states the unit {label!r} for {name!r}, whose code {code} means {kind}; export it again"
        )
    doubtful = kind and not known and label not in ("", "NONE")
    notes = [f"{name}: the unit {label!r} is not known, {kind} assumed by its code {code}"] * bool(doubtful)
    if known and abs(known[1] * factors.get(known[0], 1.0 / known[1]) - 1.0) > 1e-3:
        notes.append(f"{name}: taken in {label}, as it is labelled, not in the unit of data set 164")
    return known, kind, notes
