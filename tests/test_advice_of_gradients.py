"""Every message about a gradient that gives advice: following it works."""

from functools import cache, partial

import numpy as np
import pytest
from comparing import changes, follow_advice
from numpy.testing import assert_allclose

import fem_impact as fi

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20)
HARD = fi.Contact.linear(1e6)


@cache
def system():
    return fi.assemble(fi.mesh.rectangle(0.4, 0.3), fi.Plate(STEEL, 1e-3), {"boundary": "clamped"})


def struck(body=PLATE, law=None, *, mass=0.03, at=(0.13, 0.1), speed=1.0, tolerance=1e-4, **how):
    law = fi.Contact.linear(1e4) if law is None else law
    return fi.strike(body, fi.Striker.rigid(mass), law, at=at, speed=speed, tolerance=tolerance, **how)


def slopes(quantity, wrt=None, body=PLATE, law=None, **how):
    """The gradient of one quantity of a blow, which is a number."""
    found = struck(body, law, **how).gradient(quantity, wrt)
    assert np.isfinite(found.slopes).all() and np.isfinite(found.error).all()
    return found


often = partial(slopes, "impulse", "striker.mass", law=HARD, mass=0.2)
chatter = partial(often, law=fi.Contact.power(1e5, 0.7), mass=1.0, tolerance=1e-2)
grazing = partial(often, mass=0.5)  # an impact of 50 nm, at any speed
energy = partial(slopes, "modal_energy", "striker.mass")
in_loss = partial(slopes, "impulse", "contact.loss")


def from_outside(wrt, target):
    return slopes("impulse", wrt, system(), tolerance=1e-2, target=target)


HELD = fi.Striker.rigid(0.03).held(fi.Hand(stiffness=100.0))


def differ(run):
    """Slope of an impulse in a number by differences of runs, which those of twice the change confirm.

    ``run`` makes a blow of a relative change of the number.
    """
    near, far = ((run(step).impulse - run(-step).impulse) / (2.0 * step) for step in (1e-3, 2e-3))
    assert_allclose(near, far, rtol=1e-3)  # of second order, of runs told to 1e-8
    return near


def in_chain(gap):
    touches = [fi.Touch(fi.Contact.linear(1e6), 0, 1), fi.Touch(fi.Contact.linear(2e6, gap=gap), 1, 2)]
    return fi.collide([fi.Modes.rigid(mass) for mass in (0.1, 0.11, 0.12)], touches, speeds=[1.0, 0.0, 0.0])


def held(speed=1.0):
    law = fi.Contact.linear(1e4)
    return fi.strike(PLATE, HELD, law, at=(0.13, 0.1), speed=speed, tolerance=1e-8, max_impacts=1)


# fmt: off
GRADIENTS = {  # what fails, the message, and what it advises
    "energy of vectors": (lambda: energy(body=system(), target="vectors"),
     "the modes that ring did not carry the blow; strike modes of find_modes$",
     lambda: energy(body=fi.find_modes(system(), n_modes=20))),
    "energy of other modes": (lambda: struck().on(PLATE).gradient("modal_energy"),
     "the modes that ring did not carry the blow; strike modes of find_modes$", lambda: energy()),
    "grazing": (lambda: grazing(),
     "grazing contact: .*; take a slightly heavier or lighter striker, or strike elsewhere$",
     lambda: (grazing(mass=0.52), grazing(mass=0.48), grazing(at=(0.14, 0.1)))),
    "no gap": (lambda: slopes("peak_time", "contact.gap"),
     "the bodies touch at the start, and even a small gap would change how they meet; give a gap$",
     lambda: slopes("peak_time", "contact.gap", law=fi.Contact.linear(1e4, gap=1e-4))),
    "no loss": (lambda: in_loss(),
     "without loss the modes left out act as a spring .*; give the contact a small loss$",
     lambda: in_loss(law=fi.Contact.linear(1e4, loss=1e-3))),
    "a rigid target": (lambda: from_outside("target.mass", target="rigid"),
     "the target is treated as rigid or infinite; strike its modes, with target = 'modal'$",
     lambda: from_outside(("target.mass", "strike.x"), target="modal")),
    "chatter": (lambda: chatter(dt=1e-3), "the bodies chatter, .*; give max_impacts, a shorter duration or no dt$",
     lambda: (chatter(dt=1e-3, max_impacts=1), chatter(dt=1e-3, duration=2e-3), chatter())),
    "runs of other counts": (lambda: chatter(dt=5e-4),
     "runs of different steps find .* impacts; give a smaller tolerance and no dt, or max_impacts$",
     lambda: (chatter(dt=5e-4, max_impacts=1), chatter())),
    "a hand": (lambda: held().gradient("impulse"),
     "take differences of runs with the number changed, at a smaller tolerance$",
     lambda: differ(lambda step: held(1.0 + step))),
    "a speed of a body at rest against another": (lambda: in_chain(0.0).gradient("contact_time", "speeds.2"),
     "a speed would press or part them; give a gap$", lambda: in_chain(1e-5).gradient("contact_time", "speeds.2")),
    "sections of other bodies": (
     lambda: in_chain(1e-5).gradient("impulse", sections={"t": (1e-3, lambda t: fi.Plate(STEEL, t))}),
     "sections are those of the target of `strike`; leave them out$", lambda: in_chain(1e-5).gradient("impulse")),
    "section of other bodies": (lambda: in_chain(1e-5).gradient("impulse", "section.thickness"),
     "only the target of `strike` has one; take the mass and first frequency of the body$",
     lambda: in_chain(1e-5).gradient("impulse", "bodies.1.mass")),
}
# fmt: on


@pytest.mark.parametrize("name", GRADIENTS)
def test_following_the_advice_gives_a_gradient(name):
    follow_advice(GRADIENTS[name])


@pytest.mark.parametrize("gap", [0.0, 1e-5])
def test_gradients_on_a_body_that_moves_already_are_differences(gap):
    """The striker starts at the surface, displaced where it strikes; its speed is not that of the body."""
    first = struck(PLATE, at=(0.2, 0.1), tolerance=1e-8)
    numbers = {"striker.mass": 0.01, "strike.x": 0.13, "strike.y": 0.1, "strike.speed": 0.8}

    def again(numbers):
        law, at = fi.Contact.hertz(1e6, gap=gap), (numbers["strike.x"], numbers["strike.y"])
        blow = {"mass": numbers["striker.mass"], "speed": numbers["strike.speed"], "tolerance": 1e-9, "start": first}
        return struck(PLATE, law, at=at, max_impacts=1, **blow)

    found = again(numbers).gradient(("impulse", "contact_time", "peak_force"), tuple(numbers))
    for name, value in numbers.items():
        ours = [slope[name] * value for slope in found.values()]
        # differences of second order of blows told to 1e-9
        assert_allclose(ours, changes(again, numbers, name, found), rtol=1e-5, err_msg=name)
