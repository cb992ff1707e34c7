"""Lays out the live page: sliders, the body to click on, the plots that follow, and the sound."""

import base64
import math
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from .._base.check import SimulationError, ToleranceWarning
from ..impact import force_spectrum
from ..impact.response import Response
from ..model.playing import Strokes, strokes
from ..modes.modal import Modes
from ..scenes.schema import written
from ..scenes.sentences import RAISED, place, power, si
from ..show import sound
from ..show.figures import SPECTRUM_DEPTH
from ..sweeps.grid import Case
from . import report
from .explore_model import MAP_TOLERANCE, Bench, Picture, Settings, blow, limit_of, quick

BAND = (20.0, 20e3)  # [Hz] of the spectrum: the audible range
SPECTRUM_POINTS = 240  # [-] more points take time but show no more
ROLLED = 1.5  # [s] of a roll, which then rings
PLAYED = 2.0  # [s] of sound: short enough to compute at each press of the button
HEIGHT = 270  # [px] of a picture: two rows fit on a laptop
COLOURS = ("#9a958c", "#d6e4f0", "#f0c75e", "#e08a1e", "#a63d0c")  # colours of NAMES, in order
HERE: dict[str, Any] = {"fill_color": "#d55e00", "line_color": "white", "line_width": 2}  # marker of the current blow
EAR: dict[str, Any] = {"fill_color": "#009e73", "line_color": "white", "line_width": 2}  # and of the listening point
NAMES = ("failed", "one impact", "two", "three", "more")
LABELS = {
    "mass": "Mass", "stiffness": "Stiffness", "exponent": "Exponent", "speed": "Speed", "bending": "First bending mode",
    "loss": "Loss of the contact", "damping": "Damping ratio", "thickness": "Thickness / the scene's",
}  # fmt: skip
CARDS = {  # which sliders stand under which picture
    "body": ("x", "y", "height", "rate"), "map": ("mass", "stiffness"), "force": ("speed", "exponent", "loss"),
    "spectrum": ("bending", "damping", "thickness"),
}  # fmt: skip
HIGHEST = 3.0  # [m] of the listener above the plate; at zero the sound is the motion of the surface
RATES = (2.0, 30.0, 12.0)  # [1/s] strokes of a roll: least, most and at first
MOVES = ("Click strikes", "Click listens")  # what a click on the body does
LINEAR = {"exponent", "loss", "damping"}  # sliders that are not logarithmic
STEPS = 200  # [-] per slider: about one per pixel
MOMENT = 8  # [ms] during which slider messages are collected before the next blow
REST = 200  # [ms] without a change before the map is redrawn: a map takes as long as many blows
TICKS_WANTED = 3  # [-] labels of a linear axis: more would touch each other on a phone
TICKS = """
    if (unit === "kg" && Math.abs(tick) < 1) { tick *= 1000; unit = "g" }
    const power = tick ? Math.max(-5, Math.min(4, Math.floor(Math.log10(Math.abs(tick)) / 3 + 1e-9))) : 0
    const prefix = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T"][power + 5]  // as in sentences.py
    return `${+(tick / 10 ** (3 * power)).toPrecision(3)} ${prefix}${unit}`
"""


