"""A missed tolerance is loud everywhere, and what the message advises meets it."""

import json
import re
from dataclasses import replace

import pytest
from scenes import QUICK, load_text

import fem_impact as fi
from fem_impact.cli import main

PLATE = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 2e-3)
SIZE = 0.26, 0.21  # [m] 295 g
AT, HAMMER = (0.1, 0.07), fi.Striker.rigid(0.1)
HARD, SOFT = fi.Contact.hertz(1e9), fi.Contact.linear(1e5)


def plate(n_modes):
    return fi.analytic.rectangle(*SIZE, section=PLATE, n_modes=n_modes)


def meshed(edges, size=0.04):
    return fi.assemble(fi.mesh.rectangle(*SIZE, size=size), PLATE, {"boundary": edges})


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("law", [HARD, SOFT, fi.Contact.hertz(1e8, loss=0.2)])
@pytest.mark.parametrize("n_modes", [10, 40])
def test_the_modes_advised_meet_the_tolerance(n_modes, law, tolerance):
    how = {"at": AT, "speed": 1.0, "tolerance": tolerance}
    hit = fi.strike(plate(n_modes), HAMMER, law, **how)
    assert hit.tolerance_met == (hit.error.total <= tolerance)
    if hit.tolerance_met:
        assert hit.promise.startswith(f"tolerance {tolerance:g} met: estimated error") and "restitution" in hit.promise
        return
    assert hit.promise.startswith(f"tolerance {tolerance:g} MISSED: ")
    needed = int(re.search(rf"keep (\d+) modes of the target instead of {n_modes}", hit.promise)[1])
    assert fi.strike(plate(needed), HAMMER, law, **how, strict=True).tolerance_met


BLOW = {"at": AT, "speed": 1.0, "tolerance": 1e-6}


def collided(_=None, **how):
    bodies, touch = [fi.Modes.rigid(0.1), plate(10)], fi.Touch(SOFT, 0, 1, None, AT)
    return fi.collide(bodies, [touch], speeds=[1.0, 0.0], tolerance=1e-6, **how)


def test_a_miss_warns_and_strict_raises():
    with pytest.warns(fi.ToleranceWarning, match="tolerance 1e-06 MISSED: .*; keep .* modes") as found:
        hit = fi.strike(plate(10), HAMMER, SOFT, **BLOW)
    assert found[0].filename == __file__  # the warning names the user's line
    assert str(found[0].message).startswith(hit.promise) and not hit.tolerance_met and not hit.trusted
    first = hit.summary().splitlines()[0]
    assert first == hit.verdict and re.match(r"restitution [\d.]+: ", first) and f": {hit.promise}" in first
    assert hit.promise.split(";")[0] in hit._repr_html_()
    assert fi.export.numbers(hit)["response"]["tolerance_met"] is False
    for strict in (lambda: fi.strike(plate(10), HAMMER, SOFT, **BLOW, strict=True), lambda: collided(strict=True)):
        with pytest.raises(fi.SimulationError, match="MISSED"):
            strict()
    assert issubclass(fi.ToleranceWarning, UserWarning)


WAYS = {  # every way to strike; each lambda is the user's line
    "strike modes": lambda _: fi.strike(plate(10), HAMMER, SOFT, **BLOW),
    "strike with a piece of the plan": lambda _: fi.strike(plate(100), HAMMER, SOFT, n_modes=10, **BLOW),
    "strike a system": lambda _: fi.strike(meshed("hinged"), HAMMER, SOFT, n_modes=10, **BLOW),
    "plan": lambda _: fi.plan(plate(10), HAMMER, SOFT, **BLOW).strike(),
    "scene": lambda folder: load_text(folder, QUICK).strike(tolerance=1e-6, n_modes=5),
    "plan of a scene": lambda folder: fi.plan(load_text(folder, QUICK), tolerance=1e-6, n_modes=5).strike(),
    "collide": collided,
}


@pytest.mark.parametrize("way", WAYS)
def test_the_warning_names_the_users_line(way, tmp_path):
    with pytest.warns(fi.ToleranceWarning, match="MISSED") as found:
        WAYS[way](tmp_path)
    code = WAYS[way].__code__
    (line,) = [each.lineno for each in found if each.filename == __file__]
    assert line in {number for _, _, number in code.co_lines()}


def test_a_step_of_ones_own_is_blamed():
    with pytest.warns(fi.ToleranceWarning, match=r"mostly from time steps .*leave dt"):
        fi.strike(plate(300), HAMMER, SOFT, at=AT, speed=1.0, tolerance=1e-6, dt=5e-5)
    for better in ({}, {"dt": 2e-6}):
        hit = fi.strike(plate(300), HAMMER, SOFT, at=AT, speed=1.0, tolerance=1e-6, **better)
        assert hit.error.step <= 0.4 * hit.tolerance and "leave dt" not in hit.promise


