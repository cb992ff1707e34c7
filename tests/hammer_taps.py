"""Simulated taps of a hammer on a structure of two modes, for tests of what is found from them, and fits to them."""

import fem_impact as fi

RATE = 25600.0  # [Hz]
MASS, LAW = 0.2, fi.Contact.power(5e8, 1.7)
SPEEDS = (0.4, 0.8, 1.2)  # m/s
RANGES = {"contact.stiffness": (1e6, 1e11), "contact.exponent": (1.0, 4.0), "striker.mass": (0.05, 0.8)}
STRUCTURE = fi.Modes.from_arrays(
    [900.0, 2300.0], [[2.0, 1.5]], points=[[0.0]], mass=1.0, damping_ratio=0.02, complete=True
)


def taps_of(target=STRUCTURE, place=(0.0,), *, mass=MASS, law=LAW, speeds=SPEEDS, noise=0.005, **rig):
    """One record for each speed; ``law`` may be a list of contacts, one for each."""
    laws = law if isinstance(law, list) else [law] * len(speeds)
    hits = [
        fi.strike(target, fi.Striker.rigid(mass), each, at=place, speed=v, tolerance=1e-5)
        for v, each in zip(speeds, laws)
    ]
    return [fi.measure(h, rate=RATE, noise=noise, rng=i, onset=i * 7e-6, **rig) for i, h in enumerate(hits)]


def fitted(taps, **changes):
    """A fit to taps of the structure, from two starts and without profiles."""
    given = {"target": STRUCTURE, "at": [0.0], "striker": fi.Striker.rigid(0.1), "contact": LAW, "unknown": RANGES,
             "starts": 2, "profiles": False}  # fmt: skip
    return fi.fit(taps, **given | changes)


def said(made, text):
    """Whether taps or a fit note a text."""
    return any(text in note for note in made.notes)
