"""Writes the force of a blow, and what it moves, as other programs read them: Nastran, Abaqus, and modal testing."""

from pathlib import Path
from typing import Any

import numpy as np

from .._base import check
from .._base.files import replacing
from .._base.rounding import ROUNDING, SAME
from ..impact.response import Response
from ..modes import universal_files

ENDINGS = (".op4", ".uff", ".unv", ".bdf", ".inp")
MODAL = ".uff", ".unv"
WAYS = "x", "y", "z", "-x", "-y", "-z"


@check.typed
def write_history(
    path: str | Path, response: Response, times: Any = None, *, at: Any = None, node: int = 1, direction: str = "z",
    numbers: Any = None,
) -> None:  # fmt: skip
    """Write the contact force over time, and the motion of points, for other programs to go on with.

    Parameters
    ----------
    path : path ending in
        ``.op4``, Nastran's matrices TIME (n_times, 1) [s], FORCE (n_times, n_contacts) [N] and, with ``at``, MOVE and
        VELO (n_times, n_points) [m, m/s]; ``.uff`` or ``.unv``, functions over time (data set 58; needs pyuff) of the
        same, for programs of modal testing; ``.bdf``, Nastran's TABLED1, TLOAD1 and FORCE; ``.inp``, Abaqus's
        \\*AMPLITUDE and \\*CLOAD. The last two hold the forces on the struck body alone, times [s] and
        values [N], and none after the last time.
    response : Response
    times : array_like, shape (n_times,) [s], optional
        By default those of ``response.time``; universal files need even ones.
    at : array_like, shape (n_points, dimension) [m], optional
        Points of the struck body, whose motion along the blow is written.
    node : int
        What the other program calls the node that is struck.
    direction : "x", "y", "z", or with a minus before it
        Of the blow, in the other program.
    numbers : sequence of int, optional
        What the other program calls the nodes ``at``; by default from 1.

    Raises
    ------
    ValueError
        If the path has another ending, or times are not even where they must be.

    Examples
    --------
    >>> hit = fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=None, speed=1.0)
    >>> fi.export.write_history("blow.bdf", hit, node=1017, direction="-z")
    """
    ending = check.ending(path, *ENDINGS)
    stamps = response.time if times is None else check.array("times", times, (None,), "s")
    if not (np.diff(stamps) > 0.0).all():
        stamps = np.unique(stamps)
    sign, way = divmod(WAYS.index(check.one_of("direction", direction, WAYS)), 3)
    way = (way + 1) * (1 - 2 * sign)  # as universal files count: 1 to 3, negative against the axis
    check.count("node", node)
    force = np.column_stack([response.history.force_at(stamps, i)[0] for i in range(response.history.n_contacts)])
    with replacing(path) as temporary:
        if ending in (".op4", *MODAL):
            moved = {}
            if at is not None:
                points = response.target.points("at", at)
                moved = {"MOVE": response.displacement(points, stamps), "VELO": response.velocity(points, stamps)}
            if ending == ".op4":
                temporary.write_text(_op4({"TIME": stamps[:, None], "FORCE": force, **moved}), encoding="ascii")
            else:
                n = moved["MOVE"].shape[1] if moved else 0
                names = np.arange(1, n + 1) if numbers is None else check.array("numbers", numbers, (n,)).astype(int)
                _universal(temporary, stamps, force, moved, (node, way, names))
        else:
            write = _nastran if ending == ".bdf" else _abaqus
            # beyond its last two points a table goes on straight in Nastran, and stays at the last in Abaqus
            step = float(np.diff(stamps)[-1:].sum()) or 1.0
            stamps = np.append(stamps, stamps[-1:].sum() + np.array([step, 2.0 * step]))
            mine = dict(response.ends[-1].touched) if response.ends else dict.fromkeys(range(force.shape[1]), -1.0)
            force = np.vstack([force, np.zeros((2, force.shape[1]))])[:, list(mine)] * -np.array(list(mine.values()))
            temporary.write_text(write(stamps, force, node, way), encoding="ascii")


