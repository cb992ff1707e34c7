"""Read and write modes as universal files, the format of modal testing; needs pyuff.

Data sets 15, 55, 2411, 2412, and 164, 2414 and 2420 to read.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check
from . import cell_kinds

NORMAL_MODE, DISPLACEMENT = 2, 8  # codes of data sets 55 and 2414: of an analysis, and of what is shown
CELL_CODE = {2: 11, 3: 91, 4: 94}  # nodes of a cell -> rod, thin shell triangle, thin shell quadrilateral
# codes of elements: rods and beams, plane and shell elements, solids
LINES, SHELLS, SOLIDS = (11, 21, 22), range(41, 97), range(111, 119)
# nodes of a shell element -> its corners
CORNERS: dict[int, tuple[int, ...]] = {3: (0, 1, 2), 4: (0, 1, 2, 3), 6: (0, 2, 4), 8: (0, 2, 4, 6)}
PHASE = 0.3  # [-] imaginary over real part, at the best phase, up to which a complex shape is taken as real: 17 degrees
GROWS = -1e-3  # [-] damping ratio below which its sign is wrong; light damping that was measured errs by less
COMPONENTS = "r1", "r2", "r3"  # along x, y and z
UFF_END = re.compile(rb" {4}-1(?=\r|\n|\Z| {74})")  # begins and ends a data set, also right behind binary numbers
READER = "modes.universal_files:arrays"


def write_modes(
    path: Any, frequencies: np.ndarray, damping_ratio: np.ndarray, shapes: np.ndarray, points: np.ndarray,
    cells: np.ndarray,
) -> None:  # fmt: skip
    """Write nodes (data sets 15 and 2411), cells (2412) and one data set 55 for each mode; numbers keep six digits.

    Parameters
    ----------
    path : str or Path
    frequencies : ndarray, shape (n_modes,) [Hz]
    damping_ratio : ndarray, shape (n_modes,) [-]
    shapes : ndarray, shape (n_points, n_modes) [kg**-0.5]
        Mass-normalised deflections, written along z with modal mass 1.
    points : ndarray, shape (n_points, dimension) [m]
    cells : ndarray, shape (n_cells, 2, 3 or 4), point numbers
    """
    pyuff, path = check.extra("pyuff", "uff", "a universal file"), check.path("path", path)
    n_points = len(points)
    place = cell_kinds.points_in_space(points)
    node = np.arange(1, n_points + 1)
    zero, one = np.zeros(n_points, int), np.ones(n_points, int)
    x, y, z = place.T
    nodes = {"node_nums": node, "def_cs": zero, "disp_cs": zero, "color": one, "x": x, "y": y, "z": z}
    sets: list[dict[Any, Any]] = [nodes | {"type": 15}, nodes | {"type": 2411}]  # 2411 keeps all digits
    code = CELL_CODE.get(cells.shape[1] if len(cells) else 0)
    if code is not None:
        element: dict[str, Any] = {"fe_descriptor": code, "phys_table": 1, "mat_table": 1, "color": 1}
        if code == CELL_CODE[2]:
            element |= {"beam_orientation": 0, "beam_foreend_cross": 1, "beam_aftend_cross": 1}
        numbered = enumerate((cells + 1).tolist(), 1)
        sets.append({"type": 2412, code: [
            element | {"element_nums": i, "num_nodes": len(cell), "nodes_nums": cell} for i, cell in numbered
        ]})  # fmt: skip
    for i, (frequency, damping) in enumerate(zip(frequencies, damping_ratio)):
        still = np.zeros(n_points)
        sets.append({
            "type": 55, "id1": f"mode {i + 1}", "id2": "mass-normalised, kg**-0.5", "id3": "NONE", "id4": "NONE",
            "id5": "NONE", "model_type": 1, "analysis_type": NORMAL_MODE, "data_ch": 2,
            "spec_data_type": DISPLACEMENT, "data_type": 2, "n_data_per_node": 3, "r1": still, "r2": still,
            "r3": shapes[:, i].copy(), "load_case": 1, "mode_n": i + 1, "freq": float(frequency), "modal_m": 1.0,
            "modal_damp_vis": float(damping), "modal_damp_his": 0.0, "node_nums": node,
        })  # fmt: skip
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets(sets, mode="add")


def arrays(path: Path) -> dict[str, np.ndarray]:
    """What a file holds of a body, as `Body` takes it; runs in a separate process (see `isolated`).

    Static deflections under a load are data sets 55 or 2414 of static analysis.
    """
    import pyuff

    refuse_cut(path)
    file = pyuff.UFF(str(path))
    kinds = [int(kind) for kind in file.get_set_types()]
    # nodes, frames, shapes, units, nodes in double precision, results, frames
    sets = [file.read_sets(i) for i, kind in enumerate(kinds) if kind in (15, 18, 55, 164, 2411, 2414, 2420)]
    turned = _turned(sets)
    placed = [s[key] for s in sets if s["type"] in (15, 2411) for key in ("def_cs", "disp_cs")]
    used = turned & {int(frame) for frames in placed for frame in frames}  # axes of their own
    if used:
        raise ValueError(f"{path.name} has nodes in coordinate system {min(used)}; export all in the global one")
    numbers, place = places(sets)
    length, force = map(factors(sets).get, ("m", "N"), (1.0, 1.0))
    results = [_result(s) for s in sets if s["type"] in (55, 2414)]
    modes = [s for s in results if s.get("analysis_type") in (NORMAL_MODE, 3)]
    static = [s for s in results if s.get("analysis_type") == 1]
    if not len(numbers) or not (modes or static):
        held = ", ".join(str(kind) for kind in sorted(set(kinds))) or "none"
        functions = ", of which 58 are time records or frequency responses, no modes" if 58 in kinds else ""
        raise ValueError(
            f"{path.name} must hold nodes (15 or 2411) and mode shapes (55) of motions, not of stress or strain; its "
            f"data sets are {held}{functions}"
        )
    measured = np.asarray((modes + static)[0]["node_nums"], int)
    if len(np.unique(measured)) < len(measured):
        raise ValueError(f"{path.name} has a mode with two shapes at one node; export it again")
    lost = np.setdiff1d(measured, numbers)
    if lost.size:
        raise ValueError(f"{path.name} has shapes at node {lost[0]}, which has no coordinates; export it again")
    nodes = place[cell_kinds.rows_of(numbers, measured)]
    table = [_mode(path.name, i, mode, measured) for i, mode in enumerate(modes)]
    frequencies, damping, shapes = zip(*sorted(table, key=lambda entry: abs(entry[0]))) if table else ((), (), ())
    found = cell_kinds.settle_frequencies(np.array(frequencies))
    result = {"frequencies": found, "damping_ratio": np.array(damping), "nodes": nodes}
    still = [_moved(path.name, i, one, measured) / length for i, one in enumerate(static)]
    result |= cell_kinds.steps(len(nodes), shapes, still)
    result["shapes"] = result["shapes"] * np.sqrt(force / length)  # of which the unit of mass follows
    for what, values in result.items():
        if not (np.abs(values) <= check.REACH).all():
            raise ValueError(f"{path.name} has {what} that are too large or not numbers; export it again")
    cell_kinds.refuse_twice(found, result["shapes"])
    elements = [element for i, kind in enumerate(kinds) if kind == 2412 for element in _elements(file, i)]
    row = {int(n): i for i, n in enumerate(measured)}
    cells = {name: _cells(elements, row, i + 1) for i, name in enumerate(("lines", "triangles"))}
    codes = {int(element["fe_descriptor"]) for element in elements}
    solid = {} if not codes else {"solid": np.array(True) if codes & set(SOLIDS) else np.zeros(0)}
    return result | cells | {"numbers": measured} | solid


def _turned(sets: list[dict]) -> set[int]:
    """Labels of coordinate systems with other axes than the global ones, by data sets 18 and 2420."""
    found: list[tuple[float, bool]] = []
    for s in sets:
        if s["type"] == 2420:
            rows = zip(s["CS_sys_labels"], s["CS_types"], s["CS_matrices"])
            found += [(label, kind == 0 and np.allclose(axes, np.eye(4)[:, :3])) for label, kind, axes in rows]
        if s["type"] == 18:  # by their origin, a point on the axis x, and one in the plane of x and z
            for i, kind in enumerate(s["cs_type"]):
                origin, x, z = (s[name][i] for name in ("ref_o", "x_point", "xz_point"))
                same = not (np.any(origin) or np.any(x[1:]) or z[1]) and x[0] > 0.0 < z[2]
                found.append((s["cs_num"][i], same and kind == 0 and s["ref_cs_num"][i] in (0, 1)))
    return {int(label) for label, same in found if not same}


def refuse_cut(path: Path) -> None:
    """ValueError if a file ends within a data set."""
    if len(UFF_END.findall(path.read_bytes())) % 2:
        raise ValueError(f"{path.name} ends within a data set; it may be cut off")


def damping_of(name: str, frequencies: np.ndarray, ratios: np.ndarray) -> np.ndarray:
    """Damping ratios (n_modes,) that a file states; ValueError if a mode with them would not swing, or would grow."""
    wrong = np.flatnonzero((frequencies > 0.0) & ((ratios >= 1.0) | (ratios < GROWS)))
    if wrong.size:
        i = int(wrong[0])
        raise ValueError(
            f"{name} must state damping ratios from 0 to below 1, got {ratios[i]:g} for mode {i + 1} at "
            f"{frequencies[i]:g} Hz, where 5 % is 0.05; export it again, or give damping_ratio to fi.Body.load"
        )
    return np.maximum(ratios, 0.0)


def places(sets: list[dict]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (n_nodes,) and places (n_nodes, 3) [m] of the nodes in data sets 2411 or, without them, 15."""
    nodes = [s for s in sets if s["type"] == 2411] or [s for s in sets if s["type"] == 15]
    numbers, length = [np.asarray(s["node_nums"], int) for s in nodes], factors(sets).get("m", 1.0)
    place = [np.column_stack([s["x"], s["y"], s["z"]]).astype(float) / length for s in nodes]
    return np.concatenate([np.zeros(0, int), *numbers]), np.concatenate([np.zeros((0, 3)), *place])


