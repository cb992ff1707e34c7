"""A body given by its matrices, whole or reduced: its modes, its mass, and its deflections under static loads.

Unknowns are motions of nodes or anything else that moves the body, such as the modes of a Craig-Bampton reduction. The
recovery R turns them into displacements of nodes, so a force F at nodes acts on them as R.T F, and rigid motions r of a
free body are those for which R r is one of a rigid body and K r vanishes.

References
----------
Craig and Bampton (1968), AIAA J. 6, 1313-1319.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.linalg import eigh, qr
from scipy.sparse import coo_array, csc_array, csc_matrix, issparse

from .._base import check
from .._base.rounding import ROUNDING, rounded_by
from ..fe.eigenvalues import Flexibility, lowest
from . import cell_kinds
from .free_body import FITS, motions

ALL = 600  # [-] unknowns up to which all modes are found, and all unit loads on nodes solved: a second together
KEPT = 1e-7  # [-] of the terms of a sum that cancel, what may be left: files keep at least nine digits
KINDS = "mass", "stiffness"
INDEFINITE = (
    "stiffness must be positive, mass not negative, apart from rigid motions of the whole body ({}); write more "
    "digits, or leave out unknowns that nothing holds"
)


def solve_matrices(fields: Mapping[str, Any], loads: Any = None, n_modes: int | None = None) -> dict[str, Any]:
    """Fields of a `Body` of which ``mass_matrix``, ``stiffness_matrix`` and ``nodes`` are given.

    Parameters
    ----------
    fields : dict
        With ``dofs``, ``recovery``, ``numbers`` and ``mass`` as of `Body.from_matrices`. ``frames`` (n_nodes, 3, 3) are
        axes of nodes, by rows, where directions are along others than x, y and z.
    loads : as of `Body`
    n_modes : int, optional
    """
    M, K = _symmetric(fields)
    nodes = check.array("nodes", fields.get("nodes", ()), (None, 3), "m")
    given = np.arange(1, len(nodes) + 1) if fields.get("numbers") is None else fields["numbers"]
    numbers = check.array("numbers", given, (len(nodes),)).astype(int)
    turned = _directions(fields, numbers, M.shape[0])
    R = _recovery(fields, turned, len(nodes), M.shape[0])
    kept = np.flatnonzero(np.asarray(abs(R).sum(axis=1)).reshape(-1, 3).any(axis=1))
    # nothing resists or moves the others
    used = np.flatnonzero(np.asarray(abs(M).sum(axis=0) + abs(K).sum(axis=0)) * ~_supported(M, K, turned))
    M, K, R = M[used][:, used], K[used][:, used], R[(3 * kept[:, None] + np.arange(3)).ravel()][:, used].tocsc()
    if turned is not None:
        turned = turned[(6 * kept[:, None] + np.arange(6)).ravel()][:, used]
    flexibility = _flexibility(M, K, turned, nodes[kept])
    rigid, most = flexibility.rigid, len(flexibility.inertial) - flexibility.rigid.shape[1]
    wanted = (most if len(used) <= ALL else 100) if n_modes is None else check.count("n_modes", n_modes)
    wanted -= 0 if n_modes is None else rigid.shape[1]
    loads, pushed = _loaded(numbers[kept], loads, turned if len(used) <= ALL else None)
    try:
        values, vectors = lowest(flexibility, min(max(wanted, 0), most))
        forces = R.T @ pushed
        if len(values) + rigid.shape[1] == len(used):  # then modes give it, with the rounding of what they carry
            static = (vectors / values) @ (vectors.T @ forces)
        else:
            static = flexibility.solve(forces) if len(loads) else forces
    except (np.linalg.LinAlgError, RuntimeError) as error:
        raise ValueError(INDEFINITE.format(check.line(str(error)))) from None
    if len(values) and values[0] <= 0.0:
        raise ValueError(INDEFINITE.format(f"an eigenvalue is {values[0]:.3g} 1/s^2"))
    found = {
        "frequencies": np.concatenate([np.zeros(rigid.shape[1]), np.sqrt(values) / (2.0 * np.pi)]),
        "shapes": (R @ np.column_stack([rigid, vectors])).reshape(len(kept), 3, -1),
        "static": (R @ static).reshape(len(kept), 3, -1), "loads": loads,
        "nodes": nodes[kept], "numbers": numbers[kept],
    }  # fmt: skip
    # the mass that shifts move, the same along x, y and z to a thousandth: rigid motions are mass-normalised
    moved, wanted_shifts = R @ rigid, np.tile(np.eye(3), (len(kept), 1))
    share = np.linalg.lstsq(moved, wanted_shifts, rcond=1e-5)[0]  # a bar turning about itself moves no node
    shifts = np.abs(moved @ share - wanted_shifts).max(axis=0) < 1e-3
    masses = np.square(share[:, shifts]).sum(axis=0)
    own = float(masses.mean()) if shifts.any() and np.ptp(masses) <= 1e-3 * masses.max() else None
    given = fields.get("mass")
    if own is None and given is None:
        raise ValueError(
            "total_mass (of files: mass) must be given in kg: the matrices of a body that is held do not hold the mass "
            "of its supports"
        )
    if own is not None and given is not None and abs(given - own) > FITS * own:
        raise ValueError(f"total_mass (of files: mass) must be that of the matrices, {own:g} kg, got {given:g} kg")
    found["mass"] = own if given is None else given
    return found | _at_kept(fields, kept, len(nodes))


def label_matrices(fields: dict[str, Any]) -> dict[str, Any]:
    """The same with matrices for their ``..._entries``, (n, 5) node, direction, node, direction and value."""
    names = [f"{kind}_entries" for kind in KINDS if f"{kind}_entries" in fields]
    if not names:
        return fields
    entries = [np.asarray(fields[name], float) for name in names]
    every = np.vstack([each[:, k : k + 2] for each in entries for k in (0, 2)]).astype(int)
    dofs, place = np.unique(every, axis=0, return_inverse=True)
    places, start, found = place.ravel(), 0, {}
    for name, each in zip(names, entries):
        rows, columns = places[start : start + len(each)], places[start + len(each) : start + 2 * len(each)]
        found[name.replace("entries", "matrix")] = whole_matrix(rows, columns, each[:, 4], len(dofs))
        start += 2 * len(each)
    return {name: value for name, value in fields.items() if name not in names} | found | {"dofs": dofs}


def whole_matrix(rows: np.ndarray, columns: np.ndarray, values: np.ndarray, size: int) -> Any:
    """A symmetric matrix of which all entries are given, or each beside the diagonal on one side of it alone."""
    off = rows != columns
    if not np.isin(rows[off] * size + columns[off], columns[off] * size + rows[off]).any():
        rows, columns = np.concatenate([rows, columns[off]]), np.concatenate([columns, rows[off]])
        values = np.concatenate([values, values[off]])
    return csc_array(coo_array((values, (rows, columns)), shape=(size, size)))


def _symmetric(fields: Mapping[str, Any]) -> list[Any]:
    """Mass and stiffness, checked."""
    found = []
    for kind in KINDS:
        matrix: Any = fields.get(f"{kind}_matrix")
        if matrix is None:
            raise ValueError(f"{kind} must be given as a matrix, too; modes need both mass and stiffness")
        if hasattr(matrix, "dtype") and np.iscomplexobj(matrix):
            raise ValueError(f"{kind} must be real; give damping as damping_ratio")
        matrix = matrix if issparse(matrix) else check.array(kind, matrix, (None, None))
        if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
            raise ValueError(f"{kind} must be a square matrix, got shape {matrix.shape}")
        check.array(kind, matrix.tocoo().data if issparse(matrix) else matrix.ravel(), (None,))
        matrix = csc_matrix(matrix, dtype=float)
        across = float(abs(matrix - matrix.T).max())
        if across > 1e-6 * float(abs(matrix).max()):
            raise ValueError(f"{kind} must be symmetric, but entries across its diagonal differ by {across:.3g}")
        found.append((0.5 * (matrix + matrix.T)).tocsc())
    if found[0].shape != found[1].shape:
        raise ValueError(f"mass must be as large as stiffness, got {found[0].shape} and {found[1].shape}")
    return found


def _supported(M: Any, K: Any, turned: Any) -> np.ndarray:
    """Whether nodes' unknowns (n,) are on springs so stiff that nothing else moves them, as programs write supports."""
    if turned is None:
        return np.zeros(K.shape[0], bool)
    stiff, heavy, known = K.diagonal(), M.diagonal(), np.diff(turned.tocsc().indptr) > 0
    alone = known & (np.asarray(abs(K).sum(axis=0)).ravel() - stiff <= 1e-6 * stiff)
    pace = np.divide(stiff, heavy, out=np.full(len(stiff), np.inf), where=heavy > 0.0)
    fastest = pace[~alone & np.isfinite(pace)].max(initial=0.0)
    return np.asarray(alone & (1e-4 * pace > fastest) & (fastest > 0.0))


