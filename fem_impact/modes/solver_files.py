"""Read what other programs wrote of a body: CalculiX, Code_Aster (MED), Ansys, Abaqus, and matrices as text.

Each needs its own library; runs in the reader process (see `isolated`).
"""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ..mesh.meshio_reader import closed_hdf5, deck_labels
from . import cell_kinds

MARKET = "%%MatrixMarket"
ALONG = {"DX": 0, "DY": 1, "DZ": 2}  # components of Code_Aster's displacements


def calculix(path: Path, deck: str = "") -> dict[str, np.ndarray]:
    """Modes and static displacements of an FRD file; node sets of one node in the deck are names."""
    import pyvista_frd

    reader = pyvista_frd.FRDReader(str(path), inp_path=deck or None)
    with path.open("rb") as file:
        heads = [line for line in file if line.lstrip().startswith(b"100CL")]
    modal = {float(head[12:24]): b"MODAL" in head for head in heads}  # steps are those of different values
    if len(set(heads)) != len(reader.time_values) or not modal:
        raise ValueError(
            f"{path.name} must hold steps of different times or frequencies; write each load to its own file"
        )
    shapes, static, frequencies = [], [], []
    for i, value in enumerate(reader.time_values):
        reader.set_active_time_point(i)
        grid = reader.read()
        if "DISP" not in grid.point_data:
            continue
        moved = np.asarray(grid.point_data["DISP"], float)[:, :3]
        if modal[min(modal, key=lambda known: abs(known - value))]:
            shapes.append(moved)
            frequencies.append(float(value))
        else:
            static.append(moved)
    found = {"nodes": np.asarray(grid.points, float)} | cell_kinds.steps(len(grid.points), shapes, static)
    found |= {"numbers": np.asarray(grid.point_data["original_node_ids"], int), "frequencies": np.array(frequencies)}
    sets = {key[5:]: np.flatnonzero(grid.point_data[key]) for key in grid.point_data if key[:5] == "NSET:"}
    return found | _names(sets, found["numbers"]) | cell_kinds.surface_and_kind(found["nodes"], grid.cells_dict)


def mesh(path: Path) -> dict[str, np.ndarray]:
    """Nodes, elements and names of single nodes of an Abaqus deck."""
    import meshio

    numbers = np.array(deck_labels(path), int)
    read = meshio.read(path)
    points = np.asarray(read.points, float)
    if len(numbers) != len(points):
        raise ValueError(f"{path.name} must hold its nodes itself, not in files that it includes")
    found = {"nodes": cell_kinds.points_in_space(points), "numbers": numbers}
    found |= cell_kinds.surface_and_kind(found["nodes"], cell_kinds.of_meshio(read.cells))
    return found | _names(read.point_sets, numbers)


def med(path: Path) -> dict[str, np.ndarray]:
    """Nodes, elements, and displacements of a MED file: modes by their frequencies, static ones at time zero."""
    import h5py
    import meshio

    with closed_hdf5(path):
        read = meshio.read(path)
    nodes = cell_kinds.points_in_space(np.asarray(read.points, float))
    shapes: list[np.ndarray] = []
    static: list[np.ndarray] = []
    frequencies: list[float] = []
    with closed_hdf5(path), h5py.File(path) as file:
        for title, field in sorted(file["CHA"].items() if "CHA" in file else ()):
            if re.search(r"(REAC_NODA|FORC_NODA|VITE|ACCE)[_\s]*$", title):  # forces and velocities along DX, DY, DZ
                continue
            named = field.attrs["NOM"]
            named = named.decode() if isinstance(named, bytes) else str(named)
            each = [named[i : i + 16].strip() for i in range(0, len(named), 16)]
            columns = {ALONG[name]: column for column, name in enumerate(each) if name in ALONG}  # of displacements
            steps = sorted(field.values(), key=lambda step: (step.attrs["NDT"], step.attrs["NOR"]))
            values = [float(step.attrs["PDT"]) for step in steps]
            for step, value in zip(steps, values):
                if not columns or "NOE" not in step:
                    continue
                data, moved = step["NOE"], np.zeros((len(nodes), 3))  # zero at nodes outside the profile of the step
                profile = data.attrs["PFL"].decode() if isinstance(data.attrs["PFL"], bytes) else str(data.attrs["PFL"])
                rows = np.arange(len(nodes))
                if profile != "MED_NO_PROFILE_INTERNAL":
                    rows = np.asarray(file["PROFILS"][profile]["PFL"][()]) - 1
                found = np.asarray(data[profile]["CO"][()], float).reshape(len(rows), -1, order="F")
                for axis, column in columns.items():
                    moved[rows, axis] = found[:, column]
                (shapes if any(values) else static).append(moved)
                frequencies += [value] if any(values) else []
    groups = getattr(read, "point_tags", {}) if "point_tags" in read.point_data else {}
    names = {name: np.flatnonzero(read.point_data["point_tags"] == tag) for tag, own in groups.items() for name in own}
    numbers = np.arange(1, len(nodes) + 1)
    mesh = {"nodes": nodes, "numbers": numbers} | cell_kinds.surface_and_kind(nodes, cell_kinds.of_meshio(read.cells))
    motions = cell_kinds.steps(len(nodes), shapes, static) | {"frequencies": np.array(frequencies)}
    return mesh | motions | _names(names, numbers)


