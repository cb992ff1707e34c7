"""A blow in words and for notebooks."""

import html
from typing import TYPE_CHECKING

import numpy as np

from .._base import markup
from .._base.explained import heading_line, lines_of_notes, with_headings
from . import balance
from .compiled import record
from .history import CLEAR
from .quantities import rebound, words

if TYPE_CHECKING:
    from .response import Response

OUTCOMES = {
    record.FINISHED: "proven not to touch again",
    record.HORIZON: "stopped at the given duration",
    record.IMPACTS: "stopped after max_impacts",
    record.SETTLED: "everything came to rest",
}


def lines(hit: "Response") -> str:
    """The blow in a few readable lines."""
    several, returns = hit.history.n_contacts > 1, hit.striker is not None and hit.striker.returns
    lines = [hit.verdict, f"{hit.n_impacts} impact{'s' if hit.n_impacts != 1 else ''}; {hit.outcome}"]
    lines += [
        f"  {impact.start * 1e3:9.4f} to {impact.end * 1e3:9.4f} ms: peak {impact.peak_force:.5g} N, "
        f"impulse {impact.impulse:.5g} N s"
        + (f", contact {impact.contact}" if several else "")
        + (f", restitution {impact.restitution:.4g}" if returns and impact.restitution is not None else "")
        for impact in hit.impacts[:20]
    ]
    if hit.n_impacts > 20:
        lines.append(f"  ... and {hit.n_impacts - 20} more")
    if hit.margin < CLEAR:
        lines.append(f"margin {hit.margin:.1g} of the deepest approach: that close to another number of impacts")
    total = sum(hit.start_energies.values())
    parts = {balance.loss_in_words(hit) if name == "dissipated" else name: x for name, x in hit.energies.items()}
    shares = ", ".join(f"{name} {value / total:.2%}" for name, value in parts.items()) if total else "none"
    error = hit.error
    lines += [
        f"contact time {hit.contact_time * 1e3:.5g} ms, peak force {hit.peak_force:.5g} N, "
        f"impulse {hit.impulse:.5g} N s",
        f"restitution {rebound(hit, 5)} at {hit.speed:g} m/s",
        f"energy {total:.5g} J: {shares}",
        f"estimated error {error.total:.1e} of {words(hit.quantities)}: "
        + ", ".join(f"{name} {size:.1e}" for name, size in error.parts().items() if size or name == "time steps")
        + f"; energy error {hit.energy_error:.1e}",
    ]
    if hit.moving:
        began, gained = (
            ", ".join(f"{name} {x:.4g} J" for name, x in each.items() if name != "dissipated")
            for each in (hit.start_energies, hit.energy_gains)
        )
        lines.insert(-1, f"the target moved at the start: {began}; gained in the blow: {gained}")
    if several:
        each = ", ".join(f"contact {i} {1e3 * time:.5g} ms" for i, time in enumerate(hit.contact_times))
        lines.append(f"contact time: {each}; any of them {1e3 * hit.touching_time:.5g} ms")
    # what falls comes back later in proportion to the speed it left with: its times err by as much more than the first
    later = hit.impacts[-1].end / hit.impacts[0].end if returns and hit.impacts else 1.0
    if error.sensitivity > 1e3 * max(1.0, later):  # three digits are lost
        lines.append(
            f"chaotic: small differences grow {error.sensitivity:.0e}-fold from the first impact to the last; "
            "trust the number of impacts and averages, not single values"
        )
    if hit.audit is not None:
        lines += [f"Model: {with_headings(line)}" for line in hit.model_verdict[1:]]
    lines[1:1] = [
        *heading_line(hit.verdict),
        *lines_of_notes(hit.notes),
    ]  # a slip of a unit makes all that follows wrong
    return "\n".join(lines)


def page(hit: "Response") -> str:
    """The force curve and a table of results."""
    rows = [
        ("impacts", f"{hit.n_impacts}; {hit.outcome}"),
        ("peak force", f"{hit.peak_force:.5g} N"),
        ("contact time", f"{hit.contact_time:.5g} s"),
        ("impulse", f"{hit.impulse:.5g} N s"),
        ("restitution", rebound(hit, 5)),
        ("estimated error", f"{hit.error.total:.1e} of {hit.tolerance:g} accepted"),
    ]
    end = max((impact.end for impact in hit.impacts), default=np.inf)
    shown = hit.time <= end
    force = hit.force if hit.force.ndim == 1 else hit.force.sum(axis=1)
    said = f"Contact force over time: {hit.n_impacts} impacts, peak {hit.peak_force:.4g} N"
    return (
        f"<p>{html.escape(hit.verdict)}</p>"
        + markup.side_by_side(
            markup.curve(hit.time[shown], force[shown], label="force", unit="N", title=said), markup.table(rows)
        )
        + markup.note_list(hit.notes)
    )
