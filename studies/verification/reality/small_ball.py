"""A steel ball of 1.58 mm on a thick steel plate: how long it touches, dropped from an unknown height."""

from reality.record import Experiment, Measured, Predicted

import fem_impact as fi

STEEL = fi.Material(E=207e9, nu=0.29, rho=7830.0)
KNOWN = {"strike.speed": ("loguniform", 0.3, 2.0), "contact.stiffness": ("lognormal", 1.0, 0.03)}
YIELDS = (0.6e9, 2.0e9)  # [Pa] from annealed to hardened steel


def predict() -> Predicted:
    """Contact times of a hard ball, which stays elastic, on plates from soft to hard."""
    ball = fi.Striker.sphere(STEEL, 0.79e-3)
    law = fi.Contact.between(ball, STEEL)
    vary = {**KNOWN, "contact.stiffness": ("lognormal", law.stiffness, 0.03)}
    found = fi.spread(fi.Modes.rigid(1e3), vary, ball, law, n=2048, sobol=False, at=None, speed=1.0)
    soft = max(_longer(ball, strength) for strength in YIELDS)
    return Predicted(found.values("contact_time")[:, None], computation=1e-3, model=0.5 * soft)


def _longer(ball: fi.Striker, strength: float) -> float:
    """By how much a plate that yields makes the contact longer at 0.8 m/s [-]."""
    laws = (fi.Contact.between(ball, STEEL), fi.Contact.between(ball, STEEL, yield_strength=strength))
    elastic, yielding = (fi.strike(fi.Modes.rigid(1e3), ball, law, at=None, speed=0.8).contact_time for law in laws)
    return yielding / elastic - 1.0


EXPERIMENTS = (
    Experiment(
        key="small_ball",
        title="Steel ball of 1.58 mm on thick steel",
        source="G. C. McLaskey, Ball Impact and Sensor Calibration Project, "
               "courses.cit.cornell.edu/mclaskey/impact.html, first paragraph (second bounce)",
        licence="page of a university; one number",
        rig="steel plate of 50 mm, steel ball of 1.58 mm diameter, contact from the width of the first wave to arrive",
        known={
            "speed": "0.3 to 2 m/s, assumed: a fall of 5 to 200 mm", "contact stiffness": "within 3 %",
            "yield strength": "0.6 to 2 GPa, taken as error of the model",
        },
        left_open="the height of the drop, the steels",
        measured=(Measured("contact time", 5e-6, 0.5e-6, "s"),),
        predict=predict,
    ),
)  # fmt: skip