def _op4(matrices: dict[str, np.ndarray]) -> str:
    """Matrices as Nastran's OUTPUT4 writes them in text, dense, in double precision."""
    lines = []
    for name, matrix in matrices.items():
        n_rows, n_columns = matrix.shape
        lines.append(f"{n_columns:8d}{n_rows:8d}{2:8d}{2:8d}{name:<8}1P,3E23.16")  # rectangular, double precision
        for i, column in enumerate(matrix.T):
            lines.append(f"{i + 1:8d}{1:8d}{2 * n_rows:8d}")
            values = [f"{value:23.16E}" for value in column]
            lines += ["".join(values[k : k + 3]) for k in range(0, n_rows, 3)]
        lines += [f"{n_columns + 1:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    return "\n".join([*lines, ""])


def _universal(path: Path, times: np.ndarray, force: np.ndarray, moved: dict[str, np.ndarray], where: tuple) -> None:
    """Functions over time, data set 58: the force and then the motion of each point."""
    pyuff = check.extra("pyuff", "uff", "a universal file")
    steps = np.diff(times)
    if len(times) < 2 or np.ptp(steps) > SAME * steps.mean() + ROUNDING * np.abs(times).max():
        raise ValueError("times must be even for a universal file; give times=np.linspace(start, end, n)")
    node, way, numbers = where
    channels = [("force", 13, node, values, "N") for values in force.T]  # the format's kinds of data are numbered
    for name, kind, label, unit in (("MOVE", 8, "displacement", "m"), ("VELO", 11, "velocity", "m/s")):
        channels += [(label, kind, n, values, unit) for n, values in zip(numbers, moved.get(name, np.zeros((0, 0))).T)]
    sets = [
        universal_files.function(label, int(number), way, times, np.asarray(values, float)) | {
            "id2": "fem_impact", "func_type": 1, "ver_num": 1, "ref_node": int(node), "ref_dir": way,
            "ord_data_type": 4, "abscissa_spec_data_type": 17, "abscissa_axis_lab": "Time",
            "abscissa_axis_units_lab": "s", "ordinate_spec_data_type": kind, "ordinate_axis_lab": label,
            "ordinate_axis_units_lab": unit,
        }
        for label, kind, number, values, unit in channels
    ]  # fmt: skip
    pyuff.UFF(str(path)).write_sets(sets, mode="add")


def _nastran(times: np.ndarray, force: np.ndarray, node: int, way: int) -> str:
    """A table of time and force for each contact, and the load on a node: load set 1 of a transient solution."""
    lines = ["$ contact force of a blow, s and N; ask for it by DLOAD = 1 in the case control"]
    loads = "".join(f"{1.0:8.1f}{10 + i:8d}" for i in range(force.shape[1]))
    lines.append(f"DLOAD   {1:8d}{1.0:8.1f}{loads}")
    x, y, z = (float(np.sign(way)) if axis == abs(way) else 0.0 for axis in (1, 2, 3))
    for i, values in enumerate(force.T):
        table, load = 100 + i, 10 + i
        lines.append(f"TLOAD1  {load:8d}{1000 + i:8d}{'':8}{'LOAD':>8}{table:8d}")
        lines.append(f"FORCE   {1000 + i:8d}{node:8d}{0:8d}{1.0:8.1f}{x:8.1f}{y:8.1f}{z:8.1f}")
        lines.append(f"TABLED1*{table:16d}{'':48}*")
        numbers = [f"{value:16.9E}" for pair in zip(times, values) for value in pair] + [f"{'ENDT':>16}"]
        rows = ["".join(numbers[k : k + 4]) for k in range(0, len(numbers), 4)]
        lines += ["*" + " " * 7, *[f"*       {row:<64}*" for row in rows[:-1]], f"*       {rows[-1]}"]
    return "\n".join([*lines, ""])


def _abaqus(times: np.ndarray, force: np.ndarray, node: int, way: int) -> str:
    """An amplitude for each contact, and the concentrated load that follows it, to be put into a step."""
    lines = ["** contact force of a blow, s and N"]
    for i, values in enumerate(force.T):
        lines.append(f"*AMPLITUDE, NAME=BLOW{i + 1}")
        lines += [f"{time:.9E}, {value:.9E}" for time, value in zip(times, values)]
    for i in range(force.shape[1]):
        lines += [f"*CLOAD, AMPLITUDE=BLOW{i + 1}", f"{node}, {abs(way)}, {np.sign(way)}."]
    return "\n".join([*lines, ""])
