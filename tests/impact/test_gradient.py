"""`hit.gradient` against central differences and closed forms, and where it refuses."""

from dataclasses import replace

import gradient_claims as claims  # random blows and what is told of them, on which both are judged
import gradient_contacts as several
import gradient_grazing as grazing
import numpy as np
import pytest
from comparing import changes
from numpy.testing import assert_allclose
from test_history import beam_and_stop

import fem_impact as fi
from fem_impact.impact import gradient
from fem_impact.impact.compiled.law import table

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
        # a lossy force rings with every mode, so that steps move its peak; the error stated was 5e-2 where 1e-2 was off
        late = 2e-2 if lossy else 1e-5
        assert abs(slopes[4] - differences[4]) <= late + 2.0 * doubt[4], message
        n += 1
    return n


def test_gradients_of_some_blows_are_central_differences():
    assert check_seeds(range(3)) == 3


@pytest.mark.slow
def test_gradients_are_central_differences(all_cases):
    assert check_seeds(range(3, 14 if all_cases else 9)) >= (6 if all_cases else 3)


@pytest.mark.slow
@pytest.mark.thin(24)
@pytest.mark.parametrize("first", range(100, 700, 25))
def test_gradients_of_many_blows_are_central_differences(first, all_cases):
    n = 25 if all_cases else 10
    assert check_seeds(range(first, first + n)) >= 0.44 * n


def check_contacts(seed, kind):
    """Judge a blow with several contacts as those with one."""
    found = several.examine(seed, kind)
    assert found is not None and not found.why
    # the doubt is about one deviation of the differences, whose blows have steps of their own
    off, allowed = found.off, 1e-6 + 3.0 * found.doubt
    assert (off[:4] <= allowed[:4]).all(), (off, allowed)
    assert off[4] <= allowed[4] + (2e-2 if found.lossy else 1e-5)  # see `check_seeds`, also for the spectrum
    assert off[5] <= allowed[5] + 5e-5
    return found


def test_gradients_with_two_contacts_are_central_differences():
    check_contacts(3, "buzz")


@pytest.mark.slow
@pytest.mark.thin(5)
@pytest.mark.parametrize(
    "kind, seed", [("two sticks", 0), ("two sticks", 15), ("buzz", 13), ("over a stop", 44), ("over a stop", 50)]
)
def test_gradients_with_several_contacts_are_central_differences(kind, seed):
    found = check_contacts(seed, kind)
    wrong = np.abs(found.usual - found.slopes)[:4]
    assert (found.stated[:4] >= wrong / 3.0 - 1e-9).all()  # at least so in 96 % of 54 blows, see the study


def chain_of_balls(numbers):
    """Newton's cradle of three balls that touch before the first is let go."""
    laws = [fi.Contact.power(numbers[f"contacts.{c}.stiffness"], numbers[f"contacts.{c}.exponent"]) for c in range(2)]
    balls = [fi.Modes.rigid(numbers[f"bodies.{b}.mass"]) for b in range(3)]
    touches = [fi.Touch(law, c, c + 1) for c, law in enumerate(laws)]
    return fi.collide(balls, touches, speeds=[numbers["speeds.0"], 0.0, 0.0], tolerance=1e-9)


def resting_beam(numbers):
    """A beam pressed on two supports and struck between them."""
    mass, frequency, damping = (numbers[f"bodies.1.{x}"] for x in ("mass", "first_frequency", "damping_ratio"))
    free = {"ends": ("free", "free"), "mass": mass, "first_frequency": frequency, "damping_ratio": damping}
    beam = fi.analytic.beam(1.0, n_modes=6, **free)
    laws = [
        fi.Contact.power(*(numbers[f"contacts.{c}.{x}"] for x in ("stiffness", "exponent")), gap=gap)
        for c, gap in enumerate((numbers["contacts.0.gap"], 0.0, 0.0))
    ]
    touches = [
        fi.Touch(laws[0], 0, 1, None, [0.55]),
        fi.Touch(laws[1], 1, None, [0.2]),
        fi.Touch(laws[2], 1, None, [0.8]),
    ]
    still = np.zeros(1), np.zeros(1)
    return fi.collide(
        [fi.Modes.rigid(numbers["bodies.0.mass"]), beam], touches, speeds=[numbers["speeds.0"], 0.0],
        states=[still, (1e-4 * beam.rigid_motion([0.5]), np.zeros(6))], forces=[0.0, 20.0], duration=0.012,
        tolerance=1e-8,
    )  # fmt: skip


