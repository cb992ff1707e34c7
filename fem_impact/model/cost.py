"""What a blow costs: processor time and memory by kind of target, at the speed of this machine.

The seconds below belong to a typical machine, which takes REFERENCE for a short benchmark. `calibrate`, of which
`fem-impact doctor` is the caller, finds how much slower this machine is at sparse, dense and compiled work, and keeps
that beside the compiled kernels. A plan reads what is kept there and measures nothing.
"""

import hashlib
import json
import math
import os
import platform
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import scipy.sparse as sp

from .._base.files import replacing
from ..fe.eigenvalues import factorise, one_thread
from ..impact import collision
from ..impact.compiled import build
from ..impact.compiled.energy import follow
from ..impact.contact import Contact
from ..impact.striker import Striker
from ..modes import analytic

resource: Any
try:
    import resource
except ImportError:  # Windows
    resource = None

START = 0.01  # [s] of a strike, besides its time steps
RUNS = 20.0  # [-] time steps of all runs of a strike, over those of one undisturbed contact
STEP, MODE_STEP = 2e-7, 3.3e-9  # [s] per time step, and per step and mode
PLAIN = 1.2e-4  # [s] per time step in plain Python, instead
ASSEMBLY = 4.6e-5  # [s] per unknown, with the mesh
FACTORS = 4.5e-6, 1.05e-7  # [s] per unknown of a factorisation, and per unknown times the root of their number
SOLVE, TURN = 5.7e-7, 6e-10  # [s] per unknown of a solution, and of making it orthogonal to another vector
DENSE = 4e-9  # [s] of all small eigenvalue problems, over their size cubed
AIR = 1e-4  # [s] of the air around a plate, per mode squared
# [-] time steps of collocation per contact at a tolerance of 1e-9, power of 1e-9 / tolerance with which they grow, and
# work of each over that of another scheme's step
COLLOCATED = 300.0, 0.2, 10.0
LANCZOS = 4.0  # [-] work per mode, over that per Ritz vector
ATTEMPTS = 3.0  # [-] blows on the way to a tolerance
# As the runs of studies/cost_predictions.py need; it compares the numbers predicted with those done.
GROWN = 120.0, 0.3  # [-] first vectors up to this number suffice; if more, the number grows by this power of the ratio
LONG = 4.0, 0.7  # [-] the same over the length of the blow, in undisturbed contacts: later echoes need more vectors
# [-] unknowns of the elements that shrink towards the blow; triangles of a thick plate have more
AT_BLOW = {"argyris": 3000, "argyris and shear": 7500}
PER_MODE = 65.0  # [-] unknowns per mode found for motion and sound: 40 at 1.8 rad per triangle, 108 at 1.1
# [-] frequency times contact time up to which modes for motion and sound are counted: 16 of a half sine, less of
# smoother forces
FAINTEST = 8.0
LONGEST = 100.0  # [-] a blow is followed up to so many undisturbed contacts; the cost of longer ones is told too low
MANY = 2  # [-] impacts up to which two meshes suffice; each multiplies the error that a mesh makes before it
PROCESS, ELEMENTS = 2.1e8, 5e7  # [byte] of the process with its libraries, and of those for elements
PER_UNKNOWN, PER_PAIR = 1e4, 16.0  # [byte] per unknown with its factors; per unknown and solution
REPEATS = 3  # [-] times that the benchmark runs; the fastest counts
GRID, WIDTH, SOLUTIONS = 22, 6, 30  # [-] nodes per side, unknowns per node and solutions of the sparse benchmark
SQUARE, MODES, STEPS = 700, 300, 4000  # [-] size of the product of the benchmark; modes and time steps of its strike
BELIEVED = 20.0  # [-] a machine that is so many times faster or slower was disturbed, or its clock is too coarse


@dataclass(frozen=True)
class Work:
    """Processor time by kind of work, on the machine of REFERENCE, and memory."""

    sparse: float = 0.0  # [s] assembly, factorisations, solutions
    dense: float = 0.0  # [s]
    steps: float = 0.0  # [s] strikes
    memory: float = 0.0  # [byte]

    def __add__(self, other: "Work") -> "Work":
        return Work(*(getattr(self, field.name) + getattr(other, field.name) for field in fields(self)))

    @property
    def seconds(self) -> float:
        """Processor time [s] on this machine if it has been measured, else on a typical one."""
        return self.on(known() or REFERENCE)

    def on(self, machine: "Machine") -> float:
        """Processor time [s] on a machine."""
        return sum(getattr(self, name) * ratio for name, ratio in machine.slower.items())


@dataclass(frozen=True)
class Machine:
    """Processor time [s] of the parts of the benchmark."""

    sparse: float
    dense: float
    steps: float

    @property
    def slower(self) -> dict[str, float]:
        """How many times slower than that of REFERENCE this machine is at each kind of work."""
        return {name: value / getattr(REFERENCE, name) for name, value in asdict(self).items()}

    @property
    def credible(self) -> bool:
        """Whether it is one that people use."""
        return all(1.0 / BELIEVED < ratio < BELIEVED for ratio in self.slower.values())


NOTHING = Work()
REFERENCE = Machine(sparse=0.045, dense=0.02, steps=0.008)  # [s] a virtual machine with two busy cores


def strikes(n_steps: float, n_modes: int) -> Work:
    """All runs of a strike; ``n_steps`` are those of the undisturbed contact, ``n_modes`` those of both bodies."""
    step = (STEP if build.COMPILED else PLAIN) + MODE_STEP * n_modes
    return Work(steps=START + RUNS * n_steps * step, memory=PROCESS)