class Page:
    """The page of one browser session: its settings, its plots and the handlers that change them."""

    def __init__(self, document: Any, bench: Bench) -> None:
        self.document, self.bench, self.settings = document, bench, bench.start
        self.pool = ThreadPoolExecutor(2)  # one for blows and sounds while the other draws a map
        self.drawn: Any = None  # the settings that the map was drawn for
        self.picture: Picture | None = None
        self.waiting = self.mapping = self.judging = False
        self.heard_at = tuple(
            float(x) for x in np.atleast_1d(bench.scene.points[0])
        )  # where the surface is listened to
        self.hit: Response | None = None
        # where the blow is exact, and the compliance or the vectors there
        self.refined = None if bench.told else bench.start.at
        self.seen, self.rest = None, bench.residual(bench.start)

    def show(self) -> None:
        """Put everything on the page and strike once."""
        from bokeh.models import ColumnDataSource

        title = self.bench.scene.title or self.bench.scene.path.stem
        columns = {
            "force-data": "x y", "spectrum-data": "x y", "cells": "left right bottom top colour", "limit": "x y",
            "here": "x y", "at": "x y", "ear": "x y", "sound": "uri note", "said": "name title text",
        }  # fmt: skip
        self.sources = {
            name: ColumnDataSource(name=name, data={column: [] for column in names.split()})
            for name, names in columns.items()
        }
        hands = self._hands()
        roots = [self._readout(), self._body(), self._map(), self._force(), self._spectrum(), *hands]
        roots[0].tags = [self.sources["sound"], self.sources["said"]]  # Bokeh sends only what is attached to the page
        for root in roots:
            self.document.add_root(root)
        self.document.title = title
        self.document.template, self.numbers = (report.template(name) for name in ("explore.html", "readout.html"))
        style, script = ((report.WEB / f"explore.{kind}").read_text(encoding="utf-8") for kind in ("css", "js"))
        self.document.template_variables.update(
            heading=title, legend=list(zip(NAMES, COLOURS)), style=style, script=script,
        )  # fmt: skip
        self.document.on_session_destroyed(lambda _: self.pool.shutdown(wait=False, cancel_futures=True))
        self.update()

    def _readout(self) -> Any:
        from bokeh.models.widgets import Div

        self.readout = Div(name="readout", sizing_mode="stretch_width")
        return self.readout

    def _hands(self) -> list[Any]:
        """Sliders and buttons, in a column under each picture."""
        from bokeh.layouts import column
        from bokeh.models import InlineStyleSheet
        from bokeh.models.widgets import Button, RadioButtonGroup

        sheet = InlineStyleSheet(css=(report.WEB / "sliders.css").read_text(encoding="utf-8"))
        self.sliders: dict[str, Any] = {}
        for name, label in LABELS.items():
            value = getattr(self.settings, name)
            if value is None:
                continue
            low, high = self.bench.range(name)
            if name not in LINEAR:
                low, high, value = (math.log10(x) for x in (low, high, value))
            self._slider(sheet, name, label, low, high, value).on_change("value", partial(self._turned, name))
        low, high = self.bench.mesh.points.min(axis=0), self.bench.mesh.points.max(axis=0)
        for i, letter in enumerate("xy"[: self.bench.mesh.dimension]):
            slider = self._slider(sheet, letter, f"Strike point {letter}", low[i], high[i], self.settings.at[i])
            slider.on_change("value", lambda _attr, _old, _new: self._moved())
        if self.bench.mesh.dimension == 2:
            height = self._slider(sheet, "height", "Height of the listener", 0.0, HIGHEST, 0.0)
            height.on_change("value", lambda _attr, _old, _new: self._label(self.settings))
        rate = self._slider(sheet, "rate", "Strokes of a roll", *RATES)
        rate.on_change("value", lambda _attr, _old, _new: self._label(self.settings))
        self.moves = RadioButtonGroup(
            name="moves", labels=list(MOVES), active=0, stylesheets=[sheet], sizing_mode="stretch_width"
        )
        buttons = []
        for name, label in (("listen", "Strike and listen"), ("roll", "Play a roll")):
            button = Button(name=name, label=label, button_type="primary", stylesheets=[sheet], height=44)
            button.sizing_mode = "stretch_width"
            button.on_click(partial(self._listen, name == "roll"))
            buttons.append(button)
        made = []
        for card, names in CARDS.items():
            widgets = [self.sliders[name] for name in names if name in self.sliders]
            widgets = [self.moves, *widgets, *buttons] if card == "body" else widgets
            made.append(column(*widgets, name=f"hands-{card}", sizing_mode="stretch_width"))
        return made

    def _slider(self, sheet: Any, name: str, title: str, low: float, high: float, value: float) -> Any:
        """A slider that says its value in words; see `_label`."""
        from bokeh.models.widgets import Slider

        self.sliders[name] = Slider(
            name=name, title=title, start=low, end=high, value=value, step=(high - low) / STEPS, show_value=False,
            sizing_mode="stretch_width", stylesheets=[sheet],
        )  # fmt: skip
        return self.sliders[name]

    def _figure(self, name: str, title: str, x: str, y: str, **options: Any) -> Any:
        from bokeh.plotting import figure

        made: Any = figure(
            name=name, title=title, x_axis_label=x, y_axis_label=y, height=HEIGHT, sizing_mode="stretch_width",
            tools="", toolbar_location=None,
            background_fill_color=None, border_fill_color=None, **options,
        )  # fmt: skip
        made.title.text_font_size = "14px"
        made.axis.axis_label_text_font_style = "normal"
        return made

    def _formatted(self, axis: Any, unit: str) -> None:
        from bokeh.models import CustomJSTickFormatter

        if hasattr(axis.ticker, "desired_num_ticks"):
            axis.ticker.desired_num_ticks = TICKS_WANTED
        axis.formatter = CustomJSTickFormatter(args={"unit": unit}, code=TICKS)

    def _body(self) -> Any:
        """The struck body from above, or a beam from the side."""
        mesh = self.bench.mesh
        if mesh.dimension == 2:
            plot = self._figure("body", "Struck ●, heard ◆", "x", "y", match_aspect=True)
            ends = mesh.points[mesh.facets]  # (n_facets, 2, 2)
            cells = mesh.points[mesh.cells]
            fill = plot.patches(list(cells[:, :, 0]), list(cells[:, :, 1]), line_width=1)
            plot.multi_line(list(ends[:, :, 0]), list(ends[:, :, 1]), color="#2b6ea3", line_width=2)
            self._formatted(plot.yaxis[0], "m")
        else:
            low, high = float(mesh.points.min()), float(mesh.points.max())
            plot = self._figure("body", "Struck ●, heard ◆", "x", "", y_range=(-0.2, 0.2))
            fill = plot.quad(left=[low], right=[high], bottom=[-0.02], top=[0.02])
            plot.yaxis.visible = plot.ygrid.visible = False
        fill.glyph.name = "body-fill"
        self._formatted(plot.xaxis[0], "m")
        plot.scatter("x", "y", source=self.sources["ear"], size=13, marker="diamond", **EAR)
        plot.scatter("x", "y", source=self.sources["at"], size=15, **HERE)
        plot.on_event("tap", self._tapped)
        return plot

    def _map(self) -> Any:
        ends = {name: self.bench.range(name) for name in ("mass", "stiffness")}
        plot = self._figure(
            "map", "Number of impacts", "mass of the striker", "contact stiffness over the scene's", x_axis_type="log",
            y_axis_type="log", x_range=ends["mass"], y_range=ends["stiffness"],
        )  # fmt: skip
        plot.grid.visible = False
        plot.quad("left", "right", "bottom", "top", color="colour", line_color="colour", source=self.sources["cells"])
        plot.line("x", "y", source=self.sources["limit"], line_dash="dashed", line_width=2, color="#1d1c1a")
        plot.scatter("x", "y", source=self.sources["here"], size=15, **HERE)
        self._formatted(plot.xaxis[0], "kg")
        plot.on_event("tap", self._chosen)
        return plot

    def _force(self) -> Any:
        plot = self._figure("force", "Contact force", "time", "")
        plot.line("x", "y", source=self.sources["force-data"], line_width=2).glyph.name = "force-line"
        self._formatted(plot.xaxis[0], "s")
        self._formatted(plot.yaxis[0], "N")
        plot.y_range.start = 0.0
        return plot

    def _spectrum(self) -> Any:
        from bokeh.models.annotations import Span

        plot = self._figure(
            "spectrum", "Spectrum of the force", "frequency", "", x_axis_type="log", y_axis_type="log", x_range=BAND,
            y_range=(1e-6, 1.0),
        )  # fmt: skip
        plot.line("x", "y", source=self.sources["spectrum-data"], line_width=2).glyph.name = "spectrum-line"
        self.resonance = Span(dimension="height", line_color="#009e73", line_width=2, location=1.0)
        self.threshold = Span(name="limit-span", dimension="height", line_width=2, line_dash="dashed", location=1.0)
        plot.add_layout(self.resonance)
        plot.add_layout(self.threshold)
        self._formatted(plot.xaxis[0], "Hz")
        self._formatted(plot.yaxis[0], "N s")
        return plot

    def _turned(self, name: str, _attribute: str, _old: float, value: float) -> None:
        self._change(**{name: float(value) if name in LINEAR else 10.0 ** float(value)})

    def _moved(self) -> None:
        """React to a strike-point slider."""
        at = tuple(float(self.sliders[letter].value) for letter in "xy" if letter in self.sliders)
        found = self.bench.place(*at, *([0.0] * (2 - len(at))))
        if found is not None and found != self.settings.at:
            self._change(at=found)

    def _tapped(self, event: Any) -> None:
        found = self.bench.place(float(event.x), float(event.y))
        if found is None:
            return
        if self.moves.active:
            self.heard_at = found
            self._mark_ear()
            return
        self._change(at=found)
        for letter, value in zip("xy", found):
            self.sliders[letter].value = value

    def _mark_ear(self) -> None:
        """Show where it is listened."""
        ear = (*self.heard_at, 0.0)
        self._put("ear", x=[ear[0]], y=[ear[1] if len(self.heard_at) > 1 else 0.0])

    def _chosen(self, event: Any) -> None:
        """Take mass and stiffness from a click on the map."""
        for name, value in (("mass", event.x), ("stiffness", event.y)):
            low, high = self.bench.range(name)
            self.sliders[name].value = math.log10(min(max(float(value), low), high))

    def _change(self, **changes: Any) -> None:
        """Collect changes for `MOMENT`, then strike once: fast slider moves must not queue up blows."""
        self.settings = replace(self.settings, **changes)
        if not self.waiting:
            self.waiting = True
            self.document.add_timeout_callback(self.update, MOMENT)

    def update(self) -> None:
        """Show the current settings and what their blow does, in coarse steps; the exact one follows, see `_judge`."""
        self.waiting = False
        settings = self.settings
        case = self._case(settings)
        self._label(settings)
        at = settings.at if len(settings.at) > 1 else (*settings.at, 0.0)
        self._put("at", x=[at[0]], y=[at[1]])
        self._put("here", x=[settings.mass], y=[settings.stiffness])
        self._mark_ear()
        resonance, limit = case.resonance, self._limit(case)
        self.resonance.location, self.threshold.location = resonance, min(max(limit, 1.0), 1e9)
        try:
            self.hit = quick(case)
        except SimulationError as error:
            self.hit = None
            self.readout.text = self.numbers.render(failed=str(error))
        else:
            self._draw(self.hit)
            self._show(self.hit, _told(self.hit, resonance, limit, False), settings, _described(case.modes), "", ())
        if not self.judging:
            self._begin_judging()
        self._remap()

    def _case(self, settings: Settings) -> Case:
        known = self.refined == settings.at
        return self.bench.case(settings, None if known else self.rest, self.seen if known else None)

    def _judge(self) -> None:
        """Find the blow to the tolerance, and what the model itself errs by, beside the page."""
        settings, known = self.settings, self.refined == self.settings.at
        case = self._case(settings)
        resonance, limit = case.resonance, self._limit(case)
        what = _described(case.modes)

        def done(hit: Response | None, failed: str, model: tuple[str, ...], own: str) -> None:
            self.judging = False
            if settings != self.settings or known != (self.refined == settings.at):
                self._begin_judging()
            elif hit is None:
                self.hit, self.readout.text = None, self.numbers.render(failed=failed)
            elif known:
                self.hit = hit
                self._draw(hit)
                cells = [*_told(hit, resonance, limit, True), ("the model's own error", own)]
                self._show(hit, cells, settings, what, hit.verdict, model)

        def work() -> None:
            hit, failed, own = None, "", ""
            model: tuple[str, ...] = ()
            try:
                hit = blow(case)
                own, model = power(hit.model_error), hit.model_verdict
            except SimulationError as error:
                failed = str(error)
            self.document.add_next_tick_callback(lambda: done(hit, failed, model, own))

        self.pool.submit(work)

    def _begin_judging(self) -> None:
        self.judging = True
        self.document.add_timeout_callback(self._judge, REST)

    def _show(
        self, hit: Response, cells: list[tuple[str, str]], settings: Settings, what: str, verdict: str,
        model: tuple[str, ...],
    ) -> None:  # fmt: skip
        """Write the numbers, and whether tolerance and model hold."""
        text = base64.b64encode(written(self.bench.saved(settings)).encode()).decode("ascii")
        self.readout.text = self.numbers.render(
            cells=cells,
            missed=bool(verdict) and not hit.tolerance_met,
            what=what,
            verdict=verdict,
            model=model,
            scene=f"data:application/toml;base64,{text}",
        )

    def _put(self, name: str, **columns: list[float]) -> None:
        """Replace the data of a source, but only if they differ: each change makes the browser redraw."""
        if self.sources[name].data != columns:
            self.sources[name].data = columns

    def _limit(self, case: Case) -> float:
        """The threshold [Hz], interpolated from the map if that belongs to the same stick and strike point."""
        picture, settings = self.picture, self.settings
        if picture is not None and (self.drawn.at, self.drawn.bending) == (settings.at, settings.bending):
            with np.errstate(all="ignore"):
                found = np.exp(np.interp(np.log(settings.mass), np.log(picture.mass), np.log(picture.threshold)))
            if np.isfinite(found) and found > 0.0:
                return float(found)
        return limit_of(case)

    def _draw(self, hit: Response) -> None:
        end = 1.15 * hit.impacts[-1].end if hit.impacts else float(hit.time[-1])
        shown = hit.time <= end
        self.sources["force-data"].data = {"x": hit.time[shown], "y": hit.force[shown]}
        frequencies = np.geomspace(*BAND, SPECTRUM_POINTS)
        size = force_spectrum.magnitude(hit.time, hit.force, frequencies)
        top = float(size.max()) or 1.0
        self.sources["spectrum-data"].data = {"x": frequencies, "y": np.maximum(size, 0.1 * SPECTRUM_DEPTH * top)}
        self.document.get_model_by_name("spectrum").y_range.update(start=SPECTRUM_DEPTH * top, end=2.0 * top)

    def _label(self, settings: Settings) -> None:
        """Write beside each slider what it stands at."""
        law = self.bench.law(settings)
        raised = "" if settings.exponent == 1.0 else f"{settings.exponent:.3g}".translate(RAISED)
        said = {
            "mass": si(settings.mass, "kg", 3),
            "stiffness": si(law.stiffness, "N/m", 3) + raised,
            "exponent": f"{settings.exponent:.3g}",
            "speed": si(settings.speed, "m/s", 3),
            "bending": si(settings.bending or 0.0, "Hz", 3),
            "loss": f"{settings.loss:.3g} s/m",
            "damping": f"{settings.damping:.3g}",
            "thickness": f"{settings.thickness:.3g}",
        }
        said |= {letter: si(value, "m", 3) for letter, value in zip("xy", settings.at)}
        said["rate"] = f"{self.sliders['rate'].value:.3g} a second"
        if "height" in self.sliders:
            height = float(self.sliders["height"].value)
            said["height"] = f"{si(height, 'm', 3)}, in the air" if height > 0.0 else "on the surface"
        shown = [name for name in said if name in self.sliders]
        self.sources["said"].data = {
            "name": shown,
            "title": [self.sliders[name].title for name in shown],
            "text": [said[name] for name in shown],
        }

    def _remap(self) -> None:
        """If the map no longer fits the settings, recompute it in the background once the sliders rest."""
        if not self.mapping and self._background() != self.drawn:
            self.mapping = True
            self._entitle_map()
            self.document.add_timeout_callback(self._begin_map, REST)

    def _background(self) -> Settings:
        """The settings with mass and stiffness reset, because the map covers both."""
        return replace(self.settings, mass=self.bench.start.mass, stiffness=1.0)

    def _begin_map(self) -> None:
        wanted = self._background()

        def work() -> None:
            known = self.refined == wanted.at
            seen = self.seen if known else self.bench.seen(wanted.at)
            rest = self.rest if known else self.bench.residual(wanted)
            self.document.add_next_tick_callback(lambda: self._refine(wanted.at, rest, seen))
            try:
                picture = self.bench.picture(wanted, seen)
            except (SimulationError, ValueError):
                picture = None
            self.document.add_next_tick_callback(lambda: self._mapped(wanted, picture))

        self.pool.submit(work)

    def _refine(self, at: tuple[float, ...], rest: float, seen: Any) -> None:
        """Store what is known of a new strike point and strike again: its blows are exact from now on."""
        if self.refined != at:
            self.refined, self.rest, self.seen = at, rest, seen
            self.update()

    def _entitle_map(self) -> None:
        self.document.get_model_by_name("map").title.text = "Number of impacts" + ", computing …" * self.mapping

    def _mapped(self, wanted: Settings, picture: Picture | None) -> None:
        self.mapping, self.drawn, self.picture = False, wanted, picture
        if picture is not None:
            self.sources["cells"].data = _quads(picture)
            self.sources["limit"].data = {"x": picture.mass, "y": picture.limit}
        self._entitle_map()
        self._remap()  # if the settings changed meanwhile

    def _listen(self, roll: bool) -> None:
        """Play the blow, or a roll of them, as heard on the surface or above it; computed beside the page."""
        settings, where = self.settings, self.heard_at
        height = float(self.sliders["height"].value) if "height" in self.sliders else 0.0
        case = self.bench.case(settings)
        rate = float(self.sliders["rate"].value)
        self.sources["sound"].data = {"uri": [""], "note": ["Computing the sound …"]}

        def work() -> None:
            try:
                rung = rolled(case, rate) if roll else blow(case)
                if height > 0.0:
                    heard = sound.radiate(rung, (*where, height), duration=PLAYED)
                else:
                    heard = sound.synthesise(rung, where, duration=PLAYED)
                made = _sounding(heard)
            except (SimulationError, ValueError) as error:
                made = "", str(error)
            uri, note = made
            place_of = (
                f"{si(height, 'm', 3)} above {place(where)}" if height > 0.0 else f"the surface at {place(where)}"
            )
            self.document.add_next_tick_callback(
                lambda: self.sources["sound"].update(data={"uri": [uri], "note": [f"Heard from {place_of}. {note}"]})
            )

        self.pool.submit(work)