def _directions(fields: Mapping[str, Any], numbers: np.ndarray, size: int) -> Any:
    """Shifts and turns of nodes by unknowns, (6 n_nodes, size); None if only ``recovery`` is given."""
    dofs, n = fields.get("dofs"), len(numbers)
    if dofs is None:
        if fields.get("recovery") is not None:
            return None
        each = size // n if n and size % n == 0 else 0
        if each not in (3, 6):
            raise ValueError(
                f"dofs must be given, node and direction (1 to 6, or 0) of each of the {size} unknowns, or recovery: "
                f"they are not three or six of each of the {n} nodes"
            )
        dofs = np.column_stack([np.repeat(numbers, each), np.tile(np.arange(1, each + 1), n)])
    given = check.array("dofs", dofs, (size, 2))
    dofs = given.astype(int)
    moving = np.flatnonzero((dofs[:, 1] >= 1) & (dofs[:, 1] <= 6))
    if (given != dofs).any() or len(np.unique(dofs[moving], axis=0)) < len(moving) or not len(moving):
        raise ValueError("dofs must be whole numbers, each node and direction from 1 to 6 once, and one at least")
    lost = np.setdiff1d(dofs[moving, 0], numbers)
    if lost.size:
        raise ValueError(f"dofs must be of the nodes given, got node {lost[0]}, which has no coordinates")
    rows, way = cell_kinds.rows_of(numbers, dofs[moving, 0]), dofs[moving, 1] - 1
    frames = np.tile(np.eye(3), (n, 1, 1)) if fields.get("frames") is None else np.asarray(fields["frames"], float)
    into = 6 * rows[:, None] + 3 * (way[:, None] // 3) + np.arange(3)
    axes = frames[rows, way % 3]  # (n_moving, 3)
    return csc_matrix((axes.ravel(), (into.ravel(), np.repeat(moving, 3))), shape=(6 * n, size))


def _recovery(fields: Mapping[str, Any], turned: Any, n: int, size: int) -> Any:
    """Displacements of nodes by unknowns, (3 n_nodes, size)."""
    given = fields.get("recovery")
    if given is None:
        return turned[(6 * np.arange(n)[:, None] + np.arange(3)).ravel()]
    given = given if issparse(given) else check.array("recovery", given, (None, None))
    if given.shape != (3 * n, size):
        raise ValueError(
            f"recovery must be ({3 * n}, {size}), x, y and z of each node in turn by unknowns, got {given.shape}"
        )
    return csc_matrix(given, dtype=float)


def _candidates(M: Any, K: Any, turned: Any, nodes: np.ndarray) -> np.ndarray:
    """Unknowns (n, 6) among which are all rigid motions: those of nodes, and what follows; or the seven slowest."""
    if turned is None:
        stiff, heavy, resists = K.toarray(), M.toarray(), K.diagonal()
        some = np.median(resists[resists >= KEPT * resists.max()]) or 1.0  # not of rigid motions, if these are unknowns
        slow = 1e-6 * float(some / M.diagonal().max())  # makes a free body stiff meanwhile
        return np.asarray(eigh(heavy, stiff + slow * heavy)[1][:, ::-1][:, :7])
    place = nodes - nodes.mean(axis=0)
    turns = np.eye(3) / (float(np.abs(place).max()) or 1.0)
    moves = np.zeros((len(nodes), 2, 3, 6))  # shifts and turns of nodes, as all shift along x, y, z and turn about them
    moves[:, 0], moves[:, 1, :, 3:] = motions(place, turns), turns
    found, known = turned.T @ moves.reshape(-1, 6), np.diff(turned.tocsc().indptr) > 0
    if not known.all():
        inner = K[~known]
        found[~known] = -np.linalg.lstsq(inner[:, ~known].toarray(), inner[:, known] @ found[known], rcond=None)[0]
    return found


def _flexibility(M: Any, K: Any, turned: Any, nodes: np.ndarray) -> Flexibility:
    """The body with the motions that nothing resists."""
    try:
        moved = _candidates(M, K, turned, nodes)
        some = moved[:, :6]
        size, turn = np.linalg.eigh(some.T @ (M @ some))
        basis = some @ (turn / np.sqrt(np.maximum(size, 1e-300)))[:, size > KEPT * size.max()]
        # forces on unknowns over the largest that can cancel in them, as K[i, j]**2 <= K[i, i] K[j, j]
        stiff = np.sqrt(np.maximum(K.diagonal(), 0.0))[:, None]
        size = stiff * (stiff * np.abs(basis)).max(axis=0, initial=0.0).max(initial=0.0)
        forces = np.divide(K @ basis, size, out=np.zeros(basis.shape), where=size > 0.0)
        _, resisted, way = np.linalg.svd(forces, full_matrices=len(basis) < basis.shape[1])
        rigid = basis @ way[int((resisted > KEPT * len(moved) ** 0.5).sum()) :].T
        K, rigid = (K, rigid) if turned is not None else _release_rigid(M, K, moved, rigid)
    except np.linalg.LinAlgError as error:
        raise ValueError(INDEFINITE.format(error)) from None
    springs = np.zeros(rigid.shape[1], bool)
    if turned is not None:
        springs = _resisted(K @ rigid, rigid, size, rounded_by(K.data) / float(abs(K).max() or 1.0))
    loose = np.hstack([rigid[:, ~springs], rigid[:, springs]])
    held = qr(loose.T, pivoting=True, mode="r")[1][: loose.shape[1]] if loose.shape[1] else np.zeros(0, int)
    rigid, sprung = loose[:, : np.sum(~springs)], loose[:, np.sum(~springs) :]
    return Flexibility(K, M, rigid, sprung, K @ sprung, np.sort(held))


def _resisted(forces: np.ndarray, motions: np.ndarray, size: np.ndarray, rounded: float) -> np.ndarray:
    """Whether forces (n_dofs, n) on motions are those of springs, not the rounding of terms of a size (n_dofs, 1).

    Those of springs oppose the motion everywhere; they are on many unknowns, or on some alone. Where the largest term
    is ``rounded`` by a part [-] to few digits, all others must be without any force.
    """
    work, part = motions * forces, np.abs(forces) / np.where(size > 0.0, size, 1.0)
    most, top = work.max(axis=0, initial=0.0), part.max(axis=0, initial=0.0)
    there = work > 1e-3 * most
    rest = np.where(there, 0.0, part).max(axis=0, initial=0.0)
    clear = rest <= ROUNDING if rounded else (rest <= 0.05 * top) | (there.sum(axis=0) >= 8)
    return np.asarray((top > 2.0 * rounded + 10.0 * ROUNDING) & (work.min(axis=0, initial=0.0) >= -1e-3 * most) & clear)


def _release_rigid(M: Any, K: Any, slowest: np.ndarray, rigid: np.ndarray) -> tuple[Any, np.ndarray]:
    """Stiffness without the rounding that resists rigid motions, and these (n, n_rigid), if it hid some of them."""
    inert = np.einsum("ij,ij->j", slowest, M @ slowest)
    slowest = slowest[:, inert > 0.0] / np.sqrt(inert[inert > 0.0])  # mass-normalised, as they are orthogonal
    values, way = eigh(slowest.T @ (K @ slowest))
    order = np.argsort(np.abs(values))
    n_rigid = cell_kinds.count_rigid((np.sign(values) * np.abs(values) ** 0.5)[order])
    if n_rigid <= rigid.shape[1]:
        return K, rigid
    rigid = slowest @ way[:, order[:n_rigid]]
    kept = np.eye(len(rigid)) - rigid @ (M @ rigid).T
    return csc_matrix(kept.T @ (K @ kept)), rigid


def _loaded(numbers: np.ndarray, loads: Any, turned: Any) -> tuple[Any, np.ndarray]:
    """Loads and their forces (3 n_nodes, n_loads) [N] on nodes.

    Without any given, they are those along x, y and z on the nodes that have unknowns of their own in all of these.
    """
    if loads is None:
        own = np.zeros(len(numbers), bool)
        if turned is not None:
            own = np.diff(turned.tocsr().indptr).reshape(-1, 6)[:, :3].astype(bool).all(axis=1)
        loads = [(int(number), force) for number in numbers[own] for force in np.eye(3)]
    row = {int(number): i for i, number in enumerate(numbers)}
    found = np.zeros((len(numbers), 3, len(loads)))
    for k, (number, *force) in enumerate(loads):
        if number not in row:
            raise ValueError(f"loads must be on nodes that can move, got node {number:g}")
        found[row[number], :, k] = np.ravel(force)
    return loads, found.reshape(3 * len(numbers), len(loads))


def _at_kept(fields: Mapping[str, Any], kept: np.ndarray, n: int) -> dict[str, Any]:
    """Cells and normals of the nodes kept."""
    if len(kept) == n:
        return {}
    place = np.full(n, -1)
    place[kept] = np.arange(len(kept))
    found: dict[str, Any] = {}
    if fields.get("cells") is not None and len(fields["cells"]):
        given = check.array("cells", fields["cells"], (None, None)).astype(int)
        cells = place[given[(given >= 0).all(axis=1) & (given < n).all(axis=1)]]
        found["cells"] = cells[(cells >= 0).all(axis=1)]
    if fields.get("normals") is not None:
        found["normals"] = check.array("normals", fields["normals"], (n, 3))[kept]
    return found
