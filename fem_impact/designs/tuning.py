"""`tune`: what to take off a plate or bar where, so that its modes sound at the pitches wanted."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, markup
from .._base.threads import one_thread
from ..fe.section import Plate
from ..fe.system import System
from ..impact import promise
from ..model.target import Target
from ..modes.modal import Modes
from ..scenes.scene import Scene, load_scene
from ..show import outlined
from . import pitches as wishes
from .pitches import Pitch, cents, note
from .removal import Dishes, check_body, mirror_images
from .thinning import Blank, Solved, Thinning, drawing_grid

MIRRORS = "x", "y", "xy"  # a bar has the first


@dataclass(frozen=True, eq=False, repr=False)
class Patch(check.Brief):
    """Material to take off in a dish, or a groove of a bar, and what that does."""

    at: np.ndarray  # (n, dimension) [m] its middle, and those of its images if the pattern is mirrored
    radius: float  # [m]
    depth: float  # [m] in the middle
    modes: tuple[int, ...]
    cents: np.ndarray  # (n_modes,) after all patches before it: both bodies were solved
    by_slopes: np.ndarray  # (n_modes,) [cents] what the slopes of the body before all patches say

    @property
    def words(self) -> str:
        """What to do, and what comes of it."""
        here = " and ".join(f"({', '.join(f'{x:.4g}' for x in each)})" for each in self.at)
        moved = ", ".join(f"mode {mode} {value:+.1f} cents" for mode, value in zip(self.modes, self.cents))
        return f"{1e3 * self.depth:.3g} mm at {here} m, radius {1e3 * self.radius:.3g} mm: {moved}"


@dataclass(frozen=True)
class Tone:
    """One mode before and after."""

    pitch: Pitch
    before: float  # [Hz]
    after: float  # [Hz]
    wanted: float  # [Hz]; of a mode that is only looked at, as before
    error_before: float  # [cents] stated errors of both
    error_after: float  # [cents]

    @property
    def off(self) -> float:
        """How far the mode is from its pitch as it stands [cents]."""
        return float(cents(self.before, self.wanted))

    @property
    def left(self) -> float:
        """The same after all patches, as solved again [cents]."""
        return float(cents(self.after, self.wanted))


@dataclass(frozen=True, eq=False, repr=False)
class Tuning(check.Brief):
    """What `tune` found."""

    tones: tuple[Tone, ...]
    patches: tuple[Patch, ...]  # in the order in which their effects are computed
    tolerance: float  # [cents]
    depth: float  # [m] greatest
    radius: float  # [m]
    mirror: str
    n_solved: int  # times that modes were found
    volume: float  # [m^3] taken off
    before: Solved = field(repr=False)
    after: Solved = field(repr=False)
    body: Blank = field(repr=False)

    @property
    def met(self) -> bool:
        """Whether each mode lies within the tolerance of its pitch."""
        return all(abs(each.left) <= self.tolerance for each in self.tones if each.pitch.words)

    @property
    def modes(self) -> Modes:
        """Modes of the body after all patches."""
        return self.after.modes

    @property
    def section(self) -> Any:
        """The section after all patches."""
        return self.after.system.section

    @property
    def points(self) -> np.ndarray:
        """Places (n_points, dimension) [m] of the `map`."""
        return self.body.spots

    @cached_property
    def map(self) -> np.ndarray:
        """What a patch of the radius does around each place, (n_points, n_modes) [cents/m^3] of what it takes off.

        Times 1e-8 it is cents per 0.1 mm off a square centimetre.
        """
        found, areas = self.before.sensitivity.of_dishes(self.points, self.radius)
        return found / areas[:, None]

    def figure(self) -> Any:
        """A matplotlib figure: the map of each mode on the outline, and the patches with their numbers and depths."""
        points, cells = drawing_grid(self.before.modes)
        titles = [
            f"mode {each.pitch.mode}: {each.before:.5g} Hz, wanted {each.pitch.words}, off by {each.off:+.1f} cents"
            if each.pitch.words else f"mode {each.pitch.mode}: {each.before:.5g} Hz"
            for each in self.tones
        ]  # fmt: skip
        numbers = [self.body.numbers.index(each.pitch.mode) for each in self.tones]
        dishes = [
            (each.at, each.radius, [f"{i}: {1e3 * each.depth:.2g} mm, {each.cents[k]:+.1f} cents" for k in numbers])
            for i, each in enumerate(self.patches, 1)
        ]
        return outlined.marked(points, cells, 1e-8 * self.map[:, numbers], titles, dishes)  # m^3: 0.1 mm off 1 cm^2

    @check.typed
    def patch(self, at: Any, depth: float, *, radius: float | None = None) -> Patch:
        """What a single patch does to the body as it is, by its slopes and solved again.

        Parameters
        ----------
        at : point (dimension,) [m]
        depth : float [m] in the middle
        radius : float [m], optional
            By default that of the patches.

        Returns
        -------
        Patch
            Mirrored like the others.
        """
        place = self.before.modes.point("at", at)[0]
        depth = check.positive("depth", depth, "m")
        radius = check.positive("radius", self.radius if radius is None else radius, "m")
        middles = mirror_images(place, self.mirror, self.before.system)
        solved = self.body.after(Dishes.of_places([(middles, depth)], radius), self.before)
        slopes = depth * self.before.sensitivity.of_dishes(middles, radius)[0].sum(axis=0)
        moved = cents(solved.frequencies, self.before.frequencies)
        return Patch(middles, radius, depth, self.body.numbers, moved, slopes)

    @property
    def verdict(self) -> str:
        """One sentence: whether every pitch is reached, and what cannot be."""
        worst = max((each for each in self.tones if each.pitch.words), key=lambda each: abs(each.left))
        if self.met:
            doubt = max(each.error_after for each in self.tones)
            return f"tuned: every pitch within {self.tolerance:g} cents; frequencies are known to {doubt:.2g} cents"
        low, high = (factor * worst.before for factor in self.before.reach(self.depth))
        if worst.pitch.ratio is None and not low <= worst.wanted <= high:
            why = f"so much off leaves it between {low:.4g} and {high:.4g} Hz, wherever: allow more depth, or want less"
        else:
            why = "allow more depth or patches, another radius, or want less"
        return (
            f"tuning MISSED: mode {worst.pitch.mode} stays {worst.left:+.3g} cents from {worst.pitch.words}, the best "
            f"that a search from the body as it stands found with {len(self.patches)} patches of "
            f"{1e3 * self.radius:.3g} mm radius and at most {1e3 * self.depth:.3g} mm depth; {why}"
        )

    def summary(self) -> str:
        """What stands, what to take off where, and what then stands."""
        rows = [
            (f"mode {each.pitch.mode}", f"{each.before:.6g} Hz", note(each.before), each.pitch.words or "-",
             f"{each.off:+.3g} +- {each.error_before:.1g} cents", f"{each.left:+.3g} +- {each.error_after:.1g} cents")
            for each in self.tones
        ]  # fmt: skip
        heads = ("mode", "now", "about", "wanted", "off now", "off then")
        lines = [self.verdict, *(f"  {line}" for line in markup.columns(rows, heads))]
        lines += [f"{i}: {each.words}" for i, each in enumerate(self.patches, 1)]
        lines.append(f"{1e9 * self.volume:.3g} mm^3 are taken off; {self.n_solved} bodies were solved")
        return "\n".join(lines)

    def data(self) -> dict[str, Any]:
        """Everything but the map as plain data."""
        tones = [
            {"mode": each.pitch.mode, "pitch": each.pitch.words, "frequency": each.before, "wanted": each.wanted,
             "off": each.off, "error": each.error_before, "tuned": each.after, "left": each.left,
             "tuned_error": each.error_after}
            for each in self.tones
        ]  # fmt: skip
        own = {name: getattr(self, name) for name in ("met", "tolerance", "depth", "radius", "mirror", "volume")}
        return {"tones": tones, "patches": [dict(vars(each)) for each in self.patches], **own}


@check.typed
@one_thread
def tune(
    body: System | Scene | str | Path,
    pitches: Any,
    *,
    match: str = "order",
    depth: float | None = None,
    radius: float | None = None,
    mirror: str | None = None,
    patches: int = 6,
    tolerance: float = 1.0,
) -> Tuning:
    """Find what to take off a plate or bar where, so that its modes sound at the pitches wanted.

    Parameters
    ----------
    body : System, Scene, or path of a scene file
        A plate of any outline, curved or thick, or a bar; without layers, ribs, scaling and air.
    pitches : mapping of mode to pitch, or sequence of pitches
        Flexible modes count from 1. A pitch is a frequency [Hz], a note such as "A4" or "Bb3 -5 cents" (A4 is 440 Hz),
        "-14 cents" from where the mode is, or "ratio 4" to the first mode. In a mapping, None looks at a mode and
        wants nothing of it.
    match : "order" or "nearest"
        Of a sequence: whether its pitches belong to the first modes, or each to the mode nearest to it.
    depth : float [m], optional
        Greatest depth anywhere; by default a fifth of the least thickness.
    radius : float [m], optional
        Of the patches; by default 0.12 of the root of the area, or of the length of a bar.
    mirror : "x", "y" or "xy", optional
        Along which axes each patch has an image, in the middle of the body.
    patches : int
        Most patches, each with its images.
    tolerance : float [cents]
        How near each mode shall come to its pitch.

    Returns
    -------
    Tuning
        One that misses a pitch warns (`ToleranceWarning`) and says which.

    Raises
    ------
    ValueError
        If a pitch is none, or it is not clear which mode it means.
    SimulationError
        If a mode shares its frequency with another: a patch splits the pair, so neither has a slope.

    Notes
    -----
    A patch is a dish, ``depth exp(-3 (r / radius)**2)`` deep at a distance r, in a bar a groove across it. It takes as
    much off both faces, so that the middle surface stays; a dish in one face shifts it, which counts as the square of
    its depth. Slopes of the frequencies over the whole body are integrals over the modes found, from which
    linear programming (HiGHS) takes the least volume, as few patches as pitches unless the depth is bound; the body is
    then solved again, until the pitches are met. The least volume is that near where the body stands: others may be as
    good.

    Examples
    --------
    >>> wood = fi.Material(E=16e9, nu=0.35, rho=900.0)
    >>> bar = fi.assemble(fi.mesh.line(0.35), fi.Beam.rectangular(wood, width=0.05, height=0.012))
    >>> found = fi.tune(bar, {1: "-20 cents"}, mirror="x")
    >>> found.met, len(found.patches), abs(found.tones[0].left) <= found.tolerance
    (True, 1, True)
    """
    wanted = wishes.read_pitches(pitches, match)
    if not any(each.words for each in wanted):
        raise ValueError("pitches must want something of a mode: None only looks at one; name a pitch, too")
    tolerance = check.between("tolerance", tolerance, 0.01, 100.0)
    if isinstance(body, System):
        target = Target.of(body)
    else:
        scene = body if isinstance(body, Scene) else load_scene(body)
        target = replace(scene.built.target, source="fe")
        if target.scale or target.air is not None:
            raise scene.fault("[target] must not state mass, first_frequency or air to be tuned; leave them out")
    check_body(target.section)
    if mirror is not None:
        check.one_of("mirror", mirror, MIRRORS if isinstance(target.section, Plate) else MIRRORS[:1])
    start = Blank.of(target, wanted, tolerance)
    before = start.first()
    size = before.system.mesh.area ** (1.0 / before.modes.dimension)
    # about what a thumb rubs off an instrument; of the smallest, a thousand places are looked at
    radius = 0.12 * size if radius is None else check.between("radius", radius, size / 15, size, "m")
    # what is left by default is still about the same body
    depth = 0.2 * before.thinnest if depth is None else check.positive("depth", depth, "m")
    whole, most = ("radius", 0.5) if getattr(target.section, "round", False) else ("thickness", 1.0)
    if depth >= most * before.thinnest:
        raise ValueError(f"depth must be less than the {whole}, {most * before.thinnest:g} m, got {depth:g} m")
    search = Thinning(start, before, depth, radius, mirror or "", tolerance)
    found = search.choose_places(check.count("patches", patches, high=100))
    made = _solve_and_report(start, search, found)
    if not made.met:
        promise.warn(made.verdict)
    return made


def parse_pitches(words: Sequence[str]) -> Any:
    """Pitches as the prompt has them: each "MODE=PITCH", or none of them with a mode."""
    split = [text.partition("=") for text in words]
    if not any(equals for _, equals, _ in split):
        return list(words)
    if not all(equals and mode.strip().isdigit() for mode, equals, _ in split):
        raise ValueError("--pitch must be MODE=PITCH, as in 2=A5, for all pitches or for none")
    return {int(mode): pitch.strip() or None for mode, _, pitch in split}


def _solve_and_report(body: Blank, search: Thinning, found: Sequence[tuple[np.ndarray, float]]) -> Tuning:
    """The result, with every patch solved after those before it."""
    before = last = search.before
    patches, slopes = [], before.sensitivity
    for k, (middles, deep) in enumerate(found, 1):
        now = body.after(Dishes.of_places(found[:k], search.radius), last)
        linear = deep * slopes.of_dishes(middles, search.radius)[0].sum(axis=0)
        moved = cents(now.frequencies, last.frequencies)
        patches.append(Patch(middles, search.radius, deep, body.numbers, moved, linear))
        last = now
    tones = []
    for pitch in body.pitches:
        place = body.numbers.index(pitch.mode)
        sides = [(float(each.frequencies[place]), float(each.errors[place])) for each in (before, last)]
        goal = pitch.wanted(before.frequencies, last.frequencies, body.numbers)
        tones.append(Tone(pitch, sides[0][0], sides[1][0], goal, sides[0][1], sides[1][1]))
    volume = (before.system.mass - last.system.mass) / before.system.section.material.rho
    return Tuning(
        tuple(tones), tuple(patches), search.tolerance, search.depth, search.radius, search.mirror,
        search.n_solved + len(patches), float(volume), before, last, body,
    )  # fmt: skip