def rolled(case: Case, rate: float) -> Strokes:
    """A roll: the blow again and again, ``rate`` times a second, on the body as it then moves."""
    when = np.arange(max(1, round(ROLLED * rate))) / rate
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToleranceWarning)
        return strokes(
            case.modes, [(float(time), case.striker, case.contact, case.at, case.speed) for time in when],
            tolerance=MAP_TOLERANCE,
        )  # fmt: skip


def _sounding(heard: sound.Sound) -> tuple[str, str]:
    """The sound as a data URI, raised if it is quiet, and its level in words."""
    level = heard.peak_level
    raised = max(0.0, report.QUIET - level) if math.isfinite(level) else 0.0
    note = f"Full scale is {heard.full_scale:g} {heard.unit}; peak {level:.1f} dB"
    note += f", raised here by {raised:.1f} dB." if raised else "."
    return report.audio(heard.samples * 10.0 ** (raised / 20.0), heard.rate), note.replace("-", "−")


def _told(hit: Response, resonance: float, limit: float, exact: bool) -> list[tuple[str, str]]:
    """The blow in names and values; without an error until the compliance of a new strike point is known."""
    error = "refining …" if not exact else power(hit.error.total) if hit.error.resolvable else "not resolvable"
    ratio = f"{resonance / limit:.2g} × threshold" if 0.0 < limit < math.inf else ""
    ratio = ratio or f"body {'never' if limit else 'always'} stops it"
    return [
        ("impacts", str(hit.n_impacts)),
        ("peak force", si(hit.peak_force, "N", 3)),
        ("time in contact", si(hit.contact_time, "s", 3)),
        ("restitution", f"{hit.restitution:.3f}".replace("-", "−")),
        ("contact resonance", f"{si(resonance, 'Hz', 3)}, {ratio}"),
        ("estimated error", error),
    ]


def _described(modes: Modes) -> str:
    """What carries the blow, in words."""
    if modes.poorer:
        return f"{modes.n_modes} Ritz vectors started from the strike point"
    return f"the first {modes.n_modes} modes"


def _quads(picture: Picture) -> dict[str, Any]:
    """Every cell of the map as a coloured rectangle."""
    edges = []
    for values in (picture.mass, picture.stiffness):
        step = (values[1] / values[0]) ** 0.5
        edges.append(np.append(values / step, values[-1] * step))
    n = len(picture.mass)
    colour = np.array(COLOURS)[np.clip(np.where(picture.n_impacts > 0, picture.n_impacts, 0), 0, len(COLOURS) - 1)]
    return {
        "left": np.tile(edges[0][:-1], n),
        "right": np.tile(edges[0][1:], n),
        "bottom": np.repeat(edges[1][:-1], n),
        "top": np.repeat(edges[1][1:], n),
        "colour": colour.reshape(-1).tolist(),
    }