def factors(sets: list[dict]) -> dict[str, float]:
    """By what data of a unit's kind are divided to be in SI, from data sets 164."""
    length, force = next(((float(s["length"]), float(s["force"])) for s in sets if s["type"] == 164), (1.0, 1.0))
    found = {"N": force, "m/s^2": length, "m/s": length, "m": length}
    return {kind: factor for kind, factor in found.items() if factor > 0.0 and factor != 1.0}


def _elements(file: Any, i: int) -> list[dict]:
    """Elements of a data set 2412; none if pyuff cannot read them, as it cannot read solids of many nodes."""
    try:
        found = file.read_sets(i)
    except Exception:  # it raises nothing more special; the shapes can be read without the elements
        return []
    return [element for kind in found if isinstance(kind, int) for element in found[kind]]


def _cells(elements: list[dict], row: dict[int, int], dimension: int) -> np.ndarray:
    """Elements whose nodes were all measured, as point numbers, (n_cells, dimension + 1)."""
    found = []
    for element in elements:
        code, nodes = int(element["fe_descriptor"]), element["nodes_nums"]
        if dimension == 1:
            corners = nodes[:2] if code in LINES else []
        else:
            corners = [nodes[i] for i in CORNERS.get(len(nodes), ())] if code in SHELLS else []
        points = [row[int(node)] for node in corners if int(node) in row]
        if corners and len(points) == len(corners):
            found += [[points[0], *points[i : i + dimension]] for i in range(1, len(points) - dimension + 1)]
    return np.array(found, int).reshape(-1, dimension + 1)


