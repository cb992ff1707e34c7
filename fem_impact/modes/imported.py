"""What other programs' files hold of a body, as `Body` takes it: Nastran, CalculiX, universal files, NumPy, xarray."""

import contextlib
import tempfile
import warnings
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, isolated

FIELDS = (
    "frequencies", "damping_ratio", "shapes", "nodes", "numbers", "cells", "normals", "static", "mass", "loads",
    "solid",
)  # fmt: skip
DECKS = {".op2": (".bdf", ".nas", ".dat"), ".frd": (".inp",)}  # files of a model that lie beside those of its results
KINDS = {
    ".uff": ("a universal file", "modes.universal_files:arrays"),
    ".unv": ("a universal file", "modes.universal_files:arrays"),
    ".op2": ("results of Nastran", "modes.imported:nastran"),
    ".frd": ("results of CalculiX", "modes.imported:calculix"),
    ".npz": ("arrays of NumPy", ""),
}
LINE = 3  # vtk's code
# vtk's codes of Nastran's elements, corners alone: their surface is drawn and struck, not computed with
ELEMENTS = {
    "CBAR": (3, 2), "CBEAM": (3, 2), "CROD": (3, 2), "CTRIA3": (5, 3), "CTRIA6": (5, 3), "CTRIAR": (5, 3),
    "CQUAD4": (9, 4), "CQUAD8": (9, 4), "CQUADR": (9, 4), "CTETRA": (10, 4), "CHEXA": (12, 8), "CPENTA": (13, 6),
}  # fmt: skip


def read(files: Any) -> list[dict[str, Any]]:
    """What each file of results holds; decks among the files belong to those of their program."""
    if hasattr(files, "data_vars"):
        return [{name: np.asarray(files[name].values) for name in FIELDS if name in files}]
    given = files if isinstance(files, (list, tuple)) else [files]
    paths = [check.path("files", each) for each in given]
    results = [path for path in paths if path.suffix.lower() in KINDS]
    decks = [path for path in paths if path.suffix.lower() in {name for names in DECKS.values() for name in names}]
    for path in paths:
        if path not in results and path not in decks:
            raise ValueError(
                f"files must be one of {', '.join(KINDS)} (with {', '.join(sum(DECKS.values(), ()))} beside them), got "
                f"{path.name!r}; convert it, or give arrays to fi.Body"
            )
    if not results:
        raise ValueError(f"files must hold results, {', '.join(KINDS)}, got {check.shown(files)}")
    return [_one(path, decks) for path in results]


def _one(path: Path, decks: Sequence[Path]) -> dict[str, np.ndarray]:
    ending = path.suffix.lower()
    kind, reader = KINDS[ending]
    if not reader:
        return archive(path)
    path = path.resolve()
    own = [str(deck.resolve()) for deck in decks if deck.suffix.lower() in DECKS.get(ending, ())]
    return isolated.read(path, kind, reader, *own[:1])


def archive(path: Path) -> dict[str, np.ndarray]:
    """A body saved by `Body.save`, or arrays under the names of its fields."""
    try:
        with np.load(path, allow_pickle=False) as found:
            return {name: found[name] for name in (*FIELDS, "names", "named") if name in found}
    except (OSError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path.name} cannot be read as arrays of NumPy ({check.line(str(error))})") from None


def nastran(path: Path, deck: str = "") -> dict[str, np.ndarray]:
    """Eigenvectors and static displacements of an OP2 file; its nodes and elements are in it, or in the deck."""
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
    ):  # where pyNastran leaves what it could not read
        return _nastran(path, deck)