def in_air(n_modes: float) -> Work:
    """Air around the modes of a plate."""
    return Work(dense=AIR * n_modes**2)


def collocated(tolerance: float) -> float:
    """Time steps of an undisturbed contact as `strikes` takes them, by collocation to a tolerance."""
    return COLLOCATED[0] * (1e-9 / tolerance) ** COLLOCATED[1] * COLLOCATED[2]


def by_modes(n_dofs: float, n_modes: float) -> Work:
    """Modes on one mesh, their number checked."""
    return on_mesh(n_dofs, LANCZOS * n_modes, n_modes)


def compliance(n_dofs: float) -> Work:
    """Static deflection that stands for the modes left out, on elements that shrink towards the blow."""
    return on_mesh(n_dofs, 2.0, 2.0) + Work(memory=ELEMENTS)


def grown(n_vectors: float, lasts: float) -> float:
    """Number of Ritz vectors that a blow needs which begins with ``n_vectors`` and ``lasts`` so many contacts."""
    return n_vectors * max(1.0, (n_vectors / GROWN[0]) ** GROWN[1], (lasts / LONG[0]) ** LONG[1])


def by_vectors(n_dofs: Sequence[float], n_vectors: float, lasts: float) -> Work:
    """Ritz vectors on several meshes of ``n_dofs`` unknowns, for a blow that begins with ``n_vectors``; see `grown`.

    Each vector must be made orthogonal to all before, so that the work grows with the square of their number.
    """
    n_vectors = grown(n_vectors, lasts)
    every = sum((on_mesh(n, n_vectors, n_vectors) for n in n_dofs), NOTHING)
    return every + Work(dense=DENSE * n_vectors**3, steps=ATTEMPTS * START, memory=ELEMENTS)


def on_mesh(n_dofs: float, n_solved: float, n_kept: float) -> Work:
    """Assembly, two factorisations and solutions, each made orthogonal to those before, on one mesh."""
    factors = 2.0 * (FACTORS[0] + FACTORS[1] * math.sqrt(n_dofs))
    sparse = n_dofs * (ASSEMBLY + factors + n_solved * (SOLVE + 0.5 * TURN * n_kept))
    return Work(sparse, memory=n_dofs * (PER_UNKNOWN + PER_PAIR * n_solved))


@one_thread
def benchmark() -> Machine:
    """Measure this machine with small problems of each kind; takes a third of a second."""
    line = sp.diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(GRID, GRID))
    coupled = sp.kron(sp.kron(line, line), np.ones((WIDTH, WIDTH)))
    stiff = (coupled + 10.0 * 9.0 * WIDTH * sp.eye_array(coupled.shape[0])).tocsc()
    full = np.random.default_rng(0).normal(size=(SQUARE, SQUARE))
    plate = analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=100.0, n_modes=MODES)
    mass, law = Striker.rigid(0.1), Contact.linear(1e4)
    lasts = 0.5e-3  # [s] the contact lasts longer

    def sparse() -> None:
        factors, solution = factorise(stiff), np.ones((stiff.shape[0], 1))
        for _ in range(SOLUTIONS):
            solution = factors.solve(solution)

    def steps() -> None:
        at = (0.465, 0.3)
        collision.strike(plate, mass, law, at=at, speed=1.0, dt=lasts / STEPS, duration=lasts, residual=False)

    return Machine(sparse=_fastest(sparse), dense=_fastest(lambda: full @ full), steps=_fastest(steps))


def _fastest(work: Callable[[], object]) -> float:
    """Shortest processor time [s] of several runs: other programs on the machine only make it longer."""
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


@cache
def known() -> Machine | None:
    """This machine as measured before, None if it was not; the same as long as the process lives."""
    return read()


def whose() -> str:
    """The machine that predicted seconds belong to, in words."""
    return "a typical machine (`fem-impact doctor` measures yours)" if known() is None else "this machine"


def installed() -> float:
    """Memory [byte] that this process can have: the machine's, or its own limit; infinite if not known."""
    found = math.inf
    with suppress(AttributeError, ValueError, OSError):  # Windows tells neither
        found = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    if resource is not None:
        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        found = found if limit == resource.RLIM_INFINITY else min(found, float(limit))
    return found


def calibrate() -> bool:
    """Measure this machine anew; return whether the result is credible and could be kept, or the kernels are not."""
    if place() is None:
        return True
    found = benchmark()
    return found.credible and keep(found)


def read() -> Machine | None:
    """What was kept of this machine; None if there is nothing, or nothing credible."""
    path = place()
    if path is None:
        return None
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        found = Machine(*(float(kept[field.name]) for field in fields(Machine)))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return found if kept.get("stamp") == _stamp() and found.credible else None


def keep(machine: Machine) -> bool:
    """Write a machine beside the compiled kernels; return whether that was possible."""
    path = place()
    if path is None:
        return False
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            temporary.write_text(json.dumps({"stamp": _stamp(), **asdict(machine)}), encoding="utf-8")
        return True
    return False


def place() -> Path | None:
    """File beside the compiled kernels; one for each machine and Python that share them. None if none are kept."""
    folder, user = build.folder(follow), f"{platform.node()} {platform.python_version()}"
    return None if folder is None else folder / f"speed-{hashlib.sha256(user.encode()).hexdigest()[:12]}.json"


def _stamp() -> str:
    """A digest of what the benchmark depends on: processor, libraries, kernels and itself."""
    about = platform.machine(), os.cpu_count(), platform.python_version(), np.__version__, scipy.__version__
    return hashlib.sha256(repr((about, build.STAMP, REFERENCE)).encode()).hexdigest()
