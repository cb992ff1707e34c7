"""The library prints nothing: what it does is logged under the name of the package, silently unless asked for."""

import ast
import logging
from pathlib import Path

import fem_impact as fi
from fem_impact.scenes import templates

HOME = Path(__file__).parents[1] / "fem_impact"
SPEAKERS = {"cli.py", "canvas.py"}  # the prompt, and a process whose output its parent reads


def test_stages_and_maps_are_logged_under_the_name_of_the_package(caplog, capsys, tmp_path):
    law, striker = fi.Contact.linear(1e5), fi.Striker.rigid(0.05)
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=20)
    with caplog.at_level(logging.INFO, logger="fem_impact"):
        templates.write(tmp_path / "beam.toml", "beam")
        fi.load_scene(tmp_path / "beam.toml").strike(tolerance=1e-1)
        fi.sweep(plate, striker, law, at=(0.4, 0.3), speed=1.0, over={"mass": [0.01, 0.02]}, tolerance=1e-1)
    said = [(record.name, record.getMessage()) for record in caplog.records]
    assert any(name == "fem_impact.model.target" and text.startswith("modes: ") for name, text in said)
    assert ("fem_impact.sweeps.grid", "2 blows at the tolerance 0.1") in said
    assert capsys.readouterr() == ("", "")


def test_nobody_hears_the_log_unless_they_listen():
    assert any(isinstance(handler, logging.NullHandler) for handler in logging.getLogger("fem_impact").handlers)


def test_only_the_prompt_prints():
    for path in HOME.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        prints = [call for call in calls if isinstance(call.func, ast.Name) and call.func.id == "print"]
        assert not prints or path.name in SPEAKERS, path