def test_errors_that_miss_only_together_propose_a_tolerance_that_is_met():
    hit = fi.strike(plate(300), HAMMER, SOFT, at=AT, speed=1.0, tolerance=1e-3)
    part = 0.39 * hit.tolerance
    missed = replace(hit, error=replace(hit.error, step=part, truncation=part, mesh=part))
    met = float(re.search(r"; take a tolerance of (\S+)$", missed.promise)[1])
    assert not missed.tolerance_met and replace(missed, tolerance=met).tolerance_met


def test_impacts_that_cannot_be_told_leave_the_first_one():
    """No tolerance above 1 exists; error 1 means that two descriptions of the body touch another number of times."""
    system, blow = meshed("hinged", None), {"at": AT, "speed": 1.0, "tolerance": 1e-2}
    hit = fi.strike(system, HAMMER, SOFT, **blow)
    unsure = replace(hit, error=replace(hit.error, truncation=1.0))
    assert unsure.promise.endswith(
        "; the number of impacts cannot be determined: give max_impacts = 1 for the first impact alone"
    )
    assert fi.strike(system, HAMMER, SOFT, max_impacts=1, strict=True, **blow).tolerance_met


def test_an_infinite_plate_that_echoes_is_told_to_be_modal():
    system, blow = meshed("clamped", None), {"at": AT, "speed": 1.0, "tolerance": 1e-2}
    with pytest.warns(fi.ToleranceWarning, match="give target = 'modal'"):
        fi.strike(system, HAMMER, SOFT, target="infinite", **blow)
    assert fi.strike(system, HAMMER, SOFT, target="modal", strict=True, **blow).tolerance_met


@pytest.mark.parametrize("stiffness, tolerance", [(1e11, 1e-3), (1e10, 1e-6)])
def test_a_contact_that_needs_too_many_modes_is_told_to_be_softer(stiffness, tolerance):
    hard, soft = (
        fi.strike(plate(40), HAMMER, fi.Contact.hertz(k), at=AT, speed=1.0, tolerance=tolerance).promise
        for k in (stiffness, 1e-4 * stiffness)
    )
    assert re.search(r"would have to keep some \S+ modes; take a softer contact$", hard)
    assert re.search(r"keep \d+ modes|tolerance \S+ met", soft)


def test_a_coarse_mesh_is_blamed_and_the_advice_works():
    """A clamped plate: hinged, a few triangles are nearly exact."""
    coarse, soft = fi.find_modes(meshed("clamped", 0.06), n_modes=30), fi.Contact.linear(2e4)
    hit = fi.strike(coarse, HAMMER, soft, at=AT, speed=1.0, tolerance=1e-3)
    assert hit.error.dominant[0] == "the finite elements"
    limit = float(re.search(r"find the modes of the target with tolerance = ([\d.e-]+)", hit.promise)[1])
    fine = fi.find_modes(meshed("clamped", None), n_modes=30, tolerance=limit)
    assert fi.strike(fine, HAMMER, soft, at=AT, speed=1.0, tolerance=1e-3, strict=True).tolerance_met


@pytest.mark.parametrize(
    "law, tolerance",
    [(fi.Contact.hertz(1e8), 1e-3), (SOFT, 1e-2), pytest.param(fi.Contact.hertz(1e8), 1e-4, marks=pytest.mark.slow)],
)
def test_a_planner_left_alone_meets_the_tolerance(law, tolerance):
    system = fi.assemble(fi.mesh.rectangle(*SIZE), PLATE, {"left": "clamped", "right": "hinged"})
    plan = fi.plan(system, HAMMER, law, at=AT, speed=1.0, tolerance=tolerance)
    assert plan.meets and str(plan).startswith(f"tolerance {tolerance:g} of restitution, ")
    assert plan.strike(strict=True).tolerance_met


def test_a_plan_says_beforehand_that_it_will_miss():
    plan = fi.plan(plate(300), HAMMER, SOFT, at=AT, speed=1.0, tolerance=1e-4, n_modes=12)
    assert not plan.meets and "will be MISSED: predicted error" in str(plan).splitlines()[0]
    with pytest.raises(fi.SimulationError, match=r"keep .* modes of the target instead of 12"):
        plan.strike(strict=True)


def test_the_prompt_writes_everything_and_exits_with_3(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(QUICK)
    command = ["strike", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out"), "--tolerance", "1e-6"]
    assert main([*command, "--n-modes", "5"]) == 3
    printed = " ".join(capsys.readouterr().out.split())
    assert "tolerance 1e-06 MISSED" in printed and "instead of 5" in printed
    told = json.loads((tmp_path / "out" / "response.json").read_text())["response"]
    assert told["tolerance_met"] is False and "MISSED" in told["verdict"]
    assert main([*command, "--n-modes", "5", "--strict"]) == 1
    assert "MISSED" in capsys.readouterr().err