def _nastran(path: Path, deck: str) -> dict[str, np.ndarray]:
    if not hasattr(np, "in1d"):  # numpy 2.4 lacks it, and pyNastran 1.3 asks for it
        setattr(np, "in1d", np.isin)  # noqa: B010
    warnings.simplefilter("ignore")  # of its own use of numpy
    from cpylog import SimpleLogger
    from pyNastran.bdf.bdf import read_bdf
    from pyNastran.op2.op2 import read_op2
    from pyNastran.op2.op2_geom import read_op2_geom

    quiet: dict[str, Any] = {"debug": False, "log": SimpleLogger("critical")}
    results = read_op2(str(path), **quiet) if deck else read_op2_geom(str(path), xref=False, validate=False, **quiet)
    bulk = bool(deck) and "BEGIN BULK" not in Path(deck).read_text("utf-8", "replace").upper()
    model = read_bdf(deck, xref=False, validate=False, punch=bulk, **quiet) if deck else results
    if not model.nodes:
        raise ValueError(f"{path.name} holds no nodes; give the deck (.bdf) beside it: files=[{path.name!r}, 'it.bdf']")
    model.cross_reference(xref=False, xref_nodes=True)
    moved, placed, places, numbers = model.get_displacement_index_xyz_cp_cd()
    at = numbers[:, 0].astype(int)
    xyz = model.transform_xyzcp_to_xyz_cid(places, at, placed, cid=0)
    if numbers[:, 2].any():
        results.transform_displacements_to_global(moved, model.coords, xyz_cid0=xyz)
    row = {int(number): i for i, number in enumerate(at)}
    table = list(results.eigenvectors.values())
    tables = {"shapes": table, "static": list(results.displacements.values())}
    found: dict[str, np.ndarray] = {"numbers": at, "nodes": xyz}
    for name, each in tables.items():
        moved = [_at_nodes(one, row) for one in each]
        found[name] = np.concatenate(moved, axis=2) if moved else np.zeros((len(at), 3, 0))
    cycles = [np.asarray(one.mode_cycles if hasattr(one, "mode_cycles") else one.freqs, float) for one in table]
    found["frequencies"] = np.abs(np.concatenate(cycles)) if cycles else np.zeros(0)
    masses = [np.asarray(one.generalized_mass, float) for one in results.eigenvalues.values()]
    if masses and sum(map(len, masses)) >= len(found["frequencies"]):
        found["modal_mass"] = np.concatenate(masses)[: len(found["frequencies"])]
    blocks: dict[int, list[list[int]]] = {}
    for element in model.elements.values():
        code, corners = ELEMENTS.get(element.type, (0, 0))
        if code:
            blocks.setdefault(code, []).append([row[int(node)] for node in element.node_ids[:corners]])
    return found | {"cells": surface(xyz, {code: np.array(each) for code, each in blocks.items()})}


def _at_nodes(table: Any, row: dict[int, int]) -> np.ndarray:
    """Translations (n_nodes, 3, n_cases) of a Nastran table of displacements."""
    found = np.zeros((len(row), 3, len(table.data)))
    rows = [row[int(number)] for number in table.node_gridtype[:, 0]]
    found[rows] = np.moveaxis(np.asarray(table.data[:, :, :3], float), 0, 2)
    return found


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
    found = {"frequencies": np.array(frequencies), "nodes": np.asarray(grid.points, float)}
    found |= {"numbers": np.asarray(grid.point_data["original_node_ids"], int)}
    for name, each in (("shapes", shapes), ("static", static)):
        found[name] = np.stack(each, axis=2) if each else np.zeros((*found["nodes"].shape, 0))
    sets = {key[5:]: np.flatnonzero(grid.point_data[key]) for key in grid.point_data if key[:5] == "NSET:"}
    single = {name: found["numbers"][rows[0]] for name, rows in sets.items() if len(rows) == 1}
    found |= {"names": np.array(list(single), str), "named": np.array(list(single.values()), int)}
    return found | {"cells": surface(found["nodes"], grid.cells_dict)}


def surface(points: np.ndarray, blocks: dict[int, np.ndarray]) -> np.ndarray:
    """Triangles (n, 3) on the surface of elements by vtk's codes, or lines (n, 2) if they have none."""
    import pyvista

    wide = {code: each for code, each in blocks.items() if code != LINE}
    if not wide:
        return blocks.get(LINE, np.zeros((0, 3), int))
    grid = pyvista.UnstructuredGrid(wide, points)
    grid.point_data["row"] = np.arange(len(points))
    skin = grid.extract_surface(nonlinear_subdivision=0, algorithm="dataset_surface").triangulate()
    return np.asarray(skin.point_data["row"], int)[skin.faces.reshape(-1, 4)[:, 1:]]
