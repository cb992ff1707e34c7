"""What the runs share: named tuples of the arrays that their kernels pass on."""

from typing import NamedTuple

import numpy as np


class KernelSystem(NamedTuple):
    """What a run starts from: the modes of all bodies in one list, and their contacts."""

    omega: np.ndarray  # (n_modes,) [rad/s]
    zeta: np.ndarray  # (n_modes,) [-]
    shape: np.ndarray  # (n_contacts, n_modes) [kg**-0.5] signed shapes at the contacts
    offset: np.ndarray  # (n_contacts,) [m] approach at zero state
    bias: np.ndarray  # (n_modes,) [N kg**-0.5] constant modal forces
    law: np.ndarray  # (n_contacts,) of `law.LAW`
    q: np.ndarray  # (n_modes,) state at the start
    p: np.ndarray  # (n_modes,)


class Limits(NamedTuple):
    """What is rounding, and when a run ends at the latest."""

    depth: float  # [m] approaches that are rounding
    still: float  # [m/s] speeds that are rounding
    horizon: float  # [s]
    max_impacts: int  # releases after which to stop, 0 for any number
    max_steps: int
    misfit: float = np.inf  # [N s] what the force of a lossy contact may miss of its law in a step


class KernelRun(NamedTuple):
    """The arrays of a run, few because each one costs time to hand over; `frame` cuts the following from them."""

    q: np.ndarray  # (n_modes,) state
    p: np.ndarray  # (n_modes,)
    modes: np.ndarray  # (3, n_modes)
    contacts: np.ndarray  # (CONTACT_ROWS, n_contacts)
    law: np.ndarray  # (n_contacts,) of `law.LAW`
    clock: np.ndarray  # (CLOCKS + 6,)
    counts: np.ndarray  # (COUNTERS,)


class Bodies(NamedTuple):
    """All modes, each (n_modes,), and how they move."""

    omega: np.ndarray
    zeta: np.ndarray
    twice: np.ndarray  # 2 zeta omega
    shape: np.ndarray  # (n_contacts, n_modes)
    bias: np.ndarray
    q: np.ndarray
    p: np.ndarray
    free_q: np.ndarray  # where the step would end if nothing pushed
    free_p: np.ndarray


class Contacts(NamedTuple):
    """All contacts, each (n_contacts,): at the start of a step, and as a try of it found them at its end."""

    law: np.ndarray  # (n_contacts,) of `law.LAW`
    offset: np.ndarray  # [m] grows less as a contact is dented
    now: np.ndarray  # (6, n_contacts) where they stand
    pressed: np.ndarray  # whether they are
    free: np.ndarray  # (3, n_contacts) where they would end if nothing pushed
    end: np.ndarray  # [m] approach at the end
    rate: np.ndarray  # [m/s] and its rate
    force: np.ndarray  # [N] mean force
    slope: np.ndarray  # [N] what it gains over the step
    after: np.ndarray  # what is remembered at the end


class Course(NamedTuple):
    """How far a run is; the columns are named in `layout`."""

    clock: np.ndarray  # times
    counts: np.ndarray  # counters
    bracket: np.ndarray  # (6,) about the end of the step that is sought
    done: np.ndarray  # (n_contacts,) [J] integral of force times rate


class Tables(NamedTuple):
    """Steps base * 2**-level of the energy-exact schemes, one of any other length, and where they are worked out.

    Those of a run end with its flights.
    """

    lanes: np.ndarray  # (n_tables, N_LANE, n_modes), see `propagation.lane_table`
    sums: np.ndarray  # (n_levels, 6, n_contacts, n_contacts), see `exact.contact_sums`
    known: np.ndarray  # (n_tables,) whether they are there
    work: np.ndarray  # (5, n, n)
    base: float  # [s] longest step
    ramp: int | np.int64  # 1 for scheme A4, 0 for A


class Flights(NamedTuple):
    """Steps base * 2**k of free flight; `flight.find_onset`."""

    lanes: np.ndarray  # (GLIDES + 1, N_LANE, n_modes)
    known: np.ndarray  # (GLIDES + 1,)
    base: float  # [s]
    shortest: float  # [s] looks ahead that lead hardly on


class Pairs(NamedTuple):
    """Many blows at unit speed, each between two bodies."""

    shares: np.ndarray  # (2, n_cells) [-] of the kernels of target and striker
    law: np.ndarray  # (n_cells,) of `law.LAW`, power laws
    rigid: np.ndarray  # (n_cells,) [1/kg] squared shapes of all rigid motions
    static: np.ndarray  # (n_cells,) [m/N] static compliance of all flexible ones
    slack: np.ndarray  # (n_cells,) [-] part of the deepest approach that a touch or a gap must exceed to be sure


class Kernels(NamedTuple):
    """What forces do to target and striker of unit mass, for steps of one length."""

    rows: tuple[np.ndarray, ...]  # (6, n_steps) each, see `convolution`
    # (SPLITS + LEVELS, 2, 2) what a unit of the force's jumps and of its bends adds at most to the errors of
    # `cubics.surely_parted` for looks of 1/4, 1/2, 1, 2, 4, ... steps
    bounds: tuple[np.ndarray, ...]
    # (2**SPLITS - 1, 4, n_steps) the kernels without means 1/4, 2/4, ... of a step later; or without steps, where a
    # doubt in flight ends a blow as if it were too long
    later: tuple[np.ndarray, ...]
    # (11, n_modes) of both bodies: the first eight rows of `propagation.step_table`, then frequency [rad/s], damping
    # ratio and squared shape at unit mass
    modes: tuple[np.ndarray, ...]


class Track(NamedTuple):
    """One blow as far as it is followed."""

    rows: np.ndarray  # (6, n_steps) kernel of both bodies, reversed in time, as far as it is known
    force: np.ndarray  # (n_steps,) [N] mean of each step
    ramp: np.ndarray  # (n_steps,) [N] what it gains over the step
    ends: np.ndarray  # (n_steps + 1,) [m] approach at the end of each step, mended
    rates: np.ndarray  # (n_steps + 1,) [m/s]
    segments: np.ndarray  # (n_steps + 1, 2) first step of each contact, and the one after its last
    contacts: np.ndarray  # (n_steps + 1, 2) [s] when each contact began and ended
    state: np.ndarray  # (BLOW_STATES,) the columns are named in `layout`
    counts: np.ndarray  # (BLOW_COUNTS,)
    missed: np.ndarray  # (SPLITS + LEVELS, 2) errors of `cubics.surely_parted` in this flight
    moved: np.ndarray  # (2, 2, n_modes or more) motion of both bodies' modes, by a unit of their shape
