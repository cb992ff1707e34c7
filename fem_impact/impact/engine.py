"""One run of a system through the kernels."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from .._base.check import SimulationError
from .._base.rounding import EPSILON, ROUNDING
from .compiled import build, record
from .compiled.bundles import KernelSystem, Limits
from .compiled.energy import run_energy
from .compiled.law import Row, law_of
from .contact import acting_stiffness, wall_time
from .history import History
from .stretched import Stretched

TOLERANCE = 1e-4  # [-] default tolerance: below what contact laws and materials are known to
# [-] of the tolerance, what steps may err: two coarse runs agree by chance, and a single blow gains little by them
STEP_SHARE = 0.1
# [-] steps of a first run in half a swing on the steepest slope of a force with a course of its own; with fewer, two
# runs may both take the whole of an unloading in one step, and agree: contact times erred by 3e-3 and said 1e-5
STEEP = 8.0
# [-] speed that a step's force may miss of its law there, over that of approach times the cube of the step's share of
# the contact: of 300 random blows without it 44 were out of reach, with it none; of 1 600 one missed in silence
COARSE = 4.0
# [-] a contact's highest frequency over its lowest from which a body rattles on it; below, steps for the lowest resolve
# both, and a plate's many modes make neighbours of one frequency
RATTLES = 2.0
MAX_STEPS = 500_000  # [-] of one run: a time limit of about one second
# [-] modes, or entries of the forms of stretching, times steps of one run: a time limit of some seconds
MAX_WORK = 1_000_000_000
# [-] times per contact at which a flight is searched for near misses or two motions are compared, and their most
LOOKS = 16.0, 20_000
RECOUNTS = 8  # [-] runs at most until as many impacts ended as asked for; of 8 000 collisions five took two


class Pace(NamedTuple):
    """How fast a system's undisturbed contacts pass; the longest first step is infinite where all follow power laws.

    Such steps see how a contact opens that yields, and the hard layer of another: both may be far quicker than the
    whole.
    """

    duration: float  # [s] expected, of the shortest
    speed: float  # [m/s] of approach, the fastest
    longest_step: float = np.inf  # [s] the first of a run
    swings: tuple[float, ...] = ()  # [rad/s] frequencies of strikers in hands, which count as masses
    # [kg**-0.5 s/m] speed of the first body's first contact by the speeds of its rigid motions (n_rigid,), over that of
    # arrival
    rebound: tuple[float, ...] = ()
    struck: slice = slice(None)  # the modes of the last body, and those that stand for the ones left out


def steps_per_contact(tolerance: float, power: float = 0.25) -> float:
    """Steps per contact with which a scheme meets a tolerance in most blows; ``power`` is 1 / order, 1/4 of A4.

    A4 needs 24 for TOLERANCE: of 12 to 32, the cheapest first run.
    """
    return float(24.0 * (TOLERANCE / tolerance) ** power)


def run_system(
    system: KernelSystem, scheme: str, size: float, pace: Pace, last: tuple[float, int],
    stretched: Stretched | None = None, chosen_by: str = "tolerance", within: float = 0.0,
) -> History:  # fmt: skip
    """One run up to the ``last`` time [s] and number of impacts, 0 for any.

    ``size`` is the step in contact [s], ``chosen_by`` what it comes from. Steps are shorter where a lossy force changes
    faster than in a contact of the duration ``within`` [s], unless that is zero.
    """
    most, stretch = most_steps(system, stretched), None
    for array in system:
        array.setflags(write=False)  # or numba would compile the kernels again for writable arrays
    limits = Limits(
        float(EPSILON * pace.duration * pace.speed), float(ROUNDING * pace.speed), float(last[0]), last[1], most
    )
    if within:
        mobility = float(((system.shape**2) @ (system.zeta < 1.0)).max())
        limits = limits._replace(misfit=float(COARSE * pace.speed * (size / within) ** 3) / mobility)
    if stretched is not None:
        stretched = replace(stretched, base=float(size), ramp=scheme == "A4")
        stretch = stretched.kernel
    for _ in range(RECOUNTS):
        if build.ALLOWED.get() <= 0.0:
            raise build.Uncompiled
        result = run_energy(system, stretch, int(scheme == "A4"), float(size), limits)
        history = History(*system, *(*result, stretched))
        time, status = result[5], result[6]
        build.ALLOWED.set(build.ALLOWED.get() - len(history.steps) / most)
        # kernels count every release, of pushes by rounding or for less than a step, too
        missing = last[1] - history.n_ended if status == record.IMPACTS else 0
        if missing <= 0:
            break
        limits = limits._replace(max_impacts=limits.max_impacts + missing)
    if status == record.EXHAUSTED:
        sooner = 0.1  # [-] of this run, what is advised: the last run of a blow halves the steps three times
        ended = int(np.ceil(sooner * np.count_nonzero(history.contacts[:, 1] < time)))
        raise SimulationError(
            f"no final separation was reached in {most} steps, up to {time:.4g} s; raise {chosen_by}, or give a "
            f"duration of at most {float(f'{sooner * time:.1e}'):g} s"
            + (f" or max_impacts of at most {ended}" if ended else "")
        )
    if status == record.FAILED:
        raise SimulationError(f"scheme {scheme} found no valid next step at {time:.4g} s; check the units of the scene")
    return history


def follow_again(history: History, step: float | None = None, **changed: Any) -> History:
    """The same blow with other modes or contacts, by A4 in steps [s] of its own, to compare with another such run.

    ``changed`` are fields of the system; without any, it is the blow to compare with. Steps are by default those of a
    first run.
    """
    before, pace = history.system, pace_of(history.system)
    stretched = changed.pop("stretched", history.stretched)
    system = before._replace(**changed)
    horizon = history.end_time if history.status == record.HORIZON else np.inf
    most = history.n_ended if history.status == record.IMPACTS else 0
    size = pace.duration / steps_per_contact(TOLERANCE) if step is None else step
    return run_system(system, "A4", size, pace, (horizon, most), stretched)


@np.errstate(over="ignore", divide="ignore")  # laws steeper than any number
def pace_of(system: KernelSystem, held: Sequence[int] = (), n_kept: int | None = None) -> Pace:
    """How fast its contacts pass; modes numbered ``held`` count as masses, though a hand makes them swing.

    Critically damped modes after the first ``n_kept`` stand for those left out, whose little mass is no body's: on a
    stiff contact it rattles in steps a hundredth of what the blow needs, and 200 random blows differ by their stated
    errors at most.
    """
    swings = tuple(float(system.omega[i]) for i in held)
    rate = system.omega * np.maximum(1.0, 2.0 * system.zeta)  # an overdamped mode acts as a dashpot, not as a mass
    if held:
        rate[held] = 0.0
    if n_kept is not None:
        rate[n_kept:][system.zeta[n_kept:] == 1.0] = np.inf
    order = rate.argsort(kind="stable")
    beyond = rate[order]
    beyond[:-1] = beyond[1:]
    beyond[-1] = np.inf
    last = beyond > rate[order]  # the last mode of each distinct frequency
    shortest, fastest, longest = np.inf, 0.0, np.inf
    for i, law in enumerate(map(Row._make, system.law.tolist())):
        k, exponent, compliance = law.stiffness, law.exponent, law.compliance
        mobile = (system.shape[i, order] ** 2).cumsum()[last]  # [1/kg] sum over the modes up to each
        moves = mobile > 0.0
        mobile, between = mobile[moves], (rate[order][last][moves], beyond[last][moves])
        if not mobile.size:
            continue
        approach = system.offset[i] + float(system.shape[i] @ system.q)
        if law.memory:
            approach -= float(law_of(law).sunk(law, np.array(law.memory), np.array(0.0)))
        pull = max(0.0, float(system.shape[i] @ system.bias))  # [m/s**2]
        speed = float(np.abs(system.shape[i]) @ np.abs(system.p))
        if pull:
            speed = max(speed, np.sqrt(2.0 * pull * max(0.0, -approach)))
            speed = max(speed, np.sqrt(pull * (pull / (k * mobile[-1])) ** (1.0 / exponent)))
        if approach > 0.0:
            speed = max(speed, approach * np.sqrt(k * approach ** (exponent - 1.0) * mobile[-1]))
        if speed == 0.0:
            continue
        free = wall_time(acting_stiffness(law, mobile, speed), exponent, mobile, speed, compliance)
        whole, lightest = _modes_as_masses(np.pi / free, *between)
        shortest = min(shortest, float(free[lightest]))
        if law.kind:
            swing = np.sqrt(law_of(law).steepest(law, 0.5 * speed**2 / mobile) * mobile)  # [rad/s]
            steep = float(max(swing[_modes_as_masses(swing, *between)[1]], swing[whole]))
            longest = min(longest, np.pi / (STEEP * steep)) if steep else longest
        fastest = max(fastest, float(speed))
    if not np.isfinite(shortest):
        k = system.law["stiffness"][0]
        return Pace(float(np.sqrt(1.0 / (k * max(1e-300, (system.shape[0] ** 2).sum())))), 1.0, longest, swings)
    return Pace(shortest, fastest, longest, swings)


def _modes_as_masses(frequency: np.ndarray, slower: np.ndarray, faster: np.ndarray) -> tuple[int, int]:
    """Up to which number modes are masses to a contact, of those that have its ``frequency`` [rad/s] if they are.

    It must lie above that of the last such mode, at ``slower``, and below the next, at ``faster``. The lowest such is
    how the bodies press each other; the second one returned is another only where a light body that bends rattles on a
    heavy one meanwhile, with the highest.
    """
    below = frequency < faster
    first, (possible,) = int(below.argmax()), (below & (frequency >= slower)).nonzero()
    rattles = len(possible) and frequency[possible[-1]] > RATTLES * frequency[first]
    return first, int(possible[-1]) if rattles else first


def most_steps(system: KernelSystem, stretched: Stretched | None) -> int:
    """Steps after which a run gives up."""
    if build.is_limited():  # the same time limit in plain Python, which is 3 000 times slower than the kernels
        return build.most_steps(max(100, 300_000 // len(system.omega)))
    work = len(system.omega) if stretched is None else stretched.forms.size
    return min(MAX_STEPS, max(1000, MAX_WORK // work))
