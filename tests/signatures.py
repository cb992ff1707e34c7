"""One valid call of every public function, what spoils an argument, and the judge of what then happens.

A call passes where it gives a result whose numbers are finite, or one error of the package that names the argument.
"""

import dataclasses
import dis
import inspect
import math
import re
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from fuzz import PACKAGE, Hang, limited
from scenes import QUICK

import fem_impact as fi
from fem_impact.mesh.loops import Outline, circle
from fem_impact.scenes import results

PATIENCE = 30.0  # [s] per call: thrice what is promised, as other work may run beside
LONGEST = 700  # [-] characters of a message

# Called by the package with what it has checked or made, not by users: plumbing, and results.
INNER = {
    "Response", "Impact", "Scene", "Plan", "SimulationError",  # made by strike, load_scene and plan
    "Scene.blame", "Scene.heard_from", "Scene.kept", "Modes.point", "sound.beside", "mesh.aligned", "mesh.pierced",
     "Scene.body", "Scene.closed_form", "Scene.fault", "Scene.finder", "Scene.make_contact",
    "Scene.make_section", "Scene.make_striker", "Scene.data", "Scene.alone", "Scene.check_single",
    "Scene.check_unpushed",
    "Modes.to_pyvista", "Modes.descriptions",  # no arguments
    "Gradient", "Gradient.change", "Response.band_spectrum",  # made by Response.gradient; its arguments are any words
    "Plan.data", "Plan.run", "Plan.strike", "Response.body_slice", "Response.summary", "Scene.picture",
    "mesh.Mesh", "mesh.Mesh.line", "mesh.Mesh.pieces", "mesh.straight", "mesh.fill", "Modes.points",
    "Modes.stretched",
    "export.plain", "export.versions", "export.csv_text", "export.run_data", "export.vtk_ending", "figures.snapshot",
    "figures.in_hertz", "figures.styled", "sound.Sound",
    "hammers.Hammer", "hammers.bandwidth_of", "hammers.impacts_of_tips", "hammers.falls", "hammers.half_sine_reach",
    "lesson.write", "lesson.Written", "lesson.Written.data", "lesson.Written.summary",  # many blows, see test_lesson
    "explore.serve",  # ends at an interruption only, see test_explore
    "ToleranceWarning", "analytic.closed_form", "Striker.let_go",
    "Rib.distances", "Rib.rigidity", "Rib.turning",
    "Taps", "Taps.summary",  # made by read_taps and Taps.from_arrays
    "pictures.gallery", "pictures.film", "pictures.encode", "pictures.frames_at", "slow_motion.Caption",
    "slow_motion.subtitles", "slow_motion.write", "figures.chladni", "hammers.choose_on",
    "Modes", "sound.Sound.audible", "sound.Sound.normalised", "sound.Sound.faded", "sound.Sound.wav",
    "hammers.Hammer.data",
}  # fmt: skip


def everything() -> dict[str, Callable[..., Any]]:
    """Every function, constructor and method by the name a user types after ``fi.``."""
    found: dict[str, Callable[..., Any]] = {}
    seen: set[int] = set()

    def add(name: str, item: Any) -> None:
        if id(item) in seen or not (inspect.isclass(item) or inspect.isfunction(item)):
            return
        seen.add(id(item))
        found[name] = item
        if inspect.isclass(item) and not issubclass(item, Exception):
            own = [each for each in reversed(item.__mro__) if each.__module__.startswith(fi.__name__)]
            for key in dict.fromkeys(key for each in own for key in vars(each)):
                inner = inspect.getattr_static(item, key)
                if not key.startswith("_") and isinstance(inner, (classmethod, staticmethod, type(add))):
                    found[f"{name}.{key}"] = getattr(item, key)

    homes = {name: getattr(fi, name) for name in fi.__all__}
    for name, item in homes.items():
        add(name, item)
    for name, home in homes.items():
        if inspect.ismodule(home):
            for key, item in inspect.getmembers(home):
                own = f"{getattr(item, '__module__', '')}.".startswith(f"{home.__name__}.")
                if not key.startswith("_") and (own or key in getattr(home, "__all__", ())):
                    add(f"{name}.{key}", item)
    return found


def public() -> dict[str, Callable[..., Any]]:
    """Those that users call."""
    return {name: item for name, item in everything().items() if name not in INNER}


