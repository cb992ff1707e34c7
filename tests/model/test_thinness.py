from dataclasses import replace

import numpy as np
import pytest
import thick_references as thick
from comparing import examined

import fem_impact as fi
from fem_impact.model import bending, thinness

E, NU, RHO = 210e9, 0.3, 7850.0
STEEL = fi.Material(E=E, nu=NU, rho=RHO)
SIDES = 0.3, 0.2


def found(hit, name="thin target"):
    return examined(hit, name)


def thick_modes(modes, h, at):
    """The same hinged plate by Mindlin's theory, at one point; its shapes have their rotary inertia."""
    omega = np.maximum.accumulate(thick.wang(modes.omega, h, E, NU, RHO))  # equal ones differ by rounding
    squared = modes.omega * np.sqrt(12.0 * RHO * (1.0 - NU**2) / E) / h
    turned = 1.0 - RHO * omega**2 / (thick.KAPPA * E / (2.0 * (1.0 + NU)) * squared)
    shape = modes.shape_at(at) / np.sqrt(1.0 + h**2 / 12.0 * squared * turned**2)
    return fi.Modes.from_arrays(omega / (2.0 * np.pi), shape, points=[at], mass=modes.mass, complete=True)


def blow(modes, mass, stiffness, at, residual=False):
    law = fi.Contact.hertz(stiffness)
    return fi.strike(modes, fi.Striker.rigid(mass), law, at=at, speed=1.0, tolerance=1e-6, residual=residual)


def true_effect(h, mass, stiffness, at, n_modes=250):
    plate = fi.analytic.rectangle(*SIDES, section=fi.Plate(STEEL, h), n_modes=n_modes)
    thin, other = (blow(modes, mass, stiffness, at) for modes in (plate, thick_modes(plate, h, at)))
    true = {"restitution": abs(other.restitution - thin.restitution)}
    for name, key in (("impulse", "impulse"), ("contact_time", "contact_time"), ("force", "peak_force")):
        true[name] = abs(getattr(other, key) / getattr(thin, key) - 1.0)
    return thin, other, true


@pytest.mark.parametrize("seed", range(12))
def test_effect_of_thickness_on_random_blows_is_that_of_mindlins_plate(seed):
    rng = np.random.default_rng(seed)
    h, mass = np.exp(rng.uniform(np.log([1e-3, 3e-3]), np.log([3e-2, 0.1])))
    at = (rng.uniform(0.2, 0.5) * SIDES[0], rng.uniform(0.2, 0.5) * SIDES[1])
    time = np.exp(rng.uniform(np.log(5e-5), np.log(5e-4)))  # [s] about the contact's
    thin, other, true = true_effect(h, mass, mass / time**2.5 * 3.0, at)
    effect = found(thin).effect
    for name, size in true.items():
        if thin.n_impacts != other.n_impacts:
            assert max(effect.values()) > 0.01  # one touch more: that it matters is all an estimate can say
        elif size < 0.2:
            assert 0.33 * size - 1e-5 <= effect[name] <= 3.0 * size + 1e-5  # 1e-5: difference of two runs at 1e-6
        else:
            assert effect[name] > 0.1


def test_a_thick_block_speaks_up_about_its_thickness():
    block = fi.analytic.rectangle(0.1, 0.1, section=fi.Plate(STEEL, 0.05), n_modes=50)
    hit = blow(block, 0.1, 1e9, (0.05, 0.05), residual=True)
    told = found(hit)
    assert told.value > 2.0 and told.doubtful and told.known
    assert told.worst < 1e-3  # so stiff a block hardly moves, thick or thin
    assert "thin target: thickness times wavenumber is 2.2; above 0.23 it matters" in hit.summary()
    assert "take a thick plate" in hit.summary()


def test_a_thick_high_mode_that_the_blow_hardly_excites_matters_little():
    plate = fi.analytic.rectangle(*SIDES, section=fi.Plate(STEEL, 0.01), n_modes=300)
    soft, hard = (blow(plate, 0.05, stiffness, (0.12, 0.09), residual=True) for stiffness in (1e6, 3e10))
    assert found(soft).value < 0.5 * found(hard).value
    assert found(soft).worst < 0.1 * found(hard).worst


