"""What modes shall sound like: pitches in hertz, as notes, cents or ratios, and which mode each belongs to."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._base import check

CENTS = 1200.0  # [-] fact: cents of an octave
CONCERT = 440.0  # [Hz] fact: A4 (ISO 16)
SEMITONES = {"C": -9, "D": -7, "E": -5, "F": -4, "G": -2, "A": 0, "B": 2}  # fact: from A4, in its octave
NUMBER = r"[+-]?\d+(?:\.\d*)?"
NOTE = re.compile(rf"([A-Ga-g])([#b]?)(-?\d)(?:\s*({NUMBER})\s*cents?)?")
FREQUENCY, BESIDE, RATIO = (
    re.compile(rf"({NUMBER})(?:\s*Hz)?"), re.compile(rf"({NUMBER})\s*cents?"), re.compile(rf"ratio\s+({NUMBER})")
)  # fmt: skip
HOW = "a frequency in Hz, a note such as 'A4' or 'Bb3 -5 cents', '-14 cents' from now, or 'ratio 4' to the first mode"
MATCHES = ("order", "nearest")


@dataclass(frozen=True)
class Pitch:
    """What is wanted of one mode."""

    mode: int  # number of the flexible mode, from 1
    words: str  # as it was given; empty if nothing is wanted, but the mode is looked at
    frequency: float | None = None  # [Hz]
    cents: float | None = None  # from now
    ratio: float | None = None  # [-] to the first mode

    def wanted(self, first: np.ndarray, now: np.ndarray, modes: Sequence[int]) -> float:
        """The frequency [Hz] wanted: of a ratio beside the first mode as it is now, else beside its own at first.

        ``first`` and ``now`` (n,) [Hz] are the frequencies of modes of these numbers.
        """
        if self.frequency is not None:
            return self.frequency
        if self.ratio is not None:
            return float(now[list(modes).index(1)]) * self.ratio
        return float(first[list(modes).index(self.mode)]) * 2.0 ** ((self.cents or 0.0) / CENTS)


def cents(frequency: Any, beside: Any = 1.0) -> Any:
    """The interval [cents] from one frequency to another."""
    return CENTS * np.log2(np.asarray(frequency) / beside)


def note(frequency: float) -> str:
    """The note nearest to a frequency [Hz], and how far that is: "A4 +3 cents"."""
    steps = round(float(cents(frequency, CONCERT)) / 100.0)
    off = float(cents(frequency, CONCERT)) - 100.0 * steps
    name = ("A", "A#", "B", "C", "C#", "D", "D#", "E", "F", "F#", "G", "G#")[steps % 12]
    return f"{name}{4 + (steps + 9) // 12} {off:+.0f} cents"


def read_pitch(name: str, mode: int, value: Any) -> Pitch:
    """One pitch; ValueError says what it may be."""
    if value is None:
        return Pitch(mode, "")
    if not isinstance(value, str):
        return Pitch(mode, f"{check.positive(name, value, 'Hz'):g} Hz", frequency=check.positive(name, value, "Hz"))
    text = value.strip()
    if found := NOTE.fullmatch(text):
        letter, sign, octave, beside = found.groups()
        steps = SEMITONES[letter.upper()] + {"#": 1, "b": -1, "": 0}[sign] + 12 * (int(octave) - 4)
        return Pitch(mode, text, frequency=CONCERT * 2.0 ** (steps / 12.0 + _interval(name, beside or 0.0) / CENTS))
    if found := BESIDE.fullmatch(text):
        return Pitch(mode, text, cents=_interval(name, found[1]))
    if found := RATIO.fullmatch(text):
        if mode == 1:
            raise ValueError(f"{name} must not be a ratio: mode 1 is what ratios are to; give {HOW}")
        return Pitch(mode, text, ratio=check.positive(name, float(found[1])))
    if found := FREQUENCY.fullmatch(text):
        return read_pitch(name, mode, float(found[1]))
    raise ValueError(f"{name} must be {HOW}; got {check.shown(value)}")


def _interval(name: str, text: Any) -> float:
    """Cents, of ten octaves at most: there is no sound beyond."""
    return check.between(name, float(text), -10.0 * CENTS, 10.0 * CENTS, "cents")


def read_pitches(pitches: Any, match: str) -> tuple[Pitch, ...]:
    """All pitches, in the order of their modes; those to be matched by nearness have mode 0 until `match_pitches`."""
    check.one_of("match", match, MATCHES)
    if isinstance(pitches, Mapping):
        if match != "order":
            raise ValueError("match must be left out where pitches name their modes")
        known = {check.count("mode in pitches", mode): value for mode, value in pitches.items()}
        found = tuple(read_pitch(f"pitches[{mode}]", mode, known[mode]) for mode in sorted(known))
    else:
        several = pitches if isinstance(pitches, Sequence) and not isinstance(pitches, str) else [pitches]
        nearest = match == "nearest"
        found = tuple(read_pitch(f"pitches[{i}]", 0 if nearest else 1 + i, each) for i, each in enumerate(several))
        if nearest and any(each.frequency is None for each in found):
            raise ValueError("match must be 'order' for pitches that are no frequencies or notes of their own")
    if not found:
        raise ValueError(f"pitches must name at least one mode, as in {{1: 'A4', 2: 'ratio 4'}}: {HOW}")
    return found


def match_pitches(pitches: tuple[Pitch, ...], frequencies: np.ndarray) -> tuple[Pitch, ...]:
    """The pitches with the flexible modes nearest to them, of frequencies (n,) [Hz]; ValueError if in doubt."""
    taken: dict[int, Pitch] = {}
    for each in pitches:
        far = np.abs(cents(frequencies, each.frequency))
        first, second = np.argsort(far)[:2]
        # at less than twice as far, errors and taste decide which is meant
        if far[second] < 2.0 * far[first] or 1 + first in taken:
            raise ValueError(
                f"pitches: {each.words} is {far[first]:.0f} cents from mode {first + 1} and {far[second]:.0f} cents "
                f"from mode {second + 1}, so it is not clear which is meant; name the mode, as in "
                f"{{{first + 1}: {each.words!r}}}"
            )
        taken[1 + int(first)] = Pitch(1 + int(first), each.words, each.frequency)
    return tuple(taken[mode] for mode in sorted(taken))
