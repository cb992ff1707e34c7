"""Loops report to whoever listens, and to nobody else."""

import io
import logging
import sys
import threading
from contextlib import suppress

import numpy as np
import pytest

import fem_impact as fi
from fem_impact._base import progress
from fem_impact.scenes import templates


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
    given = body, fi.Striker.rigid(0.1), fi.Contact.linear(1e5)
    plan = fi.plan(*given, at=(0.1, 0.1), speed=0.1, tolerance=0.1)
    for strike in (plan.strike, lambda: fi.strike(*given, at=(0.1, 0.1), speed=0.1, tolerance=0.1)):
        caplog.clear()
        with caplog.at_level(logging.INFO, logger="fem_impact.slow"):
            strike()
        assert sum(text.startswith("striking takes about ") for text in caplog.messages) == 1


@pytest.fixture
def second(monkeypatch):
    """A clock that passes when told to."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(progress, "ANNOUNCER", progress.Announcer())

    def passes(seconds):
        now[0] += seconds

    return passes


def count_slowly(second, seconds):
    for done, each in enumerate(seconds):
        progress.report("cells", done, len(seconds))
        second(each)
    progress.report("cells", len(seconds), len(seconds))


def test_a_long_loop_that_nobody_observes_is_announced_and_again_if_it_takes_twice_as_long(second, caplog):
    with caplog.at_level(logging.INFO, logger="fem_impact.slow"):
        count_slowly(second, [0.1] * 20)
        assert caplog.messages == []  # two seconds are not long
        count_slowly(second, [1.0] * 10)
        assert caplog.messages == ["10 cells: about 9 s more"]
        second(60.0)
        count_slowly(second, [1.0, 30.0, *[1.0] * 8])
        assert caplog.messages[1:] == ["10 cells: about 9 s more", "10 cells: about 124 s more"]


def test_a_strike_that_takes_longer_than_announced_says_so(second, caplog):
    with caplog.at_level(logging.INFO, logger="fem_impact.slow"):
        progress.ANNOUNCER.announce("striking takes about 10 s", 10.0)
        second(15.0)
        progress.revise(8.0)
        second(10.0)
        progress.revise(30.0)
        progress.revise(40.0)
    assert caplog.messages == ["striking takes about 10 s", "about 30 s more"]


def test_a_loop_that_somebody_observes_or_in_a_thread_of_its_own_is_not_announced(second, caplog):
    with caplog.at_level(logging.INFO, logger="fem_impact.slow"):
        with progress.observed(None):
            count_slowly(second, [1.0] * 10)
        thread = threading.Thread(target=count_slowly, args=(second, [1.0] * 10))
        thread.start()
        thread.join()
    assert caplog.messages == []


def test_maps_and_points_count_what_is_done_for_whoever_waits(monkeypatch):
    told = []
    monkeypatch.setattr(progress.ANNOUNCER, "follow", lambda *each: told.append(each))
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=20)
    over = {"striker.mass": np.geomspace(0.02, 0.2, 3)}
    fi.sweep(plate, fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=(0.45, 0.3), speed=1.0, over=over)
    assert told == [("cells", 3, 3)]


def test_stages_and_maps_are_logged_under_the_name_of_the_package(caplog, capsys, tmp_path):
    law, striker = fi.Contact.linear(1e5), fi.Striker.rigid(0.05)
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=20)
    with caplog.at_level(logging.INFO, logger="fem_impact"):
        templates.write_scene(tmp_path / "beam.toml", "beam")
        fi.load_scene(tmp_path / "beam.toml").strike(tolerance=1e-1)
        fi.sweep(plate, striker, law, at=(0.4, 0.3), speed=1.0, over={"mass": [0.01, 0.02]}, tolerance=1e-1)
        hits = fi.strokes(plate, [(0.0, striker, law, (0.4, 0.3), 1.0)], tolerance=0.5)
        fi.sound.radiate_free(hits, (0.8, 0.5, 2.0), duration=0.01)
        system = fi.assemble(fi.mesh.line(0.3), fi.Beam.circular(fi.Material(E=1e10, nu=0.3, rho=700.0), diameter=0.01))
        fi.find_modes(system, n_modes=3)
    said = [(record.name, record.getMessage()) for record in caplog.records]
    assert any(name == "fem_impact.model.target" and text.startswith("modes: ") for name, text in said)
    assert ("fem_impact.sweeps.cases", "2 blows at the tolerance 0.1") in said
    assert ("fem_impact.model.playing", f"stroke 0 at 0 s: {hits.n_impacts} impacts") in said
    assert any(name == "fem_impact.modes.free_air" and "modes, on cells of 0.0" in text for name, text in said)
    assert any(name == "fem_impact.modes.finding" and text.startswith("3 modes up to ") for name, text in said)
    assert capsys.readouterr() == ("", "")


def test_nobody_hears_the_log_unless_they_listen():
    assert any(isinstance(handler, logging.NullHandler) for handler in logging.getLogger("fem_impact").handlers)
