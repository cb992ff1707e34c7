"""Every message about a design that gives advice: following it works."""

import numpy as np
import pytest
from comparing import follow_advice

import fem_impact as fi

WOOD = fi.Material(E=16e9, nu=0.35, rho=900.0)


def bar(height=0.02, length=0.35, **rest):
    return {"mesh": fi.mesh.line(length), "section": fi.Beam.rectangular(WOOD, width=0.05, height=height), **rest}


def plate(thickness=3e-3, sides=(0.3, 0.3), supports="hinged", **rest):
    return {
        "mesh": fi.mesh.rectangle(*sides, size=0.08), "section": fi.Plate(WOOD, thickness),
        "supports": {"boundary": supports}, **rest,
    }  # fmt: skip


def tuned(objects, mode=1, low=5e-3, high=40e-3, wanted=440.0, **how):
    """A frequency met by one number."""
    found = fi.design(lambda values: objects(values["x"]), {f"mode{mode}.frequency": wanted}, {"x": (low, high)}, **how)
    assert found.met
    return found


def struck(contact, low, high, wanted):
    def ball(values):
        return {"target": fi.Modes.rigid(1e9), "striker": fi.Striker.rigid(0.1), "contact": contact(values["x"]),
                "at": None, "speed": 1.0}  # fmt: skip

    assert fi.design(ball, {"contact_time": wanted}, {"x": (low, high)}).met


def groove(x):
    return lambda points: 3e-3 * (1.0 + x * np.sin(np.pi * points[:, 0] / 0.3) ** 2)


def beam(length):
    """Modes of formulas change their ratios with the slenderness."""
    return fi.analytic.beam(
        0.35, ends=("free", "free"), mass=0.3, first_frequency=400.0, n_modes=6, theory="timoshenko",
        slenderness=1e3 * length, shear_ratio=3.0,
    )  # fmt: skip


def felt(relaxation):
    return fi.Contact.felt(1e6, 2.0, hysteresis=0.3, relaxation=relaxation)


# fmt: off
DESIGNS = {  # what fails, the message, and what it advises
    "a mesh that changes": (lambda: tuned(lambda x: bar(length=x), low=0.2, high=0.6),
     "it changes the mesh; free numbers of the section instead$", lambda: tuned(bar)),
    "supports that change": (lambda: tuned(lambda x: bar(supports={"left": fi.Elastic(x)}), low=1e3, high=1e5),
     r"no derivative in \S+: it changes the .* of the body; keep them$",
     lambda: tuned(lambda x: bar(x, supports={"left": fi.Elastic(1e4)}), mode=2)),
    "a contact's memory": (lambda: struck(felt, 1e-5, 1e-3, 1e-3), r"it changes the contact's \S+; keep that$",
     lambda: struck(fi.Contact.linear, 1e4, 1e8, 1e-3)),
    "modes changed one by one": (lambda: tuned(beam, low=0.01, high=0.05),
     r"it changes the modes of the \S+ one by one; make the body of a mesh and a section$", lambda: tuned(bar)),
    "a shared frequency": (
     lambda: tuned(lambda x: plate(groove(x)), mode=2, low=0.0, high=0.5, wanted=600.0, start={"x": 0.0}),
     "modes share it, and a change splits it; want another frequency, or start from a body without this symmetry$",
     lambda: (
        tuned(lambda x: plate(groove(x)), mode=1, low=0.0, high=1.0, wanted=160.0, start={"x": 0.0}),
        tuned(lambda x: plate(groove(x), (0.4, 0.3)), mode=2, low=0.0, high=1.0, wanted=240.0),
    )),
    "a thick plate": (lambda: tuned(lambda x: plate(x, theory="mindlin"), low=5e-3, high=0.05, wanted=800.0),
     "it is not available for a thick plate; take a thin one$",
     lambda: tuned(plate, low=5e-3, high=0.05, wanted=800.0)),
    "nothing made beside a value": (
     lambda: tuned(lambda x: bar(height=0.02 if abs(x - 0.01) < 1e-9 else -1.0), start={"x": 0.01}),
     r"nothing can be made on either side of .*; change its range$", lambda: tuned(bar)),
    "a range that ends too early": (lambda: tuned(bar, wanted=2000.0), "stopped at the end of the range; widen it$",
     lambda: tuned(bar, wanted=2000.0, high=0.1)),
    "a start in the wrong place": (lambda: tuned(valley, low=-1.0, high=1.0, wanted=450.0, start={"x": 0.9}),
     "; free more numbers, or begin elsewhere, with start or tries$",
     lambda: (
        tuned(valley, low=-1.0, high=1.0, wanted=450.0, start={"x": -0.9}),
        tuned(valley, low=-1.0, high=1.0, wanted=450.0, start={"x": 0.9}, tries=4),
    )),
}
# fmt: on


def valley(x):
    """A bar whose height has three humps over x, of which only the left one is high enough."""
    return bar(height=0.0118 - 0.0006 * x + 0.0006 * np.cos(2.0 * np.pi * x))


@pytest.mark.slow
@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.filterwarnings("error::fem_impact.ToleranceWarning")
def test_following_the_advice_gives_a_design(name):
    follow_advice(DESIGNS[name])
