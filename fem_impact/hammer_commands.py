"""What the commands of a test with a hammer do: choose one, and plan where it taps."""

import argparse
from collections.abc import Sequence
from typing import Any

import fem_impact as fi

from . import commands
from ._base import check
from ._base.explained import noted
from ._base.files import staged
from .scenes import tips

MASSES = [m * 10.0**e for e in (-3, -2, -1) for m in (1.0, 2.0, 5.0)] + [1.0]  # [kg] of hammers from 1 g to 1 kg


def hammer(options: argparse.Namespace) -> commands.Answer:
    """Find hammers for a bandwidth, or plan a test with one that roves."""
    scene = fi.load_scene(options.scene)
    masses = options.masses or MASSES
    notes = tips.said_of(scene)
    if options.rove is not None:
        return _rove(options, scene, masses, notes)
    drawn = commands._drawn(options, "hammers.png")
    with commands._display(options, tells=True)("hammers"):
        hammers = tips.hammers_for(scene, options.bandwidth, masses, drop=options.drop, between=True)
        if drawn is not None:
            from .show import plots  # imported only when needed, as matplotlib takes a second

            drawn.parent.mkdir(parents=True, exist_ok=True)
            fi.figures.save(drawn, plots.hammers(hammers, options.bandwidth, options.drop))
    notes = (*notes, *hammers[0].notes)
    rows = [
        (f"{1e3 * hammer.mass:.4g} g{' *' * hammer.border}", f"{hammer.softest:.3g} N/m" if hammer.softest else "none",
         f"{'> ' * hammer.unlimited}{hammer.hardest:.3g} N/m" if hammer.hardest else "none",
         f"{hammer.reach:.4g} Hz" if hammer.reach else "-")
        for hammer in hammers
    ]  # fmt: skip
    said: list[str | Sequence[str]] = [
        commands._title(scene),
        *noted(notes),
        f"Linear tips that reach {options.bandwidth:g} Hz (spectrum at most {options.drop:g} dB down) and hit once:",
        commands._table(rows, ("mass", "softest tip", "hardest tip", "its reach")),
    ]
    for hammer in (each for each in hammers if len(each.working) > 1):
        ranges = ", ".join(f"{low:.3g} to {high:.3g} N/m" for low, high in hammer.working)
        said.append(f"{1e3 * hammer.mass:.4g} g: every range that works: {ranges}")
    if any(hammer.unlimited for hammer in hammers):
        said.append(">: still a single hit with the hardest tip that the model resolves")
    if any(hammer.border for hammer in hammers):
        said.append("*: the last mass that works between two that were asked for, found to half a per cent")
    idle = ", ".join(f"{1e3 * hammer.mass:.4g} g" for hammer in hammers if not hammer.works)
    if idle:
        said.append(f"{idle}: no tip reaches {options.bandwidth:g} Hz and hits once; try lighter hammers")
    data = {"bandwidth": options.bandwidth, "drop": options.drop, "hammers": [hammer.data() for hammer in hammers]}
    return commands._answer_of_file({**data, "notes": notes}, said, drawn)


def _rove(options: argparse.Namespace, scene: Any, masses: Sequence[float], notes: Sequence[str]) -> commands.Answer:
    """Plan a test with a roving hammer."""
    from .taps import roving  # imported only when needed

    number, drawn = check.count("--rove", options.rove), commands._drawn(options, "rove.png")
    with commands._display(options, tells=True)("points"):
        plan = roving.of_scene(scene, masses, options.bandwidth, options.drop, number)
        if drawn is not None:
            with staged(drawn.parent) as staging:
                fi.figures.save(staging / drawn.name, plan.figure())
                plan.write_csv((staging / drawn.name).with_suffix(".csv"))
    data = {"table": plan.table(), "verdicts": plan.verdicts, "resolution": plan.resolution}
    files = [] if drawn is None else [drawn.name, drawn.with_suffix(".csv").name]
    said = [commands._title(scene), *noted(notes), plan.summary()]
    return commands.answer({**data, "notes": [*notes, *plan.notes]}, *said, folder=drawn and drawn.parent, files=files)
