"""Loops report to whoever listens, and to nobody else."""

import io
import logging
import sys
from contextlib import suppress

import fem_impact as fi
from fem_impact._base import progress


def test_reports_go_to_the_innermost_listener_until_its_block_ends_or_fails():
    heard = []
    progress.report("modes", 1, 2)  # nobody listens
    with suppress(RuntimeError), progress.observed(lambda *told: heard.append(("outer", *told))):
        progress.report("modes", 1, 2)
        with progress.observed(lambda *told: heard.append(("inner", *told))):
            progress.report("vectors", 3, 4)
        with progress.observed(None):
            progress.report("vectors", 4, 4)
        progress.report("modes", 2, 2)
        raise RuntimeError
    progress.report("modes", 1, 2)
    assert heard == [("outer", "modes", 1, 2), ("inner", "vectors", 3, 4), ("outer", "modes", 2, 2)]


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


def shown(monkeypatch, text, handlers=(), screen=Screen):
    """What a person sees of a line in a program with these handlers of its own."""
    seen = screen()
    with monkeypatch.context() as changed:
        changed.setattr(sys, "stderr", seen)
        changed.setattr(logging.getLogger(), "handlers", list(handlers))
        changed.delitem(sys.modules, "ipykernel", raising=False)
        progress.SLOW.info(text)
    return seen.getvalue()


def test_what_takes_long_is_one_line_on_a_terminal_unless_a_program_has_a_log_or_switches_it_off(monkeypatch):
    assert shown(monkeypatch, "compiling") == "fem_impact: compiling\n"
    assert shown(monkeypatch, "compiling", [logging.NullHandler()]) == ""
    assert shown(monkeypatch, "compiling", screen=io.StringIO) == ""  # no terminal
    progress.SLOW.setLevel(logging.WARNING)
    try:
        assert shown(monkeypatch, "compiling") == ""
    finally:
        progress.SLOW.setLevel(logging.INFO)


def test_a_long_strike_is_announced_with_its_cost(monkeypatch, caplog):
    plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    body = fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, supports={"boundary": "hinged"})
    monkeypatch.setattr(progress, "LONG", 0.0)
    with caplog.at_level(logging.INFO, logger="fem_impact.slow"):
        fi.strike(body, fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=(0.1, 0.1), speed=0.1, tolerance=0.1)
    assert any(text.startswith("striking takes about ") for text in caplog.messages)
