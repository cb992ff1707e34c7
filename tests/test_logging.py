"""The library prints nothing: what it does is logged under the name of the package, silently unless asked for."""

import logging

import fem_impact as fi
from fem_impact.scenes import templates


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