def ansys(path: Path) -> dict[str, np.ndarray]:
    """Modes or static displacements (.rst), matrices (.full), or nodes and elements (.cdb) of Ansys."""
    warnings.simplefilter("ignore")  # of its own use of numpy
    from ansys.mapdl import reader

    if path.suffix.lower() == ".full":
        dofs, *both = reader.read_binary(str(path)).load_km(sort=True)
        found = {}
        for kind, matrix in zip(("stiffness", "mass"), (each.tocoo() for each in both)):
            pair = (dofs[at] + [0, 1] for at in (matrix.row, matrix.col))  # directions from 1
            found[f"{kind}_entries"] = np.column_stack([*pair, matrix.data])
        return found
    own = reader.Archive(str(path)) if path.suffix.lower() == ".cdb" else reader.read_binary(str(path))
    grid = own.grid
    numbers = np.asarray(grid.point_data["ansys_node_num"], int)
    found = {"nodes": np.asarray(grid.points, float), "numbers": numbers}
    found |= cell_kinds.surface_and_kind(found["nodes"], grid.cells_dict)
    if isinstance(own, reader.Archive):
        return found
    analysis, row = own._resultheader["kan"], {int(number): i for i, number in enumerate(numbers)}
    if analysis not in (2, 0) or own._resultheader["cpxrst"]:
        raise ValueError(f"{path.name} must hold real modes or static results")
    fields = []
    for i in range(own.nsets):
        at, values = own.nodal_solution(i)
        ways = own.result_dof(i)
        field, kept = np.zeros((len(numbers), 3)), [k for k, number in enumerate(at) if int(number) in row]
        for way, name in enumerate(("UX", "UY", "UZ")):
            if name in ways:
                field[[row[int(number)] for number in at[kept]], way] = values[kept, ways.index(name)]
        fields.append(field)
    modal = analysis == 2
    found["frequencies"] = np.array(own.time_values, float) if modal else np.zeros(0)
    return found | cell_kinds.steps(len(numbers), *((fields, []) if modal else ([], fields)))


def matrix(path: Path) -> dict[str, np.ndarray]:
    """A matrix of text: of MatrixMarket, or Abaqus's by nodes and directions; its name says which."""
    kind = cell_kinds.kind_of_matrix(path.stem)
    if not kind:
        raise ValueError(f"{path.name} must say what it is: name it K... or ...STIF..., M... or ...MASS..., or R...")
    text = path.read_text("ascii", "replace")
    if text.startswith(MARKET):
        from scipy.io import mmread

        return cell_kinds.triplets(kind, mmread(path))
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("*")]
    numbers = (re.sub("[dD]", "e", line).strip().rstrip(",") for line in lines)
    table = np.array([re.split(r"[,\s]+", row) for row in numbers], float)
    if table.ndim != 2 or table.shape[1] != 5:
        raise ValueError(f"{path.name} must have rows of node, direction, node, direction and value")
    return {f"{kind}_entries": table}


def _names(sets: Any, numbers: np.ndarray) -> dict[str, np.ndarray]:
    """Sets of one node are names."""
    single = {str(name): int(numbers[rows[0]]) for name, rows in sets.items() if len(rows) == 1}
    return {"names": np.array(list(single), str), "named": np.array(list(single.values()), int)}
