"""Compiles the inner loops before any test needs them, several at a time: each compiles in a process of its own."""

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np


def strike(**how):
    """A short blow, whose kernels are then on disk."""
    import fem_impact as fi

    section = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 1e-3)
    plate = fi.analytic.rectangle(0.2, 0.3, section=section, n_modes=20)
    law = fi.Contact.hertz(1e6)
    return fi.strike(plate, fi.Striker.rigid(0.02), law, at=(0.09, 0.13), speed=1.0, tolerance=1e-2, **how)


def blow():
    """A blow, and what is asked of it afterwards."""
    hit = strike()
    hit.summary()
    hit.displacement([(0.1, 0.1)], [0.0, 1e-4])


def stretching():
    """A plate that stretches."""
    strike(stretching=True).displacement([(0.1, 0.1)], [0.0, 1e-4])


def many():
    """Many blows at once."""
    from fem_impact import doctor

    doctor.compile_map()


SMOKING = (blow,), (many,)  # longest first
TASKS = (*SMOKING, (stretching,))


def compile_all(tasks):
    """Compile what is not on disk yet."""
    with ProcessPoolExecutor(min(len(tasks), os.cpu_count() or 1), get_context("spawn")) as pool:
        for task in [pool.submit(*task) for task in tasks]:
            task.result()


def locked(*arrays):
    """Copies that cannot be written to, as a blow's own arrays: for others the kernels would be compiled once more."""
    copies = [np.array(each, each.dtype if isinstance(each, np.ndarray) else float, order="C") for each in arrays]
    for copy in copies:
        copy.setflags(write=False)
    return copies
