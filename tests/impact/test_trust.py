"""What is said first is about the answer: its value, what the computation and what the model does to it."""

import json

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.impact import assumption, distance

ALLOY = fi.Material(E=70e9, nu=0.33, rho=2700.0)


def blow(thickness=1e-3, speed=0.5, n_modes=200, law=fi.Contact.hertz(1e6), **how):  # noqa: B008  (a law is frozen)
    section = fi.Plate(ALLOY, thickness)
    sheet = fi.analytic.rectangle(0.6, 0.4, section=section, n_modes=n_modes, damping_ratio=0.01)
    return fi.strike(sheet, fi.Striker.rigid(0.05), law, at=(0.2, 0.15), speed=speed, tolerance=1e-3, **how)


def test_a_clean_answer_says_how_far_both_errors_reach():
    hit = blow(thickness=4e-3)
    assert hit.trusted and hit.trust.trusted and all(each.remedy == "" for each in hit.trust)
    own = hit.error.of_quantity("restitution")
    answer, rest = hit.verdict.split(", ", 1)
    digits = len(answer.split(".")[1])
    assert abs(float(answer.removeprefix("restitution ")) - hit.restitution) <= 0.5 * 10.0 ** -(digits - 1e-6)
    assert rest == (
        f"computed to {own:.1g} (tolerance 0.001 met); the model holds to {hit.model_error:.1g}, "
        "with the contact as stated"
    )
    assert hit.model_verdict[0] in hit.verdict and hit.summary().splitlines()[0] == hit.verdict


def test_a_wrong_model_is_said_beside_a_tolerance_that_is_met():
    hit = blow()
    told = hit.trust["restitution"]
    assert hit.tolerance_met and not hit.trusted and not told.trusted
    assert told.value == hit.restitution and told.computation == hit.error.of_quantity("restitution") <= hit.tolerance
    assert told.dominant == "small deflections" and told.remedy.startswith("let it stretch, stretching = true")
    effects = [each.effect["restitution"] or 0.0 for each in hit.assumptions]
    assert told.model == told.known == pytest.approx(sum(effects)) and told.model > told.allowed == assumption.ENOUGH
    assert "(tolerance 0.001 met), but the model is wrong here" in hit.verdict
    assert "times the thickness, which changes the restitution by about 0.0" in hit.verdict


@pytest.mark.parametrize("seed", range(8))
def test_every_quantity_has_an_error_of_its_own(seed):
    """Of 300 such blows 2 % of the errors of peak forces were below the truth, by a factor of 1.6 at most."""
    rng = np.random.default_rng(seed)
    sheet = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=400)
    law, mass = fi.Contact.hertz(10 ** rng.uniform(5, 7)), fi.Striker.rigid(10 ** rng.uniform(-2.5, -1.0))
    hit, true = (fi.strike(sheet, mass, law, at=(0.45, 0.3), speed=1.0, tolerance=x) for x in (1e-3, 1e-6))
    apart = distance.of_blows(hit, true, hit.quantities)
    for name, error in apart.items():
        assert error <= 2.0 * hit.error.of_quantity(name) <= 2.0 * hit.error.total
    assert len({hit.error.of_quantity(name) for name in apart}) > 1 and set(hit.error.parts("force")) == {
        "time steps", "modes left out", "the finite elements", "the simplified target", "the blow before",
        "the measured responses",
    }  # fmt: skip


def test_both_misses_are_said_and_the_larger_one_dominates():
    hit = blow(speed=2.0, n_modes=40)
    assert not hit.tolerance_met and not hit.trusted
    assert f": {hit.promise}; besides, the model is wrong here" in hit.verdict
    assert hit.trust["restitution"].dominant == "small deflections"
    assert "keep " in hit.trust["restitution"].remedy and "stretching = true" in hit.trust["restitution"].remedy


def test_quantities_are_judged_one_by_one_with_units_and_bands():
    hit = blow(quantity=("force", "n_impacts", "spectrum=2000", "contact_time"))
    names = ["peak force", "number of impacts", "spectrum to 2000 Hz", "contact time"]
    assert [each.name for each in hit.trust] == names
    assert hit.verdict.startswith(f"peak force {hit.trust['force'].shown}, computed to")
    assert hit.trust["force"].shown.endswith(" N") and hit.trust["n_impacts"].shown == str(hit.n_impacts)
    assert hit.trust["spectrum"].value == pytest.approx(hit.impulse, rel=0.3)  # at 0 Hz, where it is nearly largest
    lines = str(hit.trust).splitlines()
    assert len(lines) >= 5 and lines[0].split()[:2] == ["quantity", "value"]
    with pytest.raises(ValueError, match=r"quantity must be one of those asked for, force, .*, got 'restitution'"):
        hit.trust["restitution"]


def test_blows_of_several_bodies_say_that_nobody_examined_the_model():
    balls, touch = [fi.Modes.rigid(0.1), fi.Modes.rigid(0.2)], fi.Touch(fi.Contact.hertz(1e8), 0, 1)
    hit = fi.collide(balls, [touch], speeds=(1.0, 0.0))
    assert hit.tolerance_met and not hit.trusted and hit.model_error == 0.0
    assert {each.state for each in hit.assumptions} == {"not known"} and "Model" not in hit.summary()
    assert hit.verdict.endswith(
        "but the model is not examined, as several bodies meet: examine each pair by `fi.strike`"
    )


def test_programs_read_the_same():
    hit = blow()
    told = json.loads(json.dumps(fi.export.plain(fi.export.numbers(hit)["response"])))
    assert told["verdict"] == hit.verdict and told["trusted"] is False and told["tolerance_met"] is True
    row = told["trust"][0]
    assert row["quantity"] == "restitution" and row["model"] == pytest.approx(hit.trust["restitution"].model)
    assert hit.to_xarray().attrs["trusted"] == 0
