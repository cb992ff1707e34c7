"""Questions on the blows of a page, with the answers that these blows give."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..impact import force_spectrum
from ..scenes.sentences import place, si
from .explore_numbers import BAND, SPECTRUM_POINTS
from .lesson_grid import STEPS, Lesson

Position = tuple[int, ...]  # of place, speed, stiffness and mass


@dataclass(frozen=True)
class Question:
    """A question, what is expected for an answer, and where the sliders stand to look for it."""

    asked: str
    answer: str
    position: Position


def questions(lesson: Lesson) -> list[Question]:
    """All questions that the blows of a page can answer."""
    speeds, stiffnesses = _single(lesson, 1), _single(lesson, 2)
    phrases = _phrases(lesson, lesson.start)
    first = Question(
        "Strike as the scene does. How many impacts are there, how long are they together, and how large is the force?",
        f"{phrases['impacts']}, {phrases['time']} in contact, at most {phrases['force']}.", lesson.start,
    )  # fmt: skip
    asked = [first, _impulse(lesson), stiffnesses and _stiffer(lesson, *stiffnesses)]
    asked += [speeds and _faster(lesson, *speeds), _heavier(lesson), _harder(lesson)]
    asked += [stiffnesses and _spectrum(lesson, *stiffnesses), _elsewhere(lesson)]
    return [each for each in asked if each is not None]


def _phrases(lesson: Lesson, position: Position) -> dict[str, str]:
    """The numbers of a blow in words."""
    count, force, time, rebound = (
        float(lesson.quantity(name)[position]) for name in ("n_impacts", "peak_force", "contact_time", "restitution")
    )
    return {
        "impacts": "not known" if math.isnan(count) else f"{count:.0f} impact{'s' * (count != 1)}",
        "force": si(force, "N", 3), "time": si(time, "s", 3), "restitution": f"{rebound:.3g}".replace("-", "−"),
    }  # fmt: skip


def _mass(lesson: Lesson, i: int) -> str:
    return si(float(lesson.axes["mass"][i]), "kg", 3)


def _impulse(lesson: Lesson) -> Question | None:
    settings, start = lesson.settings(*lesson.start), lesson.start
    felt = lesson.setup.case(settings).striker.felt_mass
    rebound = float(lesson.quantity("restitution")[start])
    if math.isnan(rebound):
        return None
    momentum = felt * settings.speed * (1.0 + rebound)
    low = float(spectrum(lesson, start)[0])
    return Question(
        f"The contact point feels {si(felt, 'kg', 3)} of the striker, which arrives with "
        f"{si(settings.speed, 'm/s', 3)} and leaves with {rebound:.3g} of that. What "
        "is the area under the force? Where does the spectrum show it?",
        f"Mass times the change of speed, {si(momentum, 'N s', 3)}, unless the striker goes on vibrating itself. The "
        f"spectrum shows it at its left end: {si(low, 'N s', 3)}.", start,
    )  # fmt: skip


def _single(lesson: Lesson, axis: int) -> tuple[Position, Position] | None:
    """Two neighbours along an axis that hit once each, as near to the scene's blow as there are."""
    counts, start = lesson.quantity("n_impacts"), lesson.start

    places = [tuple(i if k == axis else start[k] for k in range(4)) for i in range(lesson.shape[axis])]
    pairs = sorted(pairwise(places), key=lambda pair: abs(pair[0][axis] + 0.5 - start[axis]))
    return next((pair for pair in pairs if counts[pair[0]] == counts[pair[1]] == 1), None)


def _stiffer(lesson: Lesson, one: Position, two: Position) -> Question:
    ratio = float(lesson.axes["stiffness"][two[2]] / lesson.axes["stiffness"][one[2]])
    power = lesson.setup.start.exponent
    time = lesson.quantity("contact_time")
    return Question(
        f"Make the contact {ratio:.3g} times stiffer, from {_stiffness(lesson, one[2])} to "
        f"{_stiffness(lesson, two[2])} the scene's stiffness. By which factor does the contact get shorter? What would "
        "a rigid wall do?",
        f"{float(time[two] / time[one]):.3g}. On a rigid wall the contact time goes with the stiffness to the power "
        f"−1/(n + 1), n being the exponent {power:.3g}: {ratio ** (-1.0 / (power + 1.0)):.3g}.", two,
    )  # fmt: skip


def _stiffness(lesson: Lesson, i: int) -> str:
    return f"{float(lesson.axes['stiffness'][i]):.3g} times"