CRADLE = {
    "bodies.0.mass": 0.1, "bodies.1.mass": 0.15, "bodies.2.mass": 0.12, "speeds.0": 1.0, "contacts.0.stiffness": 1e8,
    "contacts.0.exponent": 1.5, "contacts.1.stiffness": 2e8, "contacts.1.exponent": 1.3,
}  # fmt: skip
BEAM = {
    "bodies.0.mass": 0.05, "bodies.1.mass": 0.3, "bodies.1.first_frequency": 200.0, "bodies.1.damping_ratio": 0.02,
    "speeds.0": 0.5, "contacts.0.gap": 1e-3, "contacts.0.stiffness": 1e6, "contacts.0.exponent": 1.5,
    "contacts.1.stiffness": 1e5, "contacts.1.exponent": 1.0, "contacts.2.stiffness": 1.5e5, "contacts.2.exponent": 1.2,
}  # fmt: skip


@pytest.mark.parametrize("blow, numbers", [(chain_of_balls, CRADLE), (resting_beam, BEAM)], ids=["cradle", "beam"])
@pytest.mark.filterwarnings("ignore::fem_impact.ToleranceWarning")  # of six modes
def test_gradients_of_bodies_that_touch_at_the_start_are_differences(blow, numbers):
    quantities = ("impulse", "contact_time", "peak_force", "restitution")
    found = blow(numbers).gradient(quantities, tuple(numbers))
    assert_allclose(found["impulse"].numbers, list(numbers.values()))
    for name, value in numbers.items():
        near, far = (changes(blow, numbers, name, quantities, step) for step in (2e-4, 4e-4))
        for (quantity, slopes), one, two in zip(found.items(), near, far):
            scale = np.abs(slopes.slopes * slopes.numbers).sum()
            limit = 1e-6 * scale + abs(one - two)  # blows told to 1e-8 or 1e-9; most are told better by far
            assert abs(slopes[name] * value - (4.0 * one - two) / 3.0) <= limit, f"{quantity} in {name}"


def test_a_run_that_ends_while_another_contact_presses_ends_later_with_it():
    """Two balls on springs of their own side by side on a third: the first release ends the run."""
    numbers = {"contacts.0.stiffness": 2e6, "contacts.1.stiffness": 1e6, "speeds.0": 1.0, "speeds.1": 0.7}

    def blow(numbers):
        touches = [
            fi.Touch(fi.Contact.power(numbers[f"contacts.{c}.stiffness"], 1.2, gap=1e-5), c, 2) for c in range(2)
        ]
        balls = [fi.Modes.rigid(mass) for mass in (0.1, 0.2, 5.0)]
        speeds = [numbers["speeds.0"], numbers["speeds.1"], 0.0]
        return fi.collide(balls, touches, speeds=speeds, tolerance=1e-10, max_impacts=1)

    hit = blow(numbers)
    frequency = 300.0
    assert hit.history.force_at(np.array([hit.history.end_time * (1.0 - 1e-9)]), 1)[0] > 0.1 * hit.peak_force
    names = ("impulse", "contact_time", "restitution", "peak_force", f"spectral_level={frequency:g}")
    found = hit.gradient(names, tuple(numbers))
    for name, value in numbers.items():
        low, high = (blow(numbers | {name: value * (1.0 + side * 1e-4)}) for side in (-1.0, 1.0))
        for quantity, slopes in found.items():
            level = [20.0 * np.log10(np.abs(np.divide(*each.spectrum([frequency, 0.0])))) for each in (low, high)]
            told = level if "=" in quantity else [getattr(each, quantity) for each in (low, high)]
            scale = np.abs(slopes.slopes * slopes.numbers).sum()
            # differences of second order; the spectrum is that of a force linear between samples, to 1e-6
            off = abs(slopes[name] * value - (told[1] - told[0]) / 2e-4)
            assert off <= (2e-5 if "=" in quantity else 1e-6) * scale, f"{quantity} in {name}"


