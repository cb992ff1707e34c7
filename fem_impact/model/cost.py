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
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import scipy.sparse as sp

from .._base.files import write_whole
from .._base.threads import one_thread
from ..fe.eigenvalues import factorise
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
# [-] unknowns of the elements that shrink towards the blow; triangles of a thick plate have more
AT_BLOW = {"argyris": 3000, "argyris and shear": 7500, "argyris and quartic": 13_000}
ELEMENTS = 5e7  # [byte] of the libraries for elements


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
        return self.on(this_machine() or REFERENCE)

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
        """Whether it is one that people use: if 20 times faster or slower, it was disturbed or its clock is coarse."""
        return all(1.0 / 20.0 < ratio < 20.0 for ratio in self.slower.values())


NOTHING = Work()
REFERENCE = Machine(sparse=0.045, dense=0.02, steps=0.008)  # [s] a virtual machine with two busy cores


def strikes(n_steps: float, n_modes: int) -> Work:
    """All runs of a strike; ``n_steps`` are those of the undisturbed contact, ``n_modes`` those of both bodies."""
    step = 2e-7 if build.COMPILED else 1.2e-4  # [s]; each mode takes 3.3 ns more
    all_runs = 20.0 * n_steps  # time steps, over those of one undisturbed contact
    return Work(steps=START + all_runs * (step + 3.3e-9 * n_modes), memory=2.1e8)  # the process with its libraries


def by_modes(n_dofs: float, n_modes: float) -> Work:
    """Modes on one mesh, their number checked; each takes four times the work of a Ritz vector."""
    return on_mesh(n_dofs, 4.0 * n_modes, n_modes)


def compliance(n_dofs: float) -> Work:
    """Static deflection that stands for the modes left out, on elements that shrink towards the blow."""
    return on_mesh(n_dofs, 2.0, 2.0) + Work(memory=ELEMENTS)


def grown_number(n_vectors: float, lasts: float) -> float:
    """Number of Ritz vectors that a blow needs which begins with ``n_vectors`` and ``lasts`` so many contacts.

    First vectors up to 120 suffice for a blow of up to four undisturbed contacts: later echoes need more. As the runs
    of studies/benchmarks/cost_predictions.py need, which compares the numbers predicted with those done.
    """
    return n_vectors * max(1.0, (n_vectors / 120.0) ** 0.3, (lasts / 4.0) ** 0.7)


def by_vectors(n_dofs: Sequence[float], n_vectors: float) -> Work:
    """Ritz vectors on several meshes of ``n_dofs`` unknowns, for a blow that ends with ``n_vectors``: `grown_number`.

    Each vector must be made orthogonal to all before, so that the work grows with the square of their number.
    """
    every = sum((on_mesh(n, n_vectors, n_vectors) for n in n_dofs), NOTHING)
    # [s] of all small eigenvalue problems, over their size cubed; three blows on the way to a tolerance
    return every + Work(dense=4e-9 * n_vectors**3, steps=3.0 * START, memory=ELEMENTS)


def on_mesh(n_dofs: float, n_solved: float, n_kept: float) -> Work:
    """Assembly, two factorisations and solutions, each made orthogonal to those before, on one mesh."""
    # [s] per unknown: assembly with the mesh, a factorisation, a solution and its product with another vector
    assembly, factors = 4.6e-5, 4.5e-6 + 1.05e-7 * math.sqrt(n_dofs)
    solution, product = 5.7e-7, 6e-10
    seconds = n_dofs * (assembly + 2.0 * factors + n_solved * (solution + 0.5 * product * n_kept))
    return Work(seconds, memory=n_dofs * (1e4 + 16.0 * n_solved))  # [byte] per unknown with its factors, and solution


@one_thread
def benchmark() -> Machine:
    """Measure this machine with small problems of each kind; takes a third of a second."""
    line = sp.diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(22, 22))  # 22 by 22 nodes of 6 unknowns
    coupled = sp.kron(sp.kron(line, line), np.ones((6, 6)))
    stiff = (coupled + 10.0 * 9.0 * 6.0 * sp.eye_array(coupled.shape[0])).tocsc()
    full = np.random.default_rng(0).normal(size=(700, 700))
    plate = analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=100.0, n_modes=300)
    mass, law = Striker.rigid(0.1), Contact.linear(1e4)

    def sparse() -> None:
        factors, solution = factorise(stiff), np.ones((stiff.shape[0], 1))
        for _ in range(30):
            solution = factors.solve(solution)

    def steps() -> None:  # 4000 of them; the contact lasts longer
        at, lasts = (0.465, 0.3), 0.5e-3
        collision.strike(plate, mass, law, at=at, speed=1.0, dt=lasts / 4000, duration=lasts, residual=False)

    found: list[float] = []
    for work in (sparse, lambda: full @ full, steps):
        found.append(math.inf)
        for _ in range(3):  # other programs on the machine only make it longer
            start = time.process_time()
            work()
            found[-1] = min(found[-1], time.process_time() - start)
    return Machine(*found)


def machine_in_words() -> str:
    """The machine that predicted seconds belong to, in words."""
    return "a typical machine (`fem-impact doctor` measures yours)" if this_machine() is None else "this machine"


def memory_installed() -> float:
    """Memory [byte] that this process can have: the machine's, or its own limit; infinite if not known."""
    found = math.inf
    with suppress(AttributeError, ValueError, OSError):  # Windows knows neither
        found = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    if resource is not None:
        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        found = found if limit == resource.RLIM_INFINITY else min(found, float(limit))
    return found


def calibrate() -> bool:
    """Measure this machine anew; return whether the result is credible and could be kept, or the kernels are not."""
    if machine_file() is None:
        return True
    found = benchmark()
    return found.credible and keep_machine(found)


def read_machine() -> Machine | None:
    """What was kept of this machine; None if there is nothing, or nothing credible."""
    path = machine_file()
    if path is None:
        return None
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        found = Machine(*(float(kept[field.name]) for field in fields(Machine)))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return found if kept.get("stamp") == _stamp() and found.credible else None


this_machine = cache(read_machine)  # the same as long as the process lives


def keep_machine(machine: Machine) -> bool:
    """Write a machine beside the compiled kernels; return whether that was possible."""
    path = machine_file()
    if path is None:
        return False
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps({"stamp": _stamp(), **asdict(machine)}))
        return True
    return False


def machine_file() -> Path | None:
    """File beside the compiled kernels; one for each machine and Python that share them. None if none are kept."""
    folder, user = build.folder(follow), f"{platform.node()} {platform.python_version()}"
    return None if folder is None else folder / f"speed-{hashlib.sha256(user.encode()).hexdigest()[:12]}.json"


def _stamp() -> str:
    """A digest of what the benchmark depends on: processor, libraries, kernels and itself."""
    about = platform.machine(), os.cpu_count(), platform.python_version(), np.__version__, scipy.__version__
    return hashlib.sha256(repr((about, build.STAMP, REFERENCE)).encode()).hexdigest()