def test_a_beam_of_a_marimba_is_examined_too():
    bar = fi.Beam.rectangular(STEEL, width=0.03, height=0.02)
    exact = []
    for shear in (False, True):
        modes = fi.analytic.beam(0.3, ends=("free", "free"), section=bar, n_modes=14)
        if shear:
            area, inertia = 0.03 * 0.02, 0.03 * 0.02**3 / 12.0
            kGA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * E / (2.0 * (1.0 + NU)) * area
            omega = thick.timoshenko(0.3, E * inertia, RHO * area, RHO * inertia, kGA, ("free", "free"), 12)
            frequencies = np.concatenate([np.zeros(2), omega]) / (2.0 * np.pi)
            shapes = modes.shape_at([0.15])
            modes = fi.Modes.from_arrays(frequencies, shapes, points=[(0.15,)], mass=modes.mass, complete=True)
        exact.append(blow(modes, 0.1, 3e9, 0.15))
    true = abs(exact[1].peak_force / exact[0].peak_force - 1.0)
    assert true > 1e-3
    assert 0.33 * true < found(exact[0]).effect["force"] < 3.0 * true


def test_a_striker_whose_bending_matters_and_whose_thickness_is_not_known_says_so():
    plate = fi.analytic.rectangle(*SIDES, section=fi.Plate(STEEL, 0.003), n_modes=100)
    stick = fi.Striker.stick(mass=0.05, first_frequency=500.0)
    hit = fi.strike(plate, stick, fi.Contact.hertz(1e8), at=(0.1, 0.1), speed=1.0, tolerance=1e-3)
    told = found(hit, "thin striker")
    assert told.state == "not known" and told.value is None and "thickness of the striker" in told.sentence


def test_a_bar_that_strikes_has_its_own_thickness():
    wood = fi.Material(E=12e9, nu=0.3, rho=600.0)
    rod = fi.analytic.beam(0.4, ends=("hinged", "free"), section=fi.Beam.circular(wood, diameter=0.03), n_modes=20)
    plate = fi.analytic.rectangle(*SIDES, section=fi.Plate(STEEL, 0.003), n_modes=100)
    hit = fi.strike(plate, fi.Striker.flexible(rod, at=0.4), fi.Contact.hertz(1e9), at=(0.1, 0.1), speed=1.0)
    told = found(hit, "thin striker")
    assert told.known and 0.1 < told.value < 3.0 and told.worst > 1e-4


@pytest.mark.parametrize("modes", ["scaled", "measured"])
def test_what_is_not_known_is_not_known(modes):
    plate = fi.analytic.rectangle(*SIDES, mass=0.2, first_frequency=100.0, n_modes=60)
    if modes == "measured":
        plate = fi.Modes.from_arrays(
            plate.frequencies, plate.shape_at([(0.1, 0.1)]), points=[(0.1, 0.1)], mass=0.2, complete=True
        )
    told = found(fi.strike(plate, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), at=(0.1, 0.1), speed=1.0))
    assert told.state == "not known" and set(told.effect.values()) == {None}


def by_both_theories(body, material, mass, stiffness):
    """A blow on a hinged plate or beam by the thin theory and by the thick one, which has no doubt of it any more."""
    plate = body == "plate"
    section = fi.Plate(material, 0.01) if plate else fi.Beam.rectangular(material, width=0.03, height=0.02)
    mesh = fi.mesh.rectangle(*SIDES, size=0.1) if plate else fi.mesh.line(0.3)
    supports = {"boundary": "hinged"} if plate else {"left": "hinged", "right": "hinged"}
    systems = [fi.assemble(mesh, section, supports, theory=theory) for theory in (None, THEORY[body])]
    at = (0.12, 0.09) if plate else 0.12
    thin, better = (blow(fi.find_modes(system, n_modes=12), mass, stiffness, at) for system in systems)
    told = found(better)
    assert told.value is None and told.known and told.worst == 0.0 and not told.remedy
    return thin, better


THEORY = {"plate": "mindlin", "beam": "timoshenko"}
WOOD = fi.Material.orthotropic(E_along=11e9, E_across=0.8e9, nu=0.37, G=0.7e9, rho=430.0)
ROLLING = {"plate": {"G_xz": 0.6e9, "G_yz": 0.035e9, "angle": 0.3}, "beam": {"G_xz": 0.1e9}}