def _result(one: dict) -> dict:
    """A data set 2414 as one 55 says the same; nothing of what shows no motion, such as stresses."""
    if one["type"] == 55:
        return one if one.get("spec_data_type", 0) in (0, DISPLACEMENT, 11, 12) else {}
    if one.get("dataset_location") != 1 or one.get("result_type") != DISPLACEMENT:
        return {}
    rows, last = one["data_at_node"], [one.get(f"record13_field{i}") or 0.0 for i in range(1, 5)]
    values = np.array([row[:6:2] + 1j * row[1:6:2] if one["data_type"] in (5, 6) else row[:3] for row in rows])
    renamed = {"freq": one.get("record12_field2"), "modal_m": one.get("record12_field4")}
    renamed |= {"modal_damp_vis": one.get("record12_field5"), "modal_damp_his": one.get("record12_field6")}
    renamed |= {"eig": complex(*last[:2]), "modal_a": complex(*last[2:])}
    return one | renamed | dict(zip(COMPONENTS, values.T))


def _moved(name: str, i: int, one: dict, measured: np.ndarray) -> np.ndarray:
    """Displacements (n_nodes, 3) of one data set, at the nodes of the first."""
    if not np.array_equal(np.asarray(one["node_nums"], int), measured):
        raise ValueError(f"{name} has mode {i + 1} at other nodes than mode 1; export all modes at the same nodes")
    columns = [np.asarray(one.get(component, np.zeros(len(measured)))) for component in COMPONENTS]
    if any(len(column) != len(measured) for column in columns):
        raise ValueError(f"{name} has shapes at {len(columns[0])} nodes but names {len(measured)}; export it again")
    return np.column_stack(columns)


