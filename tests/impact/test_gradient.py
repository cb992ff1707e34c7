"""`hit.gradient` against central differences and closed forms, and where it refuses."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_studies import study

import fem_impact as fi

grazing = study("gradient_grazing")
claims = study("gradient_claims")  # random blows and what is told of them, on which both are judged
STEP, BAND, QUANTITIES = claims.STEP, claims.BAND, claims.QUANTITIES
random_numbers, strike = claims.random_numbers, claims.strike
GRAZING = 1.20025666  # [-] times the target's mass of the first family of `gradient_grazing`: where its impact is lost


def told(hit, frequencies):
    """The quantities as numbers, the largest force as in the response."""
    found = claims.told(hit, frequencies)
    assert_allclose(found[3], hit.peak_force, rtol=1e-7)
    return found


def compare(seed):
    """Slopes of a random blow along a random change of all its numbers, by gradient and by differences.

    Returns them relative to the sum of the parts that each number contributes, and how far differences of steps one to
    two disagree; None where the blow has no impact or more than three, no gradient, or cannot be run so finely.
    """
    rng = np.random.default_rng(seed)
    numbers = random_numbers(rng)
    try:
        hit = strike(numbers)
        if not 1 <= hit.n_impacts <= 3:
            return None
        slopes = hit.gradient(QUANTITIES)
        names = slopes["impulse"].names
        turn = dict(zip(names, rng.uniform(-1.0, 1.0, len(names))))
        frequencies = hit.band_spectrum(BAND)[0]

        def value(step):
            changed = {name: numbers[name] * (1.0 + step * part) for name, part in turn.items()}
            other = strike(numbers | changed)
            if other.n_impacts != hit.n_impacts:
                raise fi.SimulationError("no difference: another impact within the step")
            return told(other, frequencies)

        near, far = ([value(-size), value(size)] for size in (STEP, 2.0 * STEP))
    except fi.SimulationError:
        return None
    near, far = (near[1] - near[0]) / (2.0 * STEP), (far[1] - far[0]) / (4.0 * STEP)
    parts = np.array([[slopes[name][other] * numbers[other] * turn[other] for other in names] for name in slopes])
    scale = np.abs(parts).sum(axis=1)
    return (
        parts.sum(axis=1) / scale,
        (4.0 * near - far) / (3.0 * scale),
        np.abs(near - far) / scale,
        numbers["contact.loss"] > 0.0,
    )


def check_seeds(seeds):
    """Compare blows; how many had a gradient."""
    n = 0
    for seed in seeds:
        found = compare(seed)
        if found is None:
            continue
        slopes, differences, doubt, lossy = found
        message = f"seed {seed}, {QUANTITIES}"
        # each blow has steps of its own, so that differences err, too: the worst of 200 blows is off by 2.3e-6
        off = np.abs(slopes - differences)
        assert (off[:4] <= 1e-5 + doubt[:4]).all(), f"{message}: off by {off}, doubt {doubt}"
        # the magnitude of a spectrum has corners at its zeros, which differences of finite steps run over
        assert abs(slopes[5] - differences[5]) <= 5e-5 + 2.0 * doubt[5], message
        # a lossy force rings with every mode, so that its peak is early or late by up to 1e-7 of the blow in either run
        late = 1e-3 if lossy else 1e-6
        assert abs(slopes[4] - differences[4]) <= late + 2.0 * doubt[4], message
        n += 1
    return n


def test_gradients_of_some_blows_are_central_differences():
    assert check_seeds(range(3)) == 3


@pytest.mark.slow
def test_gradients_are_central_differences():
    assert check_seeds(range(3, 14)) >= 6


@pytest.mark.slow
@pytest.mark.thin(13)
@pytest.mark.parametrize("first", range(100, 700, 25))
def test_gradients_of_many_blows_are_central_differences(first):
    assert check_seeds(range(first, first + 25)) >= 11


def ball(law, *, mass=0.2, speed=1.3, tolerance=1e-8, **blow):
    """A mass on a target so heavy that it is a wall."""
    return fi.strike(
        fi.Modes.rigid(1e12), fi.Striker.rigid(mass), law, at=None, speed=speed, tolerance=tolerance, **blow
    )


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
def test_ball_on_a_wall_has_the_powers_of_its_closed_form(exponent):
    """Contact time as m**q k**-q v**((1-a) q), peak force as k**q (m v**2)**(a q), q = 1 / (a + 1); impulse 2 m v."""
    q = 1.0 / (exponent + 1.0)
    slopes = ball(fi.Contact.power(1e6, exponent)).gradient(
        ("contact_time", "peak_time", "peak_force", "impulse", "restitution"),
        wrt=("striker.mass", "contact.stiffness", "strike.speed"),
    )
    time = [q, -q, (1.0 - exponent) * q]
    # 1e-8 was asked of the blow; a mass of 1e12 kg is a wall to 2e-13
    assert_allclose(slopes["contact_time"].relative, time, rtol=0, atol=1e-7)
    assert_allclose(slopes["peak_time"].relative, time, rtol=0, atol=1e-6)  # the peak is flat
    assert_allclose(slopes["peak_force"].relative, [exponent * q, q, 2.0 * exponent * q], rtol=0, atol=1e-7)
    assert_allclose(slopes["impulse"].relative, [1.0, 0.0, 1.0], rtol=0, atol=1e-7)
    assert_allclose(slopes["restitution"].relative, 0.0, rtol=0, atol=1e-7)


def test_restitution_falls_with_loss_as_hunt_and_crossley_have_it():
    """``L (1 + e) = ln((1 + L) / (1 - e L))`` with L = loss speed, for any mass, stiffness and exponent."""
    loss, speed = 0.3, 1.3
    found = ball(fi.Contact.hertz(1e6, loss=loss), speed=speed).gradient("restitution")
    e, number = found.value, loss * speed
    by_number = (1.0 + e) - 1.0 / (1.0 + number) - e / (1.0 - e * number)
    by_e = number - number / (1.0 - e * number)
    assert_allclose(found["contact.loss"], -by_number / by_e * speed, rtol=1e-6)
    assert_allclose(found["strike.speed"], -by_number / by_e * loss, rtol=1e-6)
    for name in ("striker.mass", "contact.stiffness", "contact.exponent"):
        assert abs(found.relative[found.names.index(name)]) < 1e-6


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_errors_of_slopes_are_of_the_size_they_say(tolerance):
    numbers = random_numbers(np.random.default_rng(12))
    numbers["contact.loss"] = 0.0
    names = ("striker.mass", "contact.stiffness", "strike.x", "target.mass", "strike.speed")
    truth, rough = (strike(numbers, each).gradient(QUANTITIES[:4], names) for each in (1e-9, tolerance))
    for name, found in rough.items():
        wrong = np.abs(found.slopes - truth[name].slopes).max()
        scale = np.abs(truth[name].slopes).max()
        assert wrong <= 3.0 * found.error.max() + 1e-8 * scale, name
        assert found.error.max() <= 50.0 * tolerance * scale, name


def test_the_peak_is_that_of_the_motion_and_not_of_the_steps():
    """Seed 184: at a border that two runs share, the polynomials of the force on both sides straddle its peak.

    They share the first step of the contact, too, in which a linear law's slope in its exponent goes as a logarithm.
    """
    numbers = random_numbers(np.random.default_rng(184))
    rough, fine = (strike(numbers, tolerance).gradient("peak_time") for tolerance in (1e-8, 1e-10))
    scale = np.abs(fine.slopes * fine.numbers).sum()
    off = np.abs((rough.slopes - fine.slopes) * fine.numbers).sum() / scale
    assert off <= 5e-9  # 1e-9, the least error that is stated, was measured; 4e-5 with the peak of the polynomials
    assert off <= 3.0 * ((rough.error + fine.error) * np.abs(fine.numbers)).sum() / scale


def test_two_maxima_alike_are_refused_though_a_step_holds_both():
    """Seed 2: the lossy force rings within its steps, and its ends alone would not show the rival."""
    numbers = random_numbers(np.random.default_rng(2))
    with pytest.raises(fi.SimulationError, match="two maxima differ by"):
        strike(numbers, 1e-4).gradient("peak_force")


def test_gradients_of_layers_are_differences_of_blows():
    """A soft layer over a hard one, pressed beyond its depth."""
    numbers = {"stiffness": 1e5, "exponent": 1.3, "depth": 2e-4, "hard_stiffness": 1e8, "hard_exponent": 1.5}

    def blow(**changed):
        both = numbers | changed
        law = fi.Contact.layers(both.pop("stiffness"), both.pop("exponent"), **both)
        return ball(law, mass=0.01, tolerance=1e-9)

    found = blow().gradient(("contact_time", "peak_force"))
    for name, value in numbers.items():
        sides = [blow(**{name: value * (1.0 + side * 1e-4)}) for side in (-1.0, 1.0)]
        for quantity, slopes in found.items():
            change = (getattr(sides[1], quantity) - getattr(sides[0], quantity)) / 2e-4
            # differences of second order of blows told to 1e-9
            assert_allclose(slopes[f"contact.{name}"] * value, change, atol=2e-5 * slopes.value, err_msg=name)


def test_energy_left_in_modes_adds_up():
    numbers = random_numbers(np.random.default_rng(4)) | {"contact.loss": 0.0, "target.damping_ratio": 0.0}
    numbers["striker.first_frequency"] = 1e6  # does not bend: all energy is the striker's motion, or in the plate
    hit = strike(numbers, 1e-9)
    found = hit.gradient(("modal_energy", "restitution"), wrt=("strike.speed", "target.mass"))
    assert found["modal_energy"].slopes.shape == (2, 20)
    assert_allclose(found["modal_energy"].value, hit.modal_energy([hit.history.end_time])[0], rtol=1e-9)
    mass, e = numbers["striker.mass"] / 3.0, hit.restitution
    start = np.array([mass * hit.speed, 0.0])  # of the energy at the start in speed and in the target's mass
    left = start * e**2 + mass * hit.speed**2 * e * found["restitution"].slopes
    assert_allclose(found["modal_energy"].slopes.sum(axis=1), start - left, rtol=1e-6)


def test_body_numbers_are_those_of_a_rebuilt_body():
    numbers = {"thickness": 3e-3, "E": 70e9, "rho": 2700.0, "scale": 1.0}

    def blow(thickness, E, rho, scale):
        section = fi.Plate(fi.Material(E=E, nu=0.33, rho=rho), thickness)
        plate = fi.analytic.rectangle(0.5 * scale, 0.35 * scale, section=section, n_modes=25)
        at = (0.2 * scale, 0.1 * scale)
        return fi.strike(plate, fi.Striker.rigid(0.05), fi.Contact.hertz(1e7), at=at, speed=1.0, tolerance=1e-9)

    slopes = blow(**numbers).gradient(("contact_time", "restitution"))
    for name, value in numbers.items():
        full = {"thickness": "section.thickness", "scale": "target.scale"}.get(name, f"material.{name}")
        sides = [blow(**numbers | {name: value * (1.0 + side * 1e-4)}) for side in (-1.0, 1.0)]
        for quantity, found in slopes.items():
            change = (getattr(sides[1], quantity) - getattr(sides[0], quantity)) / 2e-4
            # differences of second order: 1e-8 times the third derivative
            assert_allclose(found[full] * value, change, rtol=1e-5, err_msg=f"{quantity} in {name}")


@pytest.mark.slow
@pytest.mark.parametrize("family", grazing.FAMILIES, ids=lambda family: family.quantity)
def test_gradients_are_right_on_both_sides_until_they_are_refused(family):
    """A second impact comes and goes, two impacts press equally hard: next to the value, both sides are refused."""
    value = family.value(1e-7)
    for distance in (-1e-2, -1e-5, 1e-5, 1e-2):
        found = grazing.look(family, value, distance)
        if abs(distance) < 1e-4:
            assert found.why.startswith("no gradient next to a grazing contact" if family.seed == 3 else
                                        "no gradient of the largest force: two maxima")  # fmt: skip
        else:
            # differences of fourth order over a twentieth of the distance: 1e-5 of a slope that goes as its root
            assert found.off < 1e-5, distance
            assert found.error < 1e-5 * max(1.0, abs(found.slope))


def test_a_grazing_contact_has_no_gradient():
    """An impact a hair deep, a push a hair short of a second one: where the bisection of `gradient_grazing` ends."""
    family = grazing.FAMILIES[0]
    for factor in (GRAZING * (1.0 - 1e-5), GRAZING * (1.0 + 1e-5)):
        with pytest.raises(fi.SimulationError, match="no gradient next to a grazing contact"):
            family.strike(factor).gradient("contact_time")


def test_what_has_no_gradient_says_why():
    wall, rigid = fi.Modes.rigid(1e6), fi.Striker.rigid(0.1)
    felt = fi.Contact.felt(1e10, 2.5, hysteresis=0.4, relaxation=1e-3)
    with pytest.raises(fi.SimulationError, match="the contact yields or remembers"):
        fi.strike(wall, rigid, felt, at=None, speed=1.0).gradient("impulse")
    with pytest.raises(fi.SimulationError, match=r"no gradient in contact\.gap: the bodies touch at the start"):
        ball(fi.Contact.hertz(1e6)).gradient("impulse", "contact.gap")
    with pytest.raises(fi.SimulationError, match=r"no gradient in section\.thickness: section and material"):
        ball(fi.Contact.hertz(1e6)).gradient("impulse", "section.thickness")
    with pytest.raises(fi.SimulationError, match="never touched"):
        fi.strike(wall, rigid, fi.Contact.hertz(1e6, gap=1.0), at=None, speed=1.0, duration=0.1).gradient("impulse")
    with pytest.raises(ValueError, match="wrt must be one of"):
        ball(fi.Contact.hertz(1e6)).gradient("impulse", "striker.colour")
    with pytest.raises(ValueError, match="quantity must be one of"):
        ball(fi.Contact.hertz(1e6)).gradient("loudness")
    with pytest.raises(ValueError, match="needs a frequency, such as 'spectral_centroid=5000'"):
        ball(fi.Contact.hertz(1e6)).gradient("spectral_centroid")
    chain = [fi.Touch(fi.Contact.linear(1e6), 0, 1), fi.Touch(fi.Contact.linear(1e6, gap=1e-3), 1, 2)]
    with pytest.raises(ValueError, match="gradient needs a blow of `strike`"):
        fi.collide([fi.Modes.rigid(0.1)] * 3, chain, speeds=[1.0, 0.0, 0.0]).gradient("impulse")


def test_the_level_of_a_half_sine_falls_by_the_formula():
    """The spectrum of a half sine of duration T is cos(pi f T) / (1 - (2 f T)^2) of that at 0 Hz, T = pi sqrt(m/k)."""
    mass, stiffness, frequency = 0.1, 1e6, 900.0
    hit = fi.strike(
        fi.Modes.rigid(1e12), fi.Striker.rigid(mass), fi.Contact.linear(stiffness), at=None, speed=1.0, tolerance=1e-9
    )
    found = hit.gradient(f"spectral_level={frequency:g}", ("striker.mass", "contact.stiffness"))
    x = frequency * np.pi * np.sqrt(mass / stiffness)
    whole = 20.0 * np.log10(np.cos(np.pi * x) / (1.0 - 4.0 * x**2))
    slope = 20.0 / np.log(10.0) * x * (8.0 * x / (1.0 - 4.0 * x**2) - np.pi * np.tan(np.pi * x))
    assert_allclose(found.value, whole, rtol=1e-6)  # the wall moves by 1e-13 of the ball's way; the run errs by 1e-9
    assert_allclose(found.slopes * (mass, stiffness), [0.5 * slope, -0.5 * slope], rtol=1e-6)


def test_a_gradient_reads_as_a_table():
    found = ball(fi.Contact.hertz(1e6)).gradient("contact_time", ("striker.mass", "contact.stiffness"))
    assert "+0.4000 % per %, in striker.mass = 0.2 kg" in str(found)
    assert "<table" in found._repr_html_()
    assert found["striker.mass"] == found.slopes[0]
    assert list(found) == ["striker.mass", "contact.stiffness"]


def test_a_striker_that_a_hand_holds_has_no_gradient():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=50.0, n_modes=10)
    held = fi.Striker.rigid(0.05).held(fi.Hand(stiffness=100.0))
    hit = fi.strike(plate, held, fi.Contact.hertz(1e6), at=(0.4, 0.3), speed=1.0, tolerance=1e-2, max_impacts=1)
    with pytest.raises(fi.SimulationError, match="no gradient: a hand holds the striker"):
        hit.gradient("impulse")


@pytest.mark.slow
@pytest.mark.xdist_group("stretched")
def test_a_target_that_stretches_has_no_gradient():
    plate = fi.Plate(fi.Material(E=70e9, nu=0.3, rho=2700.0), 1e-3)
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate, {"boundary": "hinged"}), n_modes=8)
    law = fi.Contact.hertz(1e5)
    hit = fi.strike(modes, fi.Striker.rigid(0.01), law, at=(0.1, 0.1), speed=1.0, tolerance=1e-1, stretching=True)
    with pytest.raises(fi.SimulationError, match="no gradient: the target stretches"):
        hit.gradient("impulse")