@cache
def things() -> dict[str, Any]:
    """What calls need, made once."""
    metal = fi.Material(E=70e9, nu=0.3, rho=2700.0)
    plate = fi.Plate(metal, 2e-3)
    beam = fi.Beam.rectangular(metal, width=0.02, height=0.01)
    square = fi.mesh.rectangle(0.4, 0.3, size=0.2)
    modes = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=12)
    striker, law = fi.Striker.rigid(0.03), fi.Contact.hertz(1e6)
    folder = Path(tempfile.mkdtemp())
    path = folder / "scene.toml"
    path.write_text(QUICK)
    scene = fi.load_scene(path)
    several = folder / "sequence.toml"
    several.write_text(f"{QUICK}[[stroke]]\nwhen = 0.0\n")
    known = folder / "known.toml"
    known.write_text(QUICK.replace("mass = 0.03", "mass = { value = 0.03, about = 0.1 }"))
    uff = folder / "modes.uff"
    fi.export.write_uff(uff, modes)
    mesh = folder / "plate.msh"
    fi.mesh.save(mesh, square)
    tip = fi.collide([fi.Modes.rigid(0.03)], [fi.Touch(law, 0, None)], speeds=[1.0], tolerance=1e-2)
    taps = fi.measure(tip, rate=25600.0, duration=5e-3)
    taps.save(folder / "taps.npz")
    bar = fi.Modes.from_arrays([100.0, 300.0], [[1.0, 0.5]], points=[[0.0]], mass=1.0)
    few = fi.sweep(
        modes, striker, law, at=(0.1, 0.1), speed=1.0, over={"mass": [0.02, 0.03], "speed": [1.0, 2.0]},
        tolerance=1e-2, borders=True,
    )  # fmt: skip
    run = scene.run()
    results.save_response(folder, run.response, scene.points, fi.export.run_data(run, scene.data()))
    frequency = np.arange(1.0, 301.0)
    H = fi.mobility(bar.damped(0.02), [0.0], [0.0], frequency, "accelerance")
    responses = xarray.Dataset(
        {"H": (("frequency", "channel"), H[:, None])},
        {"frequency": frequency, "channel": ["a"], "units": ("channel", ["m/s^2/N"])},
    )
    corners = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.2, 0.0)]
    known_body = {"frequencies": [110.0], "shapes": np.ones((3, 3, 1)), "nodes": corners, "mass": 1.0,
        "damping_ratio": 0.01, "numbers": [1, 2, 3], "cells": [[0, 1, 2]], "normals": [[0.0, 0.0, 1.0]] * 3,
        "names": {"corner": 1}, "static": np.full((3, 3, 1), 1e-5), "loads": [(1, (0.0, 0.0, 1.0))]}  # fmt: skip
    triangle = fi.Body(**known_body)
    triangle.save(folder / "body")
    return {
        "body": known_body, "triangle": triangle,
        "rung": fi.strike(
            triangle.modes("z", free=False), striker, fi.Contact.linear(1e4), at=triangle.at(1), speed=0.2,
            tolerance=1.0),
        "map": few, "taps": taps, "responses": responses, "file of taps": folder / "taps.npz", "bar": bar,
        "metal": metal, "plate": plate, "beam": beam, "square": square, "modes": modes, "striker": striker, "law": law,
        "sphere": fi.Striker.sphere(metal, 0.01), "free": fi.Modes.rigid(1.0), "folder": folder, "path": path,
        "system": fi.assemble(square, plate, {"boundary": "hinged"}), "scene": scene, "uff": uff, "mesh": mesh,
        "sequence": fi.load_scene(several), "known": fi.load_scene(known),
        "tone": fi.sound.Sound(np.ones(100), 8000, 1.0),
        "bar hit": fi.strike(
            fi.analytic.beam(0.4, ends=("free", "free"), mass=0.2, first_frequency=100.0, n_modes=12), striker, law,
            at=0.15, speed=1.0, tolerance=1e-2,
        ),
        "hit": fi.strike(modes, striker, law, at=(0.13, 0.1), speed=1.0, tolerance=1e-2),
        "outline": Outline.around(circle((0.0, 0.0), 1.0, "rim")),
        "plan": scene.plan(), "run": scene.run(target="modal"),
        "spread": fi.spread(scene, {"striker.mass": "lognormal(0.03, 0.1)"}, n=8, tolerance=1e-1),
    }  # fmt: skip


@cache
def table() -> dict[str, dict[str, Any]]:
    """Arguments of valid calls of every public function; a word after its name tells apart several of one.

    The first call of each has all its parameters, with their defaults where nothing is stated.
    """
    functions, calls = public(), stated()
    for name in calls.keys() & functions.keys():
        defaults = {one.name: one.default for one in inspect.signature(functions[name]).parameters.values()
                    if one.default is not one.empty and (name, one.name) not in UNCHECKED}  # fmt: skip
        calls[name] = defaults | calls[name]
    return calls


UNCHECKED = {  # a fact of strikers made elsewhere, an address for dask, and what goes with no loss: "yields" has it
    ("Striker", "fixed"), ("Scene.modes", "elastic"), ("matched", "which"), ("sweep", "client"), ("spread", "client"),
    ("Contact.between", "yield_strength"),
}  # fmt: skip