def _mode(name: str, i: int, mode: dict, measured: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Frequency [Hz], damping ratio and mass-normalised shape (n_nodes, 3) of one data set."""
    shape = _moved(name, i, mode, measured)
    if mode["analysis_type"] == 3:
        pole, scale = complex(mode["eig"]), complex(mode.get("modal_a") or 0.0)
        frequency, damping = abs(pole) / (2.0 * np.pi), -pole.real / abs(pole) if pole else 0.0
        # a normal mode has modal A = 2 i omega_d m
        modal_mass = abs(scale) / (2.0 * abs(pole.imag)) if pole.imag else 0.0
    else:
        frequency, hysteretic = float(mode["freq"]), float(mode.get("modal_damp_his") or 0.0)
        damping = float(mode.get("modal_damp_vis") or 0.5 * hysteretic)  # as much at resonance
        modal_mass = float(mode.get("modal_m") or 0.0)
    if modal_mass <= 0.0:
        raise ValueError(
            f"{name} states no modal mass for mode {i + 1} at {frequency:g} Hz; "
            "export mass-normalised shapes with modal mass 1, or use Modes.from_arrays"
        )
    if np.iscomplexobj(shape):
        turn = np.exp(-0.5j * np.angle((shape**2).sum()))
        shape = shape * turn
        if np.abs(shape.imag).max() > PHASE * np.abs(shape.real).max():
            raise ValueError(
                f"{name} has mode {i + 1} at {frequency:g} Hz with phases far from 0 and 180 degrees; export real modes"
            )
        shape = shape.real
    return frequency, damping, np.asarray(shape, float) / np.sqrt(modal_mass)


def function(name: str, node: int, direction: int, x: np.ndarray, values: np.ndarray) -> dict[str, Any]:
    """A data set 58 for pyuff: values over an even axis (n,), at a node and along its axis, from node 1 along z."""
    return {
        "type": 58, "binary": 0, "id1": name[:60], **dict.fromkeys(("id2", "id3", "id4", "id5"), "NONE"),
        "ver_num": 0, "load_case_id": 0, "rsp_ent_name": "NONE", "rsp_node": node, "rsp_dir": direction,
        "ref_ent_name": "NONE", "ref_node": 1, "ref_dir": 3, "num_pts": len(x), "abscissa_spacing": 1,
        "abscissa_min": float(x[0]), "abscissa_inc": float(x[-1] - x[0]) / (len(x) - 1), "z_axis_value": 0.0,
        "orddenom_spec_data_type": 0, "x": x, "data": values,
    }  # fmt: skip
