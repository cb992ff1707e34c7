"""One page about a fit: pulses, residuals, profiles of the likelihood, double hits; its pictures alone too."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t

from .._base import check
from .._base.check import SimulationError
from ..scenes.sentences import si
from ..show import figures, plots
from ..show.style import BLUE, GREEN, SKY, VERMILION, panels
from ..taps.found import Found, covariation_in_words, scatter_in_words, stated
from ..taps.unknowns import unit_of
from .html_page import picture_uri, write_page

MASSES, TIPS = (0.5, 1.0, 2.0), (0.1, 0.3, 1.0, 3.0, 10.0)  # [-] of the double-hit table, over those found


def pulses(found: Found) -> Any:
    """Measured and predicted force of each tap, and ten times the residual: a matplotlib figure."""
    shown = found.used[:10]  # a screen holds no more
    columns = min(3, len(shown))
    with panels(len(shown), columns, 3.2, 2.4, sharex=True) as (figure, all_axes):
        for axes, tap in zip(all_axes, shown):
            one = found.predict(int(tap))
            axes.plot(1e3 * one.time, one.measured, ".", color=BLUE, ms=4, label="measured")
            axes.plot(1e3 * one.time, one.force, color=VERMILION, lw=1.0, label="model")
            axes.plot(1e3 * one.time, 10.0 * one.residual, color=GREEN, lw=0.9, label="residual x 10")
            axes.set_title(f"{found.taps.labels[tap]}: {100 * one.error:.2g} % rms")
        for axes in all_axes[-columns:]:
            axes.set_xlabel("time [ms]")
        all_axes[0].set_ylabel("force [N]")
        all_axes[0].legend(fontsize=8)
    return figure


def profiles(found: Found) -> Any:
    """The likelihood profile of every unknown; the level of the 90 % interval is dashed: a matplotlib figure."""
    names = found.names
    level = t.ppf(0.95, next(iter(found.profiles.values())).freedom) ** 2  # [-] at the ends of the 90 % interval
    with panels(len(names), min(3, len(names)), 3.2, 2.4, sharey=True) as (figure, all_axes):
        for axes, name in zip(all_axes, names):
            profile = found.profiles[name]
            axes.plot(profile.values, profile.rise, "o", color=BLUE, ms=3)
            axes.plot(*profile.curve(), color=BLUE, lw=1.2)
            axes.axhline(level, color=VERMILION, ls="--", lw=1.0)
            if profile.kind != "open":
                axes.axvspan(*profile.interval(), color=SKY, alpha=0.2, lw=0)
            low, high = profile.values[0], profile.values[-1]
            if profile.kind == "closed":  # the interval and 80 % of it on either side
                low, high = profile.interval()
                wide = (high / low) ** 0.8 if profile.log else 0.8 * (high - low)
                low, high = (low / wide, high * wide) if profile.log else (low - wide, high + wide)
            plots.set_ticks(axes, low, high, profile.log and high > 4.0 * low)
            if high > low:
                axes.set_xlim(low, high)
            axes.set_ylim(0.0, 12.0)
            unit = unit_of(name)
            axes.set_title(f"{name}{f' [{unit}]' if unit else ''}")
            said = {"open": "not determined", "limited": "one limit only"}.get(profile.kind)
            if said:
                axes.text(0.5, 0.85, said, transform=axes.transAxes, ha="center", color=VERMILION)
        all_axes[0].set_ylabel("rise over noise variance")
    return figure


def spectrum(found: Found) -> Any:
    """Amplitude spectra of force and residual, of all taps: a matplotlib figure."""
    frequency, residual, force = found.residual_spectrum()
    with figures.styled(6.4, 3.2) as figure:
        axes = figure.subplots()
        for rows, colour, label in ((force, BLUE, "force"), (residual, VERMILION, "residual")):
            axes.semilogy(1e-3 * frequency, np.maximum(rows.T, 1e-12), color=colour, lw=0.9)
            axes.plot([], [], color=colour, label=label)
        axes.set(xlabel="frequency [kHz]", ylabel="amplitude [N s]")
        axes.set_ylim(bottom=max(1e-12, 0.1 * float(np.median(residual))))
        axes.legend()
    return figure


def double_hits(found: Found, target: Any = None, at: Any = None) -> list[tuple[str, ...]]:
    """Number of impacts over head mass (rows) and tip stiffness (columns); the first row is the heading."""
    rows: list[tuple[str, ...]] = [("head", *(f"tip x {tip:g}" for tip in TIPS))]
    for share in MASSES:
        mass = share * found.striker.mass
        cells = []
        for tip in TIPS:
            try:
                cells.append(str(found.double_hit(target, at=at, mass=mass, tip=tip).n_impacts))
            except SimulationError:
                cells.append("?")
        rows.append((si(mass, "kg"), *cells))
    return rows


@check.typed
def write_fit(
    path: str | Path, found: Found, *, title: str = "Fit of measured taps", target: Any = None, at: Any = None
) -> None:
    """Write the page; needs the extra ``web``. Double hits are predicted for ``target`` or the structure found."""
    struck = target is not None or found.target is not None
    values = [(name, *stated(found.profiles[name]), unit_of(name)) for name in found.names]
    left_out = [f"{100 * one.error:.2g} %" for one in found.left_out()] if len(found.used) > 1 else []
    write_page(
        path,
        "fit.html",
        title=title,
        summary=found.summary().splitlines(),
        values=values,
        verdict=found.verdict,
        spreads={name: scatter_in_words(each) for name, each in found.spreads.items()},
        ridges={name: covariation_in_words(found.ridges[name]) for name in found.unidentifiable},
        tiles=[
            ("taps used", str(len(found.used))), ("rms residual", f"{100 * found.error:.2g} %"),
            ("left-out taps, worst", max(left_out, key=lambda text: float(text[:-2])) if left_out else "one tap only"),
            ("whiteness", f"{found.whiteness:.2g}"), ("not determined", str(len(found.unidentifiable))),
            ("taps that disagree", ", ".join(found.outliers) or "none"),
        ],
        pictures={name: picture_uri(draw(found)) for name, draw in
                  (("pulses", pulses), ("profiles", profiles), ("spectrum", spectrum))},
        double=double_hits(found, target, at) if struck else [],
        compared={law: f"{100 * error:.2g} %" for law, error in found.compared.items()},
    )  # fmt: skip