@pytest.mark.parametrize("body", THEORY)
def test_what_a_thick_theory_changes_was_foretold(body):
    thin, better = by_both_theories(body, STEEL, 0.1, 3e8)
    true = abs(better.contact_time / thin.contact_time - 1.0)
    assert true / 3.0 < found(thin).effect["contact_time"] < 3.0 * true


@pytest.mark.parametrize("rolling", [False, True], ids=["in the plane", "rolling"])
@pytest.mark.parametrize("body", THEORY)
def test_wood_is_as_soft_in_shear_to_the_audit_as_to_the_thick_theory(body, rolling):
    """Shear moduli through the thickness count where they are stated, else that in the plane, for both."""
    wood = replace(WOOD, **ROLLING[body]) if rolling else WOOD
    thin, better = by_both_theories(body, wood, 0.02, {"plate": 3e6, "beam": 3e7}[body])
    effect = found(thin).effect
    for name, key in (("impulse", "impulse"), ("contact_time", "contact_time"), ("force", "peak_force")):
        true = abs(getattr(better, key) / getattr(thin, key) - 1.0)
        assert true / 3.0 < effect[name] < 3.0 * true  # with rolling shear that was not stated, up to 5 times


def test_a_stick_that_is_told_slender_or_stout_has_its_shear_and_a_hammer_has_none():
    plate = fi.analytic.rectangle(*SIDES, section=fi.Plate(STEEL, 0.003), n_modes=60)
    stick = fi.Striker.stick(mass=0.05, first_frequency=500.0, slenderness=20.0)
    for striker in (stick, fi.Striker.hammer(head=0.03, handle=0.06, stiffness=2e4, damping=5.0)):
        hit = fi.strike(plate, striker, fi.Contact.hertz(1e8), at=(0.1, 0.1), speed=1.0, tolerance=1e-2)
        assert found(hit, "thin striker").known and found(hit, "thin striker").worst == 0.0


def test_waves_are_a_hundredth_too_fast_at_the_limit():
    """Mindlin's plate to second order in h k: rotation adds 1 / 12, shear 1 / (5 (1 - nu)), each to 1 / omega**2."""
    assert pytest.approx(0.01, rel=0.05) == 0.5 * (1.0 / 12.0 + 0.2 / (1.0 - 0.3)) * thinness.TARGET.limit**2


@pytest.mark.parametrize(("at", "change"), [((0.04, 0.03), 2.9e-3), ((0.0, 0.0), 2.6e-2), ((0.05, 0.05), 0.0)])
def test_a_block_that_turns_has_its_rotary_inertia(at, change):
    """The thick theory has it in its rigid motions; nothing else changes the restitution of so small a block."""
    section, law = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), thickness=0.05), fi.Contact.hertz(1e9)
    thin, thick = (
        fi.strike(
            fi.find_modes(fi.assemble(fi.mesh.rectangle(0.1, 0.1, size=0.05), section, theory=theory), n_modes=10),
            fi.Striker.rigid(0.05), law, at=at, speed=1.0, tolerance=1e-2,
        )
        for theory in ("kirchhoff", "mindlin")
    )  # fmt: skip
    moved = abs(thick.restitution - thin.restitution)
    assert moved == pytest.approx(change, rel=0.05, abs=1e-4)
    assert found(thin).effect["restitution"] == pytest.approx(moved, rel=0.05, abs=1e-5)


def test_a_bar_that_turns_has_its_rotary_inertia():
    """By formula: at the end of a free bar, turning adds 3 / (1 + h**2 / length**2) to the mobility 1 / mass."""
    bar = fi.Beam.rectangular(fi.Material(E=210e9, nu=0.3, rho=7850.0), width=0.03, height=0.06)
    modes = fi.analytic.beam(0.2, ends=("free", "free"), section=bar, n_modes=6)
    rows = bending.integrate_shapes(bending.known_of(modes)).heavier(modes.shape_at([0.0]))[0, :2]
    assert (rows**2).sum() * modes.mass == pytest.approx(1.0 + 3.0 / (1.0 + 0.3**2), rel=1e-9)