def test_what_has_no_gradient_with_several_contacts_says_where():
    hit = chain_of_balls(CRADLE)
    with pytest.raises(fi.SimulationError, match=r"no gradient in speeds\.2: the body rests against another"):
        hit.gradient("impulse", "speeds.2")
    with pytest.raises(fi.SimulationError, match=r"no gradient in contacts\.1\.gap: the bodies touch at the start"):
        hit.gradient("impulse", "contacts.1.gap")
    with pytest.raises(fi.SimulationError, match="only the target of `strike` has one; take the mass and first"):
        hit.gradient("impulse", "section.thickness")
    with pytest.raises(ValueError, match=r"wrt must be one of .*bodies\.2\.mass"):
        hit.gradient("impulse", "striker.mass")
    with pytest.raises(ValueError, match="sections are those of the target of `strike`"):
        hit.gradient("impulse", sections={"t": (1e-3, lambda t: fi.Plate(fi.Material(70e9, 0.3, 2700.0), t))})
    assert "contacts.1.stiffness = 2e+08 N/m**exponent" in str(hit.gradient("impulse"))

    swing = float(beam_and_stop(1.0).displacement([[0.5]], np.linspace(0.0, 8e-3, 4001), body=1).max())
    assert np.isfinite(beam_and_stop(1.01 * swing).gradient("impulse").slopes).all()
    for factor in (1.0 + 1e-5, 1.0 - 1e-5):
        with pytest.raises(fi.SimulationError, match="no gradient next to a grazing contact"):
            beam_and_stop(factor * swing).gradient("impulse")


def ball(law, *, mass=0.2, speed=1.3, tolerance=1e-8, **blow):
    """A mass on a target so heavy that it is a wall."""
    return fi.strike(
        fi.Modes.rigid(1e12), fi.Striker.rigid(mass), law, at=None, speed=speed, tolerance=tolerance, **blow
    )


@pytest.mark.parametrize("exponent", [1.0, 1.2, 1.5, 2.5])
def test_ball_on_a_wall_has_the_powers_of_its_closed_form(exponent):
    """Contact time as m**q k**-q v**((1-a) q), peak force as k**q (m v**2)**(a q), q = 1 / (a + 1); impulse 2 m v.

    Although the force rises with a power whose slopes are singular.
    """
    q = 1.0 / (exponent + 1.0)
    slopes = ball(fi.Contact.power(1e6, exponent, gap=1e-4), tolerance=1e-9).gradient(
        ("contact_time", "peak_time", "peak_force", "impulse", "restitution"),
        wrt=("striker.mass", "contact.stiffness", "strike.speed"),
    )
    time = [q, -q, (1.0 - exponent) * q]
    # 1e-9 was asked of the blow; a mass of 1e12 kg is a wall to 2e-13
    assert_allclose(slopes["contact_time"].relative, time, rtol=0, atol=1e-8)
    start, peak = slopes["impulse"].numbers[2], slopes["peak_time"]
    late = peak.slopes * peak.numbers + [0.0, 0.0, 1e-4 / start]  # without the gap's own time
    assert_allclose(late / (peak.value - 1e-4 / start), time, rtol=0, atol=1e-6)  # the peak is flat
    assert_allclose(slopes["peak_force"].relative, [exponent * q, q, 2.0 * exponent * q], rtol=0, atol=1e-8)
    assert_allclose(slopes["impulse"].relative, [1.0, 0.0, 1.0], rtol=0, atol=5e-9)
    assert_allclose(slopes["restitution"].relative, 0.0, rtol=0, atol=1e-8)


def test_smaller_steps_make_slopes_exact():
    errors = []
    for tolerance in (1e-3, 1e-6):
        found = ball(fi.Contact.linear(1e5), tolerance=tolerance).gradient("contact_time", "striker.mass")
        errors.append(abs(found.relative[0] / 0.5 - 1.0))
    assert errors[1] < 1e-6 and errors[1] < 0.1 * errors[0]


