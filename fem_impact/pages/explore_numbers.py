"""What the live page shows of a blow, as numbers and words that can be sent to it."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import markup
from .._base.check import SimulationError, ToleranceWarning
from ..impact import force_spectrum
from ..impact.quantities import rebound
from ..impact.response import Response
from ..model.playing import strokes
from ..modes.modal import Modes
from ..scenes.scene import Scene
from ..scenes.schema import toml_text
from ..scenes.sentences import RAISED, place, power, si
from ..show import sound
from ..show.figures import SPECTRUM_DEPTH
from ..sweeps.grid import Case
from .explore_bench import Order, scene_of_order
from .explore_map import Mapper, Picture, Window
from .explore_model import MAP_TOLERANCE, Settings, Setup, limit_of, strike_quickly
from .html_page import QUIET, audio, packed

BAND = (20.0, 20e3)  # [Hz] of the spectrum: the audible range
SPECTRUM_POINTS = 240  # [-] more points take time but show no more
SPECTRUM_FACTS = {"band": BAND, "points": SPECTRUM_POINTS, "depth": SPECTRUM_DEPTH}  # as pages draw it
PLAYED = 2.0  # [s] of sound: short enough to compute at each press of the button
KNOWN = 8  # [-] strike points remembered
Point = tuple[float, ...]
Message = dict[str, Any]


@dataclass(frozen=True, eq=False)
class View:
    """The body as blows at one strike point excite it."""

    rest: float  # [m/N] residual compliance of the modes
    body: Modes | None  # Ritz vectors, where these can represent it


@dataclass(frozen=True, eq=False)
class Kept:
    """A blow kept to compare others with, on its own body and heard from its own place."""

    setup: Setup
    settings: Settings
    where: Point  # [m] of the listener
    height: float  # [m] of the listener
    shown: Message  # what pages show of it


class Explorer:
    """A setup, what is known of its strike points, and everything the page shows of its blows."""

    def __init__(self, setup: Setup, first: Scene | None = None, order: Order | None = None) -> None:
        self.first = first or setup.scene  # what the server began with
        self.kept: dict[str, Kept] = {}  # letter -> blow
        self.become(setup, order or Order())

    def become(self, setup: Setup, order: Order) -> None:
        """Take another setup in the place of the one before."""
        self.setup, self.order, self.mapper = setup, order, Mapper(setup)
        self.views: dict[Point, View] = {}
        self.rest = setup.residual_at(setup.start.at)  # [m/N] of the last point known, good enough for a first answer
        self.limit: tuple[Any, float] = None, 0.0  # [Hz] the last threshold, and what it is of
        if not setup.by_vectors:
            self.learn(setup.start.at, View(self.rest, None))

    def open(self, order: Order) -> Setup:
        """Find the setup of an order: seconds, unless only the mallet is another one; kernels are compiled."""
        same = replace(self.order, mallet=order.mallet, at=order.at) == order and order.at is not None
        setup = Setup.of(scene_of_order(self.first, order), order.dropped, self.setup if same else None)
        self.become(setup, order)
        self.answer(setup.start)
        return setup

    def keep(self, letter: str, settings: Settings, where: Point, height: float, shown: Message) -> None:
        """Keep a blow on the present body under a letter."""
        self.kept = {**self.kept, letter: Kept(self.setup, settings, where, height, shown)}

    def forget(self, letter: str) -> None:
        """Keep a blow no longer."""
        self.kept = {name: kept for name, kept in self.kept.items() if name != letter}

    def learn(self, at: Point, view: View) -> None:
        """Remember a strike point; the oldest is forgotten."""
        known = {**self.views, at: view}
        self.views = {place: known[place] for place in list(known)[-KNOWN:]}  # new: the old may be on its way elsewhere
        self.rest = view.rest

    def look(self, at: Point) -> View:
        """Find the body as blows at a point excite it: seconds, if by Ritz vectors."""
        if at not in self.views:
            self.learn(at, View(self.setup.residual_at(at), self.setup.excited_at(at)))
        return self.views[at]

    def case(self, settings: Settings) -> Case:
        """The blow, on the body as far as it is known."""
        view = self.views.get(settings.at)
        return self.setup.case(settings, view.rest if view else self.rest, view.body if view else None)

    def answer(self, settings: Settings) -> tuple[Message, Response | None]:
        """The blow in coarse steps: some 10 ms."""
        case = self.case(settings)
        try:
            hit = strike_quickly(case)
        except SimulationError as error:
            return {"failed": str(error)}, None
        return {**_force(hit), "cells": _numbers(hit, False), "what": _described(case.modes)}, hit

    def rest_of(self, settings: Settings, hit: Response | None) -> Message:
        """What follows the answer: spectrum, threshold and the scene file."""
        case = self.case(settings)
        about = case.at.tobytes(), settings.at in self.views, settings.mass, settings.thickness
        if self.limit[0] != about:  # contact, speed and damping do not change it
            self.limit = about, limit_of(case)
        resonance, threshold = case.resonance, self.limit[1]
        limit = threshold if 0.0 < threshold < math.inf else None  # as pages draw it
        ratio = (
            f"{resonance / limit:.2g} × threshold" if limit else f"body {'never' if threshold else 'always'} stops it"
        )
        message = {
            "resonance": resonance, "limit": limit,
            "resonates": f"{si(resonance, 'Hz', 3)}, {ratio}",
            "scene": markup.data_uri("application/toml", toml_text(self.setup.saved(settings)).encode()),
        }  # fmt: skip
        return message | ({} if hit is None else _spectrum(hit))

    def judge(self, settings: Settings) -> Message:
        """The blow to the tolerance, and what the model itself errs by."""
        view = self.look(settings.at)
        case = self.setup.case(settings, body=view.body)
        try:
            hit = case.blow(tolerance=self.setup.tolerance)
        except SimulationError as error:
            return {"failed": str(error)}
        return {
            **_force(hit), **_spectrum(hit), "cells": [*_numbers(hit, True), ("model's error", power(hit.model_error))],
            "what": _described(case.modes), "verdict": hit.verdict, "missed": not hit.tolerance_met,
            "trusted": hit.trusted, "model": hit.model_verdict[1:],
        }  # fmt: skip

    def map(self, settings: Settings, step: Callable[..., Picture], about: Window | Picture) -> Picture:
        """A step of `Mapper` on the body as far as it is known: the first map of a window, or a better one."""
        view = self.views.get(settings.at)
        return step(self.mapper, settings, about, view.body if view else None)

    def listen(
        self, settings: Settings, where: Point, height: float, rate: float | None = None, letter: str = "",
        share: float = 1.0,
    ) -> Message:  # fmt: skip
        """A blow, ``rate`` [1/s] of them, or the kept one of a letter, ``share`` times as fast, as the page plays it.

        It is heard on the surface or ``height`` [m] above it. ``scale`` is what a sample of one stands for, in the unit
        of the peak.
        """
        setup = self.setup
        if letter in self.kept:
            kept = self.kept[letter]
            setup, settings, where, height = kept.setup, kept.settings, kept.where, kept.height
        case = setup.case(replace(settings, speed=share * settings.speed))
        for point in (settings.at, where)[: 1 if height > 0.0 else 2]:
            if setup.at_rest(point):
                return {"uri": "", "note": f"Silent: the body does not move at {place(point)}."}
        # a roll is the blow again and again on the body as it then moves
        when = np.zeros(1) if rate is None else np.arange(max(1, round(0.75 * PLAYED * rate))) / rate
        each = [(time, case.striker, case.contact, case.at, case.speed) for time in when.tolist()]
        tolerance = setup.tolerance if rate is None else MAP_TOLERANCE
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ToleranceWarning)  # the note says it
                # of itself: a soft blow's sound may be less than what its force errs by
                rung = strokes(case.modes, each, tolerance=tolerance, quantity=f"sound={sound.RATE // 2}")
            if height > 0.0:
                heard = sound.radiate(rung, (*where, height), duration=PLAYED)
            else:
                heard = sound.synthesise(rung, where, duration=PLAYED)
        except (SimulationError, ValueError) as error:
            return {"uri": "", "note": str(error)}
        level = heard.peak_level
        raised = max(0.0, QUIET - level) if math.isfinite(level) else 0.0  # of a sound that is quiet
        note = f"Peak {heard.said}; full scale {heard.full_scale:g} {heard.unit}"
        missed = "" if rung.tolerance_met else f"; it may err by {power(rung.error)} of itself"
        note = (note + (f", raised here by {raised:.1f} dB" if raised else "") + missed + ".").replace("-", "−")
        uri = audio(heard.samples * 10.0 ** (raised / 20.0), heard.rate)
        place_of = f"{si(height, 'm', 3)} above {place(where)}" if height > 0.0 else f"the surface at {place(where)}"
        return {
            "uri": uri, "note": f"Heard from {place_of}. {note}", "unit": heard.unit,
            "scale": heard.full_scale * 10.0 ** (-raised / 20.0), "peak": heard.full_scale * 10.0 ** (level / 20.0),
        }  # fmt: skip

    def describe_sliders(self, settings: Settings, height: float, rate: float) -> dict[str, str]:
        """What each slider stands at, in words."""
        law = self.setup.law(settings)
        raised = "" if settings.exponent == 1.0 else f"{settings.exponent:.3g}".translate(RAISED)
        said = {
            "mass": si(settings.mass, "kg", 3),
            "stiffness": si(law.stiffness, "N/m", 3) + raised,
            "exponent": f"{settings.exponent:.3g}",
            "speed": si(settings.speed, "m/s", 3),
            "bending": si(settings.bending or 0.0, "Hz", 3),
            "loss": f"{settings.loss or 0.0:.3g} s/m",
            "damping": f"{settings.damping:.3g}",
            "thickness": f"{settings.thickness:.3g}",
            "rate": f"{rate:.3g} a second",
            "height": f"{si(height, 'm', 3)}, in the air" if height > 0.0 else "on the surface",
        }
        return said | {letter: si(value, "m", 3) for letter, value in zip("xy", settings.at)}


def drawn_map(picture: Picture, pack: Callable[[Any, str], str] = packed) -> Message:
    """A map as the page draws it; ``pack`` makes texts of its numbers."""
    return {
        "columns": len(picture.mass), "rows": len(picture.stiffness), "counts": pack(picture.n_impacts, "i1"),
        "mass": picture.mass[[0, -1]].tolist(), "stiffness": picture.stiffness[[0, -1]].tolist(),
        "x": pack(picture.limit_mass, "<f4"), "y": pack(picture.limit, "<f4"),
    }  # fmt: skip


def _force(hit: Response) -> Message:
    end = 1.15 * hit.impacts[-1].end if hit.impacts else float(hit.time[-1])
    shown = hit.time <= end
    return {"time": packed(hit.time[shown]), "force": packed(hit.force[shown])}


def _spectrum(hit: Response) -> Message:
    size = force_spectrum.magnitude(hit.time, hit.force, np.geomspace(*BAND, SPECTRUM_POINTS))
    top = float(size.max()) or 1.0
    return {"spectrum": packed(np.maximum(size, 0.1 * SPECTRUM_DEPTH * top))}


def _numbers(hit: Response, exact: bool) -> list[tuple[str, str]]:
    """The blow in names and values; without an error until the hand rests and the strike point is known."""
    error = "refining …" if not exact else power(hit.error.total) if hit.error.resolvable else "not resolvable"
    return [
        ("impacts", str(hit.n_impacts)),
        ("peak force", si(hit.peak_force, "N", 3)),
        ("contact time", si(hit.contact_time, "s", 3)),
        ("restitution", rebound(hit, 3).replace("-", "−")),
        ("estimated error", error),
    ]


def _described(modes: Modes) -> str:
    """What carries the blow, in words."""
    if modes.poorer:
        return f"{modes.n_modes} Ritz vectors started from the strike point"
    return f"the first {modes.n_modes} modes"