def alike(names: str, arguments: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The same arguments for several."""
    return dict.fromkeys(names.split(), arguments)


def stated() -> dict[str, dict[str, Any]]:
    """What is not by default in these calls."""
    t = things()
    at, body = (0.13, 0.1), {"mass": 0.2, "first_frequency": 100.0, "n_modes": 5}
    blow = {"modes": t["modes"], "striker": t["striker"], "contact": t["law"], "at": at, "speed": 1.0}
    told = {"striker": t["striker"], "contact": t["law"], "at": at, "speed": 1.0}
    told |= {"tolerance": 1e-1, "damping_ratio": 0.01}
    hit = {"response": t["hit"]}
    written = {"modes": t["modes"], "response": t["hit"], "times": [0.0, 1e-3]}
    folder = t["folder"]
    return {
        "Material": {"E": 1e9, "nu": 0.3, "rho": 450.0, "E_across": 0.9e9, "G": 0.5e9, "angle": 0.1},
        "Material.orthotropic": {"E_along": 1e9, "E_across": 9e8, "nu": 0.3, "G": 4e8, "rho": 450.0, "angle": 0.1},
        "Plate": {"material": t["metal"], "thickness": 2e-3},
        "Plate.laminate": {"layers": [(t["metal"], 1e-3, 0.0), (t["metal"], 2e-3, 0.5)]},
        **alike("Plate.stiffness Plate.inertia Plate.shear Plate.rotary Plate.walls", {"self": t["plate"],
            "points": np.zeros((2, 2))}),
        "Rib": {"path": [(0.1, 0.0), (0.1, 0.3)], "section": t["beam"], "offset": 1e-3},
        "rise.cap": {"radius": 2.0, "centre": (0.1, 0.1)},
        **alike("rise.cylinder rise.saddle", {"radius": 2.0, "angle": 0.1, "centre": (0.1, 0.1)}),
        "rise.cymbal": {"radius": 0.2, "bow": 0.01, "cup_radius": 0.05, "cup": 0.01},
        "rise.table": {"points": [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)], "heights": [0.0, 0.0, 0.0, 0.1]},
        **alike("Beam Beam.rectangular", {"material": t["metal"], "width": 0.02, "height": 0.01}),
        "Beam.circular": {"material": t["metal"], "diameter": 0.01},
        **alike("Beam.stiffness Beam.inertia Beam.shear Beam.rotary Beam.torsion", {"self": t["beam"],
            "points": np.zeros((2, 1))}),
        "Elastic": {"stiffness": 1e4, "rotation": 1.0},
        "Contact": {"stiffness": 1e6, "exponent": 1.5, "loss": 0.1, "gap": 1e-4},
        **alike("Contact.linear Contact.hertz", {"stiffness": 1e6, "loss": 0.1, "gap": 1e-4}),
        "Contact.power": {"stiffness": 1e6, "exponent": 2.0, "loss": 0.1, "gap": 1e-4},
        "Contact.restituting": {"stiffness": 1e6, "exponent": 1.5, "restitution": 0.8, "speed": 1.0, "gap": 1e-4},
        "Contact.between": {"sphere": t["sphere"], "plate": t["plate"], "loss": 0.1, "gap": 1e-4},
        "Contact.between yields": {"sphere": t["sphere"], "plate": t["plate"], "yield_strength": 1e9, "gap": 1e-4},
        "Contact.layers": {"stiffness": 1e5, "exponent": 1.2, "depth": 1e-3, "hard_stiffness": 1e8, "loss": 0.1,
            "gap": 1e-4},
        "Contact.elastic_plastic": {"stiffness": 1e8, "yield_speed": 0.1, "mass": 0.1, "gap": 1e-4},
        "Contact.elastic_plastic by approach": {"stiffness": 1e8, "yield_approach": 1e-5},
        "Contact.of": {"force": lambda d: 1e6 * d**1.5, "deepest": 1e-2, "gap": 1e-4},
        "Contact.felt": {"stiffness": 1e8, "exponent": 2.0, "hysteresis": 0.5, "relaxation": 1e-3, "gap": 1e-4},
        "Contact.force": {"self": t["law"], "approach": [1e-4, 2e-4], "rate": 0.1},
        "assemble": {"mesh": t["square"], "section": t["plate"], "supports": {"boundary": "hinged"},
            "element": "argyris", "point_masses": [((0.1, 0.1), 0.01)], "point_supports": [((0.2, 0.2), "hinged")],
            "near": [(0.1, 0.1)]},
        "in_air": {"modes": t["modes"], "density": 1.2, "speed": 343.0, "sides": 1, "baffled": False},
        "ritz_modes": {"system": t["system"], "points": [at], "max_frequency": 2e3, "n_vectors": 20,
            "damping_ratio": 0.01},
        "Response.on": {"self": t["hit"], "modes": t["modes"]},
        "Body": t["body"],
        "Body.load": {"files": t["folder"] / "body.npz", "mass": 1.0, "loads": [(1, (0.0, 0.0, 1.0))],
            "damping_ratio": 0.01, "modal_mass": [1.0], "names": {"a": 1}, "normals": [[0.0, 0.0, 1.0]] * 3},
        "Body.from_matrices": {"mass": np.diag([0.1, 0.3]), "stiffness": [[1e4, -1e4], [-1e4, 1e4]],
            "nodes": [(0.0, 0.0, 0.0), (0.2, 0.0, 0.0)], "dofs": [(1, 1), (2, 1)], "total_mass": 0.4,
            "recovery": np.eye(6)[:, [0, 3]], "loads": [(1, (1.0, 0.0, 0.0))], "n_modes": 2},
        "Body.save": {"self": t["triangle"], "path": t["folder"] / "again"},
        **alike("Body.node Body.at", {"self": t["triangle"], "where": 1}),
        "Body.along": {"self": t["triangle"], "where": 1, "direction": "z"},
        "Body.modes": {"self": t["triangle"], "direction": (0.0, 0.0, 1.0), "free": False},
        "Body.way": {"self": t["triangle"], "where": 1, "direction": (0.0, 0.0, 1.0)},
        "Body.rigid": {"mass": 1.0, "inertia": 1e-3, "nodes": np.eye(3), "centre": (0.0, 0.0, 0.0)},
        "Body.freed": {"self": t["triangle"], "inertia": 1e-3, "centre": (0.0, 0.0, 0.0)},
        "Body.displacement": {"self": t["triangle"], "q": [[1.0]], "where": [(0.0, 0.0, 0.0)]},
        "Modes.from_arrays": {"frequencies": [0.0, 10.0], "shapes": [[1.0, 0.5], [1.0, -0.5]],
            "points": [[0.0, 0.0], [0.1, 0.1]], "mass": 1.0, "damping_ratio": 0.01,
            "compliance": [[1e-3, 0.0], [0.0, 1e-3]], "cells": [[0, 1, 1]], "free": False, "loads": [0, 1]},
        "Modes.from_frf": {"frf": t["responses"], "mass": 1.0, "points": [[0.0]], "driving": 0, "frequencies": [100.0],
            "free": False},
        "Modes.from_uff": {"path": t["uff"], "mass": 0.2, "free": False},
        "Modes.rigid": {"mass": 1.0},
        **alike("Modes.shape_at Modes.modal_compliance Modes.residual_compliance", {"self": t["modes"],
            "points": [at]}),
        "Modes.rigid_motion": {"self": t["free"], "at": None},
        "Modes.scaled": {"self": t["modes"], "mass": 0.3, "first_frequency": 50.0},
        "Modes.truncated": {"self": t["modes"], "max_frequency": 1e3, "n_modes": 3},
        "Modes.damped": {"self": t["modes"], "damping_ratio": 0.01},
        "find_modes": {"system": t["system"], "n_modes": 4, "damping_ratio": 0.01, "tolerance": 1e-2},
        "find_modes bounds": {"system": t["system"], "max_frequency": 3e2, "bounds": True, "keep": None},
        "assemble beam": {"mesh": fi.mesh.line(1.0, size=0.25), "section": t["beam"],
            "supports": {"left": fi.Elastic(1e4, 1.0)}, "element": None, "point_masses": [(0.5, 0.1)]},
        "analytic.rectangle section": {"length": 0.4, "width": 0.3, "section": t["plate"], "max_frequency": 1e3,
            "damping_ratio": 0.01},
        "analytic.beam section": {"length": 0.4, "ends": ("free", "clamped"), "section": t["beam"],
            "max_frequency": 1e3},
        "analytic.disk section": {"radius": 0.4, "edge": "free", "section": t["plate"], "max_frequency": 5e2},
        "strike free": {**blow, "tolerance": 1e-2, "quantity": "spectrum=2000", "residual": True},
        "strike stick": {**blow, "striker": fi.Striker.stick(0.03, 1e3, n_modes=3),
            "contact": fi.Contact.hertz(1e6, loss=0.1), "tolerance": 1e-2},
        "collide states": {"bodies": [t["free"], t["modes"]], "contacts": [fi.Touch(t["law"], 0, 1, None, at)],
            "speeds": None, "states": [([0.0], [1.0]), (np.zeros(12), np.zeros(12))], "tolerance": 1e-2,
            "duration": 0.1},
        "sweep cells": {**blow, "over": {"at": [at]}, "tolerance": 1e-1,
            "layers": {"peak": lambda hit: hit.peak_force}, "store": None, "max_cells": 100.0},
        "rayleigh": {"mass_factor": 1.0, "stiffness_factor": 1e-6},
        "Striker": {"modes": t["free"], "at": np.zeros(0), "material": t["metal"], "radius": 0.01},
        "Striker.rigid": {"mass": 0.03},
        "Striker.sphere": {"material": t["metal"], "radius": 0.01},
        "Striker.stick": {"mass": 0.1, "first_frequency": 1e3, "n_modes": 3},
        "Striker.hammer": {"head": 0.03, "handle": 0.05, "stiffness": 1e4, "damping": 2.0},
        "Hand": {"stiffness": 100.0, "damping": 0.1, "force": 1.0},
        "Striker.of": {"body": fi.Body.rigid(1.0, 1e-3, 0.1 * np.eye(3)), "where": 1, "direction": (0.0, 0.0, 1.0),
                       "along": (0.1, 0.0, 1.0), "material": t["metal"], "radius": 0.01},
        "Striker.turning": {"mass": 1.0, "inertia": 1e-3, "arm": (0.01, 0.02), "pivot": (-0.2, 0.0)},
        "Striker.held": {"self": t["striker"], "hand": fi.Hand(100.0)},
        "Striker.flexible": {"modes": t["free"], "at": None},
        **alike("Response.displacement Response.velocity Response.motion_error", {"self": t["hit"], "points": [at],
            "times": [0.0, 1e-3]}),
        **alike("Response.modal_state Response.modal_energy", {"self": t["hit"], "times": [0.0, 1e-3]}),
        "Response.to_xarray": {"self": t["hit"], "points": [at], "times": [0.0, 1e-3], "max_frequency": 5e3},
        "Response.spectral_centroid": {"self": t["hit"], "max_frequency": 5e3},
        "Response.spectrum": {"self": t["hit"], "frequencies": [0.0, 1e3]},
        "mobility": {"modes": t["modes"], "at": at, "to": (0.2, 0.2), "frequencies": [50.0, 60.0]},
        "mobility points": {"modes": t["modes"], "at": [at, (0.2, 0.2)], "to": [at], "frequencies": [50.0],
            "quantity": "receptance"},
        "spectra.half_sine_spectrum": {"frequencies": [50.0, 60.0], "contact_frequency": 100.0},
        "threshold_frequency": {"modes": t["modes"], "at": at, "mass": 0.03},
        "threshold.thresholds": {"modes": t["modes"], "at": at, "masses": [0.01, 0.03]},
        "threshold.required_energy": {"modes": t["modes"], "at": at, "contact_frequency": 500.0},
        "strike system": {"modes": t["system"], **told, "size": 0.08, "n_modes": 12, "strict": False},
        "strike system band": {"modes": t["system"], **told, "target": "modal", "max_frequency": 2e3},
        "strike": {**blow, "tolerance": 1e-2, "quantity": "restitution", "residual": True, "duration": 0.1,
            "max_impacts": 3, "scheme": "A4", "dt": 1e-5, "striker_force": 0.0, "target_force": 0.0},
        "collide": {"bodies": [t["free"], t["free"]], "contacts": [fi.Touch(t["law"], 0, 1)], "speeds": [1.0, 0.0],
            "tolerance": 1e-2, "duration": 0.1, "max_impacts": 3, "scheme": "A4", "dt": 1e-5, "forces": [0.0, 0.0]},
        "strike moving": {**blow, "speed": 0.5, "tolerance": 1e-1, "start": t["hit"].state(0.05)},
        "collide moving": {"bodies": [t["free"], t["free"]], "contacts": [fi.Touch(t["law"], 0, 1)], "tolerance": 1e-1,
            "start": fi.collide([t["free"]] * 2, [fi.Touch(t["law"], 0, 1)], speeds=[1.0, 0.0], tolerance=1e-1)},
        "Response.against": {"self": t["hit"], "measured": {"contact_time": (1e-3, 1e-4)}},
        "figures.against": {"found": t["hit"].against({"contact_time": 1e-3})},
        "Response.state": {"self": t["hit"], "time": 1e-3},
        "Response.gradient": {"self": t["hit"], "quantity": "impulse", "wrt": ("striker.mass", "contact.stiffness")},
        "strokes": {"modes": t["modes"], "strokes": [(0.0, t["striker"], t["law"], at, 1.0, 0.1)], "tolerance": 1e-1,
            "duration": 1.0, "start": t["hit"].state(0.05)},
        "Scene.changed": {"self": t["scene"], "values": {"contact.stiffness": 2e6}},
        "Scene.modes": {"self": t["scene"], "count": 5},
        **alike("Scene.play Scene.plan_strokes Scene.run_strokes", {"self": t["sequence"], "tolerance": 1e-1}),
        "Scene.plan": {"self": t["scene"], "tolerance": 1e-1},
        "Scene.run": {"self": t["scene"], "tolerance": 0.1},
        "Scene.strike": {"self": t["scene"], "tolerance": 1e-1, "speed": 1.0, "at": at},
        **alike("load_scene report.read", {"path": t["path"]}),
        "load_response": {"folder": t["folder"]},
        "plan": {"scene": t["scene"], "tolerance": 1e-1},
        "verify": {"names": "two-masses", "watch": None},
        "plan system": {"scene": t["system"], **told, "target": "modal", "n_striker_modes": 1, "watch": None},
        "plan modes": {"scene": t["modes"], **told, "n_modes": 10},
        "Plan.but": {"self": t["plan"], "tolerance": 1e-1, "target": "modal", "n_modes": 10},
        "sweep": {**blow, "over": {"mass": [0.02, 0.03]}, "tolerance": 1e-1, "max_frequency": 1e3, "workers": 1,
            "max_cells": 100.0, "borders": False, "cells": 3, "refine": False},
        "sweep ranges": {**blow,
            "over": {"mass": {"from": 0.02, "to": 0.03}, "speed": {"from": 1.0, "to": 2.0, "scale": "log"}},
            "tolerance": 1e-1, "max_frequency": 1e3, "workers": 1, "cells": 3, "refine": True, "borders": True},
        "read_borders": {"table": t["map"]},
        "yield_strength": {"hardness": 300.0}, "Striker.dropped": {"self": t["sphere"], "height": 0.3},
        "Striker.falling": {"self": t["sphere"], "gravity": 9.8},
        "spread": {"scene": t["scene"], "vary": {"striker.mass": ("lognormal", 0.03, 0.1)}, "n": 8, "sobol": False,
            "seed": 1, "tolerance": 1e-1, "max_frequency": 1e3, "workers": 1, "max_blows": 100.0},
        "spread body": {"scene": t["modes"], "vary": {"mass": "lognormal(0.03, 0.1)", "speed": "uniform(1, 2)"},
            "n": 8, "striker": t["striker"], "contact": t["law"], "at": at, "speed": 1.0, "damping_ratio": 0.01,
            "correlation": {("mass", "speed"): 0.5}, "tolerance": 1e-1, "max_blows": 100.0},
        "band": {"scene": t["known"], "n": 8, "seed": 1, "tolerance": 1e-1},
        "design": {"objects": t["path"], "wanted": {"contact_time": (1e-6, 1.0)},
            "free": {"striker.mass": (0.02, 0.05)}, "least": "striker.mass", "start": {"striker.mass": 0.03},
            "tolerance": 1e-2, "n_modes": 5},
        "tune": {"body": fi.assemble(fi.mesh.line(0.35), t["beam"]), "pitches": {1: "-20 cents"}, "match": "order",
            "depth": 2e-3, "radius": 0.04, "mirror": "x", "patches": 4, "tolerance": 2.0},
        "figures.edges": {"mesh": t["square"]},
        "figures.spread": {"found": t["spread"]},
        "mesh.Mesh.refined": {"self": t["square"]},
        "mesh.rectangle": {"length": 0.4, "width": 0.3, "size": 0.2},
        "mesh.line": {"length": 0.4, "size": 0.2},
        "mesh.disk": {"radius": 0.4, "hole": 0.1, "size": 0.2},
        "mesh.polygon": {"corners": [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)],
            "holes": [[(0.2, 0.2), (0.3, 0.2), (0.2, 0.3)]], "size": 0.3},
        "mesh.outline": {"source": [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], "size": 0.3, "unit": "m"},
        "mesh.load": {"path": t["mesh"], "unit": "m"},
        "mesh.save": {"path": folder / "saved.msh", "mesh": t["square"]},
        "Touch": {"law": t["law"], "first": 0, "second": None, "first_at": at},
        "analytic.rectangle": {"length": 0.4, "width": 0.3, **body, "damping_ratio": 0.01},
        "analytic.beam": {"length": 0.4, **body, "damping_ratio": 0.01},
        "analytic.disk": {"radius": 0.4, "nu": 0.3, **body, "damping_ratio": 0.01},
        "export.write_vtk": {"path": folder / "motion.pvd", **written},
        "export.write_animation": {"path": folder / "mode.pvd", "modes": t["modes"], "mode": 1, "frames": 3},
        "export.write_uff": {"path": folder / "shapes.uff", "modes": t["modes"]},
        "export.write_wav": {"path": folder / "hit.wav", **hit, "at": at, "duration": 0.01},
        "export.write_sound": {"path": folder / "tone.wav", "heard": t["tone"]},
        "export.write_history": {"path": folder / "force.op4", **hit, "times": [0.0, 1e-4, 2e-4], "at": [at],
            "node": 7, "direction": "-z", "numbers": [3]},
        "export.write_force": {"path": folder / "force.csv", **hit},
        "export.write_json": {"path": folder / "data.json", "data": {"a": 1.0}},
        **alike("export.numbers figures.energies figures.mode_energies", hit),
        "figures.save": {"path": folder / "force.png", "figure": fi.figures.energies(t["hit"])},
        "figures.force": {**hit, "band": (10.0, 1e3)},
        **alike("pictures.chladni figures.mode_shapes", {"modes": t["modes"], "count": 2, "columns": 2}),
        "figures.mobility": {"modes": t["modes"], "at": at, "to": at, "band": (10.0, 1e3)},
        "sound.of_node": {"response": t["rung"], "body": t["triangle"], "where": 1, "direction": "z", "duration": 0.01,
                          "rate": 8000},
        "sound.synthesise": {**hit, "at": at, "duration": 0.01, "rate": 8000},
        "sound.together": {"sounds": [t["tone"], t["tone"]]},
        **alike("sound.radiate sound.radiate_free", {**hit, "listener": (0.1, 0.1, 1.0), "duration": 0.01,
            "rate": 8000, "air": (1.2, 343.0)}),
        "sound.radiate_bar": {"response": t["bar hit"], "listener": (0.1, 0.1, 1.0), "width": 0.02, "height": 0.01,
            "duration": 0.01, "rate": 8000, "air": (1.2, 343.0)},
        **alike("hammers.highest_frequency hammers.choose", {"modes": t["modes"], "at": at, "bandwidth": 300.0,
            "masses": [0.1]}),
        "plan_test": {"system": t["modes"], "hammers": {"a": (0.1, {"soft": 1e3})}, "points": [at], "bandwidth": 30.0,
            "sensor": at, "duration": 1.0},
        "read_taps": {"path": t["file of taps"], "force": "force", "response": (), "rate": 25600.0, "scale": 1.0,
            "units": {"force": "N"}, "trigger": 1.0, "before": 5e-4, "length": 2e-3, "full_scale": 1e6},
        "Taps.from_arrays": {"force": t["taps"].force, "response": t["taps"].force, "rate": 25600.0, "names": ["a"],
            "units": ["m/s^2"], "overload": False, "labels": ["one"]},
        "Taps.pick": {"self": t["taps"], "which": 0},
        "Taps.cut_off": {"self": t["taps"], "tap": 0},
        "Taps.between": {"self": t["taps"], "start": 0.0, "end": 2e-3},
        "Taps.save": {"self": t["taps"], "path": folder / "saved.npz"},
        "measure": {"hit": t["hit"], "rate": 8000.0, "at": [at], "anti_alias": (4, 3e3), "tip_mass": 1e-3,
            "resonance": 20e3, "noise": 0.01, "bits": 16, "full_scale": 1e5, "duration": 0.02, "rng": 1},
        "frf": {"records": fi.Taps.from_arrays(t["taps"].force, t["taps"].force, rate=25600.0), "force_window": 2e-3,
            "response_window": 1e-2, "n_times": 64},
        "mac": {"first": [[1.0, 1.0], [1.0, -1.0]], "second": [[1.0], [0.5]]},
        "matched": {"measured": [100.0], "computed": [99.0, 150.0]},
        "matched shapes": {"measured": t["bar"], "computed": t["bar"], "points": [[0.0]]},
        "fit": {"taps": t["taps"], "target": t["bar"], "at": [0.0], "striker": t["striker"], "contact": t["law"],
            "unknown": {"contact.stiffness": (1e5, 1e8)}, "known": {"striker.mass": 0.03}, "window": (3e-4, 3e-3),
            "starts": 1, "profiles": False},
        "propose": {"taps": [t["taps"], t["taps"]], "striker": t["striker"], "starts": 1, "profiles": False},
        "update": {"build": lambda values: t["bar"].scaled(first_frequency=values["f"]), "measured": [110.0, 330.0],
            "unknown": {"f": (50.0, 200.0)}, "start": {"f": 90.0}},
        "update scene": {"build": t["scene"], "measured": [110.0, 330.0],
            "unknown": {"target.first_frequency": (50.0, 200.0)}, "start": None, "points": None},
        "report.numbers": {"scene": t["scene"], "run": t["run"]},
        "report.write": {"path": folder / "report.html", "scene": t["scene"], "run": t["run"]},
        "pictures.mode_shapes": {"path": folder / "modes.png", "modes": t["modes"], "count": 2, "columns": 2},
        "pictures.wave": {"path": folder / "wave.png", **hit, "time": 1e-3},
        "slow_motion.captions": hit,
        "pictures.animation": {"path": folder / "wave.gif", **hit, "frames": 2},
    }  # fmt: skip


SPOILS: dict[str, Any] = {
    "None": None, "True": True, "word": "word", "empty": "", "list": [], "dict": {}, "object": object(), "1j": 1j,
    "nan": math.nan, "inf": math.inf, "-inf": -math.inf, "-1": -1.0, "int -1": -1, "0": 0.0, "int 0": 0,
    "tiny": 1e-300, "denormal": 5e-324, "huge": 1e300, "great": 1e75, "slight": 1e-75, "great int": 10**30,
    "billion": 10**9, "million": 10**6, "small": 1e-20, "most": sys.float_info.max, "huge int": 10**400,
    "large int": 10**12, "bytes": b"bytes", "type": int, "no numbers": np.empty(0), "no points": np.empty((0, 2)),
    "cube": np.zeros((3, 3, 3)), "words": np.array(["a", "b"]), "objects": np.array([object(), None]),
    "nans": [math.nan, math.nan], "ragged": [[1.0], [1.0, 2.0]],
    "complexes": np.array([1j, 2.0]), "infs": [math.inf] * 2,
    "hugest": [1e308, 1e308], "none": [None, None], "nul": "a\0b", "long": "é" * 5000, "set": {1.0, 2.0},
    "boolean": np.array([True, False]), "point far": (1e9, 1e9),
    "generator": range(3), "dates": np.array(["2020"], "M8[Y]"),
    "function": lambda *_: None, "nan function": lambda x: np.full(len(np.atleast_1d(x)), np.nan),
    "odd keys": {None: 1.0, 3: "x"}, "one key": {"mass": [math.nan]}, "class instance": Counter(),
    "surrogate": "\ud800.toml",
}  # fmt: skip


FUNCTIONS = ("function", "nan function", "type")  # what these do where a function is wanted is up to them
CALLED = ("watch", "before", "tell", "ready", "build")


def cases() -> Iterator[tuple[str, str, str]]:
    """Call, parameter and spoil of every spoiled call."""
    for name, arguments in table().items():
        for parameter in (each for each in arguments if each != "self"):
            spoils = [spoil for spoil in SPOILS if parameter not in CALLED or spoil not in FUNCTIONS]
            yield from ((name, parameter, spoil) for spoil in spoils)


INFINITE = {"threshold_frequency", "threshold.thresholds", "mobility", "Response.motion_error"}  # documented to
ENDLESS = {"order", "point_supports", "sensitivity"}  # fields documented to be infinite now and then
OTHER_NAMES = {  # parameter: words under which an error may speak of it besides its own name
    **dict.fromkeys(("length", "width", "radius", "factor", "corners", "hole"), ("size", "outline", "max_frequency")),
    **dict.fromkeys(("frequencies", "points"), ("shapes",)),
    **dict.fromkeys(("striker_force", "target_force"), ("forces",)),
    "E_along": ("nu",),
    "speed": ("loss", "max_frequency"),
}


def call(name: str, **changes: Any) -> Any:
    """Call a public function validly but for the changes."""
    function = public()[name.partition(" ")[0]]
    arguments = {**table()[name], **changes}
    return function(arguments.pop("self"), **arguments) if "self" in arguments else function(**arguments)


def judged(name: str, changes: Mapping[str, Any]) -> str:
    """'' where a call gives a result or one clear error, else what is wrong."""
    try:
        with limited(PATIENCE), warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", fi.ToleranceWarning)  # it says what it is for
            result = call(name, **changes)
            broken = not_finite(result)
            return f"result holds {broken}" if broken and name.partition(" ")[0] not in INFINITE else ""
    except (ValueError, TypeError, OSError, fi.SimulationError) as error:
        text = str(error)
        where = origin(error)
        if not raised_by_package(error):
            return f"bare {type(error).__name__} from {where}: {text:.150}"
        if not text.isprintable() or len(text) > LONGEST:
            return f"unclear: {type(error).__name__} from {where}: {text!r:.200}"
        words = [word for parameter in changes for word in (parameter, *OTHER_NAMES.get(parameter, ()))]
        named = any(re.search(rf"\b{re.escape(word)}\b", text) for word in words) or getattr(error, "filename", None)
        if not named and not isinstance(error, fi.SimulationError) and not said(changes, text):
            return f"does not name {', '.join(changes)}: {type(error).__name__} from {where}: {text:.150}"
        return ""
    except (Exception, Hang) as error:
        return f"{type(error).__name__} from {origin(error)}: {error!s:.150}"


def said(changes: Mapping[str, Any], text: str) -> bool:
    """Whether an error quotes a text that was passed, as one does with the name of a file."""
    return any(isinstance(value, str) and value and value in text for value in changes.values())


def origin(error: BaseException) -> str:
    """The last line of the package that an error came through."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename.startswith(PACKAGE)]
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "outside"


def raised_by_package(error: BaseException) -> bool:
    """Whether the statement that raised it is a ``raise`` of the package, not a library's or the interpreter's."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    if trace is None or not trace.tb_frame.f_code.co_filename.startswith(PACKAGE):
        return isinstance(error, OSError)  # the system's own words name the file
    code = trace.tb_frame.f_code.co_code
    return dis.opname[code[trace.tb_lasti]] in ("RAISE_VARARGS", "RERAISE")


def not_finite(value: Any, name: str = "", depth: int = 3) -> str:
    """Name and value of the first number in a result that is not finite; '' where all are."""
    if isinstance(value, (float, complex, np.floating, np.complexfloating)):
        return "" if np.isfinite(value) else f"{name} = {value}"
    if isinstance(value, np.ndarray):
        whole = value.dtype.kind not in "fc" or np.isfinite(value).all()
        return "" if whole else f"{name} with {value[~np.isfinite(value)].ravel()[0]}"
    if isinstance(value, (list, tuple, Mapping)):
        items = value.items() if isinstance(value, Mapping) else enumerate(value)
        return next((b for k, x in items if (b := not_finite(x, f"{name}.{k}", depth))), "")
    if dataclasses.is_dataclass(value) and not isinstance(value, type) and depth:
        fields = (f.name for f in dataclasses.fields(value) if f.name not in ENDLESS and f.name[0] != "_")
        return next((b for k in fields if (b := not_finite(getattr(value, k), f"{name}.{k}", depth - 1))), "")
    return ""