@pytest.mark.parametrize("loss, tolerance", [(0.0, 1e-4), (0.3, 1e-4), (0.0, 1e-8)])
def test_the_largest_force_is_the_largest_of_many_samples(loss, tolerance):
    """Its time is that of the largest of 200 000 samples, with loss, where the force rings, as without."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=10)
    law = fi.Contact.hertz(695e3, loss=loss)
    blow = {"at": (0.45, 0.3), "speed": 1.0, "tolerance": tolerance, "max_impacts": 2, "residual": False}
    history = fi.strike(plate, fi.Striker.rigid(0.1), law, **blow).history
    time, force = gradient.largest(history)
    times = np.linspace(0.0, history.end_time, 200_001)
    forces = history.force_at(times, 0)[0]
    assert_allclose(time, times[forces.argmax()], atol=2.0 * times[1])
    assert_allclose(force, forces.max(), rtol=1e-9)  # at a flat top, 200 000 samples miss no more


@pytest.mark.parametrize("before", [0.01, 0.7])  # [s] of the step before the longest
def test_a_peak_just_before_the_end_of_a_long_step_is_found(before):
    """Of a half sine of pi seconds, whose look nearest to the peak is the start of the short step after it."""
    ends = np.array([0.0, 0.8 - before, 0.8, 0.5 * np.pi + 0.01, 0.5 * np.pi + 0.02, np.pi])
    steps, now, law = np.zeros((5, 8)), np.zeros((6, 1)), table([[1e3, 1.0]])
    steps[:, 0], steps[:, 1], steps[:, 5] = ends[:-1], np.diff(ends), 1.0
    steps[:, 3], steps[:, 4] = np.sin(ends[:-1]), np.cos(ends[:-1])
    now[4] = -1.0
    run = ball(fi.Contact.linear(1e3)).history
    found = gradient.largest(replace(run, steps=steps, now=now, law=law, end_time=np.pi))
    assert_allclose(found, [0.5 * np.pi, 1e3], rtol=1e-3)  # of the cubics


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


def test_slopes_on_one_side_start_as_hunt_and_crossley_have_it():
    """Of a number that cannot be negative there are differences to one side only: ``1 - e = 2 / 3 loss speed``."""
    found = ball(fi.Contact.hertz(1e6), speed=1.3).gradient("restitution", ("contact.loss",))
    assert_allclose(found["contact.loss"], -2.0 / 3.0 * 1.3, rtol=1e-5)


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


def claims_of(seed):
    """Stated over true errors of the slopes of a blow told to 1e-4, (16,); those told to 1e-7 count as true."""
    rng = np.random.default_rng(seed)
    body = {"mass": rng.uniform(0.2, 5.0), "first_frequency": rng.uniform(30.0, 150.0)}
    plate = fi.analytic.rectangle(1.55, 1.0, n_modes=int(rng.integers(5, 40)), **body)
    law = fi.Contact.linear(10 ** rng.uniform(3.5, 6.0)) if seed % 2 else fi.Contact.hertz(10 ** rng.uniform(4.5, 7.0))
    where = {"at": tuple(rng.uniform(0.2, 0.8, 2)), "speed": 1.0, "residual": False}
    striker = fi.Striker.rigid(10 ** rng.uniform(-2.5, -0.5))
    names = "striker.mass", "contact.stiffness", "target.mass", "target.first_frequency"
    try:
        rough, fine = (
            fi.strike(plate, striker, law, **where, tolerance=tolerance, scheme="A4").gradient(QUANTITIES[:4], names)
            for tolerance in (1e-4, 1e-7)
        )
    except fi.SimulationError:  # it grazes
        return np.zeros((0, 4))
    return np.array(
        [
            (found.error + other.error) / np.maximum(np.abs(found.slopes - other.slopes), 1e-300)
            for found, other in zip(rough.values(), fine.values())
        ]
    )


@pytest.mark.parametrize("seeds", [range(20, 40), pytest.param(range(40, 300), marks=pytest.mark.slow)])
def test_slopes_err_by_no_more_than_they_say(seeds):
    """Three runs agree by chance on few of them."""
    found = np.concatenate([claims_of(seed).ravel() for seed in seeds])
    assert len(found) > 12 * len(seeds)
    assert np.mean(found < 1.0) <= 0.02 and found.min() > 0.1


def test_the_peak_is_that_of_the_motion_and_not_of_the_steps():
    """Seed 184: at a border that two runs share, the polynomials of the force on both sides straddle its peak.

    They share the first step of the contact, too, in which a linear law's slope in its exponent goes as a logarithm.
    """
    numbers = random_numbers(np.random.default_rng(184))
    rough, fine = (strike(numbers, tolerance).gradient("peak_time") for tolerance in (1e-8, 1e-10))
    scale = np.abs(fine.slopes * fine.numbers).sum()
    off = np.abs((rough.slopes - fine.slopes) * fine.numbers).sum() / scale
    assert off <= 1e-6  # 3e-7 was measured; 4e-5 with the peak of the polynomials
    assert off <= 3.0 * ((rough.error + fine.error) * np.abs(fine.numbers)).sum() / scale


def test_two_maxima_alike_are_refused_though_a_step_holds_both():
    """Seed 2: the lossy force rings within its steps, and its ends alone would not show the rival."""
    numbers = random_numbers(np.random.default_rng(2))
    with pytest.raises(fi.SimulationError, match="two maxima differ by"):
        strike(numbers, 1e-3).gradient("peak_force")


FELT = {"contact.stiffness": 1e10, "contact.exponent": 2.5}
LAYERS = {  # a soft layer over a hard one, pressed beyond its depth
    "contact.stiffness": 1e5, "contact.exponent": 1.3, "contact.depth": 2e-4, "contact.hard_stiffness": 1e8,
    "contact.hard_exponent": 1.5,
}  # fmt: skip


def felt_blow(numbers):
    return ball(fi.Contact.felt(*numbers.values(), hysteresis=0.4, relaxation=1e-3), mass=0.03)


def layered_blow(numbers):
    law = fi.Contact.layers(**{name.removeprefix("contact."): value for name, value in numbers.items()})
    return ball(law, mass=0.01, tolerance=1e-9)


@pytest.mark.parametrize("blow, numbers, off", [(felt_blow, FELT, 1e-4), (layered_blow, LAYERS, 2e-5)])
def test_gradients_of_special_contacts_are_differences_of_blows(blow, numbers, off):
    quantities = ("contact_time", "peak_force", *(["restitution"] if blow is felt_blow else []))
    found = blow(numbers).gradient(quantities)
    for name, value in numbers.items():
        for slopes, change in zip(found.values(), changes(blow, numbers, name, quantities)):
            # differences of second order of blows told to 1e-8 and 1e-9
            assert_allclose(slopes[name] * value, change, atol=off * slopes.value, err_msg=name)


YIELDING = {
    "contact.stiffness": 1e7, "contact.exponent": 1.4, "contact.yield_approach": 5e-5, "contact.gap": 1e-4,
    "strike.speed": 1.0, "strike.x": 0.45, "strike.y": 0.3, "target.mass": 0.4, "target.first_frequency": 90.0,
    "target.damping_ratio": 0.01,
}  # fmt: skip


def yielding(numbers, tolerance):
    """A mass on a plate whose contact yields."""
    stiffness, exponent, first, gap = (
        numbers[f"contact.{x}"] for x in ("stiffness", "exponent", "yield_approach", "gap")
    )
    law = fi.Contact.elastic_plastic(stiffness, exponent=exponent, yield_approach=first, gap=gap)
    body = {name: numbers[f"target.{name}"] for name in ("mass", "first_frequency", "damping_ratio")}
    plate = fi.analytic.rectangle(1.55, 1.0, n_modes=20, **body)
    at, speed = (numbers["strike.x"], numbers["strike.y"]), numbers["strike.speed"]
    striker = fi.Striker.rigid(numbers["striker.mass"])
    return fi.strike(plate, striker, law, at=at, speed=speed, tolerance=tolerance, max_impacts=3)


@pytest.mark.parametrize(
    "mass, n_impacts, tolerance", [pytest.param(0.05, 1, 1e-9, marks=pytest.mark.slow), (0.2, 2, 1e-8)]
)
@pytest.mark.filterwarnings("ignore::fem_impact.ToleranceWarning")  # of 20 modes
def test_gradients_of_contacts_that_yield_are_differences(mass, n_impacts, tolerance):
    """They unload from a dent, as deep as the force made it, and at the second impact they meet that dent."""
    numbers = {**YIELDING, "striker.mass": mass}
    quantities = ("restitution", "impulse", "contact_time", "peak_force", "peak_time")
    hit = yielding(numbers, tolerance)
    assert hit.n_impacts == n_impacts and hit.energies["dissipated"] > 0.1 * hit.start_energies["striker"]
    found = hit.gradient(quantities)
    assert set(numbers) == set(found["impulse"].names)
    frequencies = np.linspace(0.0, BAND, 5)

    def value(name, step):
        return claims.told(yielding(numbers | {name: numbers[name] * (1.0 + step)}, tolerance), frequencies)[:5]

    scale = np.array([np.abs(each.slopes * each.numbers).sum() for each in found.values()])
    for name in numbers:
        near, far = ((value(name, step) - value(name, -step)) / (2.0 * step) for step in (STEP, 2.0 * STEP))
        slopes = np.array([each[name] * numbers[name] for each in found.values()])
        off = np.abs(slopes - (4.0 * near - far) / 3.0) / scale
        # the tightest tolerances that both blows meet; 2e-7 was measured, told to 1e-8 the first has 2e-5 in its peak
        assert (off <= 1e-6 + np.abs(near - far) / scale).all(), (name, off)
    rough = yielding(numbers, 1e-4).gradient(quantities)
    for name, each in rough.items():
        wrong = np.abs(each.slopes - found[name].slopes) * each.numbers
        assert wrong.sum() <= 3.0 * (each.error * each.numbers).sum() + 1e-8 * scale[quantities.index(name)], name


def test_a_push_that_barely_yields_further_has_no_gradient():
    """A later impact presses the dent to within a hair of where it yields: the change of what is left jumps."""
    numbers = {**YIELDING, "strike.x": 0.775, "strike.y": 0.5}

    def deeper(mass):  # by how much a later push is harder than the first [N]
        first, *later = (impact.peak_force for impact in yielding(numbers | {"striker.mass": mass}, 1e-4).impacts)
        return max(later) - first

    low, high = 0.085, 0.095
    assert deeper(low) < 0.0 < deeper(high)
    for _ in range(14):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if deeper(middle) < 0.0 else (low, middle)
    for mass in (low, high):
        with pytest.raises(fi.SimulationError, match=r"slopes on both sides of this blow differ, .* yields further"):
            yielding(numbers | {"striker.mass": mass}, 1e-4).gradient("impulse")
    yielding(numbers | {"striker.mass": 1.001 * high}, 1e-4).gradient("impulse")


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
    numbers = {"section.thickness": 3e-3, "material.E": 70e9, "material.rho": 2700.0, "target.scale": 1.0}

    def blow(numbers):
        thickness, E, rho, scale = numbers.values()
        section = fi.Plate(fi.Material(E=E, nu=0.33, rho=rho), thickness)
        plate = fi.analytic.rectangle(0.5 * scale, 0.35 * scale, section=section, n_modes=25)
        at = (0.2 * scale, 0.1 * scale)
        return fi.strike(plate, fi.Striker.rigid(0.05), fi.Contact.hertz(1e7), at=at, speed=1.0, tolerance=1e-9)

    slopes = blow(numbers).gradient(("contact_time", "restitution"))
    for name, value in numbers.items():
        for found, change in zip(slopes.values(), changes(blow, numbers, name, slopes)):
            # differences of second order: 1e-8 times the third derivative
            assert_allclose(found[name] * value, change, rtol=1e-5, err_msg=f"{found.quantity} in {name}")


@pytest.mark.slow
@pytest.mark.parametrize("family", grazing.FAMILIES, ids=lambda family: family.quantity)
def test_gradients_are_right_on_both_sides_until_they_are_refused(family):
    """A second impact comes and goes, two impacts press equally hard: next to the value, both sides are refused."""
    value = family.value(1e-7)
    for distance in (-1e-2, -1e-5, 1e-5, 1e-2):
        found = grazing.look(family, value, distance)
        if abs(distance) < 1e-4:
            assert found.why.startswith("no gradient next to a grazing contact" if family.seed == 3 else
                                        "no gradient of the peak force: two maxima")  # fmt: skip
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