def _faster(lesson: Lesson, one: Position, two: Position) -> Question:
    slow, fast = (float(lesson.axes["speed"][each[1]]) for each in (one, two))
    power, force = lesson.setup.start.exponent, lesson.quantity("peak_force")
    wall = (fast / slow) ** (2.0 * power / (power + 1.0))
    return Question(
        f"Strike with {si(fast, 'm/s', 3)} instead of {si(slow, 'm/s', 3)}. By which factor does the force grow?",
        f"{float(force[two] / force[one]):.3g}; on a rigid wall by the ratio of the speeds to the power 2n/(n + 1), "
        f"{wall:.3g}. Only a linear contact, n = 1, makes the force grow as the speed does, and its pulse keep its "
        "shape.", two,
    )  # fmt: skip


def _heavier(lesson: Lesson) -> Question | None:
    place_, speed, stiffness, mass = lesson.start
    counts = lesson.quantity("n_impacts")[place_, speed, stiffness]
    changes = np.flatnonzero((counts[:-1] == 1) != (counts[1:] == 1))  # positions before them
    if not len(changes):
        always = counts[mass]
        return Question(
            "Move the mass from its lowest to its highest value. Does the number of impacts change?",
            f"It does not: {_phrases(lesson, lesson.start)['impacts']} at "
            f"{'each' if (counts == always).all() else 'most'} of them.", lesson.start,
        )  # fmt: skip
    here = int(changes[0])
    lower, upper = (
        f"{_phrases(lesson, (place_, speed, stiffness, i))['impacts']} at {_mass(lesson, i)}" for i in (here, here + 1)
    )
    return Question(
        "Move the mass from its lowest to its highest value. Between which positions does the number of impacts first "
        "change between one and another? Find the same border on the map.",
        f"{lower}, and {upper}.", (place_, speed, stiffness, here + 1),
    )  # fmt: skip


def _harder(lesson: Lesson) -> Question | None:
    place_, speed, _, mass = lesson.start
    limit = float(lesson.limits[place_, mass])
    soft, hard = ((place_, speed, i, mass) for i in (0, lesson.shape[2] - 1))
    below, above = (lesson.setup.case(lesson.settings(*each)).resonance for each in (soft, hard))
    if not below < limit < above:
        return None
    return Question(
        f"The body stops a striker of {_mass(lesson, mass)} once the contact resonance, {si(below, 'Hz', 3)} with the "
        f"softest and {si(above, 'Hz', 3)} with the hardest contact, is above a threshold: the dashed line. How many "
        "impacts are there with the softest and with the hardest contact?",
        f"{_phrases(lesson, soft)['impacts']} and {_phrases(lesson, hard)['impacts']}; the threshold lies at "
        f"{si(limit, 'Hz', 3)}.", hard,
    )  # fmt: skip


def spectrum(lesson: Lesson, position: Position) -> np.ndarray:
    """Magnitude of the spectrum [N s] of a blow as the page holds it, (SPECTRUM_POINTS,) over BAND."""
    blow = lesson.blows[int(np.ravel_multi_index(position, lesson.shape))]
    band = np.geomspace(*BAND, SPECTRUM_POINTS)
    return force_spectrum.magnitude(blow.end / STEPS * blow.time, blow.top / STEPS * blow.force, band)


def _spectrum(lesson: Lesson, one: Position, two: Position) -> Question | None:
    reach = []  # [Hz]
    for each in (one, two):
        found = spectrum(lesson, each)
        below = np.flatnonzero(found < 0.1 * found.max())
        below = below[below > found.argmax()]
        if not len(below):
            return None
        reach.append(float(np.geomspace(*BAND, SPECTRUM_POINTS)[below[0]]))
    times = [float(lesson.quantity("contact_time")[each]) for each in (one, two)]
    return Question(
        f"At which frequency has the spectrum first fallen to a tenth, with {_stiffness(lesson, one[2])} and with "
        f"{_stiffness(lesson, two[2])} the scene's stiffness? What is that frequency times the contact time?",
        f"{si(reach[0], 'Hz', 3)} and {si(reach[1], 'Hz', 3)}; times the contact time {reach[0] * times[0]:.2g} and "
        f"{reach[1] * times[1]:.2g}. A shorter pulse excites higher modes, and the blow sounds brighter.", two,
    )  # fmt: skip


def _elsewhere(lesson: Lesson) -> Question | None:
    if len(lesson.places) < 2:
        return None
    _, *rest = lesson.start
    positions = [(i, rest[0], rest[1], rest[2]) for i in range(len(lesson.places))]
    rebounds = [float(lesson.quantity("restitution")[each]) for each in positions]
    if any(map(math.isnan, rebounds)):
        return None
    best = int(np.argmax(rebounds))
    listed = ", ".join(
        f"{value:.3g} at {place(where)}".replace("-", "−") for value, where in zip(rebounds, lesson.places)
    )
    return Question(
        "Strike at each place, as the scene does otherwise. Where does the striker rebound best? Why there?",
        f"At {place(lesson.places[best])}. The share of the speed that is left is {listed}. Where the body moves less, "
        "less of the energy stays in it.", positions[best],
    )  # fmt: skip
