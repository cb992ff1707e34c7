"""What other programs' files and objects hold of a body, as `Body` takes it."""

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array, load_npz

from .._base import check, isolated
from . import cell_kinds, matrices
from .universal_files import PHASE, READER

FIELDS = (
    "frequencies", "damping_ratio", "shapes", "nodes", "numbers", "cells", "normals", "static", "mass", "loads",
    "solid",
)  # fmt: skip
OWN = (*FIELDS, "names")  # fields of a `Body`
MORE = "modal_mass", "direction", "dofs", "mass_matrix", "stiffness_matrix", "recovery"  # what mappings may hold, too
NASTRAN, CALCULIX = (".bdf", ".nas", ".dat", ".pch"), (".inp",)
DECKS = {".op2": NASTRAN[:3], ".frd": CALCULIX}  # files of a model that lie beside those of its results
KINDS = {
    **dict.fromkeys((".uff", ".unv"), ("a universal file", READER)),
    ".op2": ("results of Nastran", "modes.nastran_files:results"),
    ".op4": ("matrices of Nastran", "modes.nastran_files:matrices"),
    ".frd": ("results of CalculiX", "modes.solver_files:calculix"),
    ".med": ("a MED file", "modes.solver_files:med"),
    ".rst": ("results of Ansys", "modes.solver_files:ansys"),
    ".full": ("matrices of Ansys", "modes.solver_files:ansys"),
    ".cdb": ("a mesh of Ansys", "modes.solver_files:ansys"),
    ".mtx": ("a matrix", "modes.solver_files:matrix"),
    ".npz": ("arrays of NumPy", ""),
    **dict.fromkeys(NASTRAN, ("a deck of Nastran", "modes.nastran_files:deck")),
    ".inp": ("a deck of Abaqus", "modes.solver_files:mesh"),
}


def read_bodies(files: Any) -> list[dict[str, Any]]:
    """What each file or object holds; decks beside results of their program are read with these."""
    alone = not isinstance(files, (list, tuple))
    given = [files] if alone else list(files)
    found = [_object(each) for each in given]
    paths = [check.path("files", each) for each, known in zip(given, found) if known is None]
    for path in paths:
        if path.suffix.lower() not in KINDS:
            raise ValueError(
                f"files must be one of {', '.join(KINDS)}, got {path.name!r}; convert it, or give arrays to fi.Body"
            )
    if not given:
        raise ValueError("files must hold a body, got none")
    decks = {path for path in paths for each in paths if path.suffix.lower() in DECKS.get(each.suffix.lower(), ())}
    return [each for each in found if each is not None] + [_one(path, decks) for path in paths if path not in decks]


def _one(path: Path, decks: set[Path]) -> dict[str, Any]:
    ending = path.suffix.lower()
    kind, reader = KINDS[ending]
    if not reader:  # saved by `Body.save`, arrays under the names of fields, or a sparse matrix of SciPy
        try:
            with np.load(path, allow_pickle=False) as held:
                if "format" not in held:
                    own_modes = {"own": True} if "named" in held else {}
                    return {name: held[name] for name in (*OWN, *MORE, "named") if name in held} | own_modes
            kind = cell_kinds.kind_of_matrix(path.stem)
            if not kind:
                raise ValueError("name the matrix K..., M... or R..., to say what it is")
            return {kind if kind == "recovery" else f"{kind}_matrix": load_npz(path)}
        except (OSError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
            raise ValueError(f"{path.name} cannot be read as arrays of NumPy ({check.line(str(error))})") from None
    path = path.resolve()
    own = sorted(str(deck.resolve()) for deck in decks if deck.suffix.lower() in DECKS.get(ending, ()))
    found: dict[str, Any] = isolated.read_apart(path, kind, reader, *own[:1])
    damping = found.pop("damping_ratio", ())  # empty of static solutions alone
    found |= {"damping_ratio": damping, "stated_in": path.name} if len(damping) else {}
    for kind in (name[:-9] for name in list(found) if name.endswith("_triplets")):
        rows, columns, values = found.pop(f"{kind}_triplets").T
        shape, at = found.pop(f"{kind}_shape"), (rows.astype(int), columns.astype(int))
        square = kind != "recovery"
        found[f"{kind}_matrix" if square else kind] = (
            matrices.whole_matrix(*at, values, int(shape[0])) if square else csc_array((values, at), shape=tuple(shape))
        )
    return found


def fields_of_body(fields: dict[str, Any], n_modes: int | None) -> dict[str, Any]:
    """Fields of a `Body` from what files hold of it."""
    fields = matrices.label_matrices(fields)
    if "mass_matrix" in fields or "stiffness_matrix" in fields:
        fields |= matrices.solve_matrices(fields, fields.get("loads"), n_modes) | {"own": True}
        fields.pop("modal_mass", None)
    found = check.array("frequencies", fields.get("frequencies", ()), (None,), "Hz")
    if not len(found):
        raise ValueError("files must hold modes; ask the other program for its eigenvectors, too, or for its matrices")
    if fields.get("mass") is None:
        raise ValueError("mass must be given in kg: these files do not hold it")
    shapes = np.asarray(fields.get("shapes", ()))
    if shapes.shape[-1:] != found.shape:
        raise ValueError(f"shapes must be as many as the {len(found)} frequencies, got them in shape {shapes.shape}")
    if shapes.ndim == 2:
        way = fields.get("direction")
        if way is None:
            raise ValueError("files must hold the direction of what was measured: add {'direction': 'z'} to them")
        way = np.eye(3)["xyz".index(check.one_of("direction", str(way), "xyz"))] if np.ndim(way) == 0 else way
        way = np.broadcast_to(check.numbers("direction", way), (len(shapes), 3))
        if not way.any(axis=1).all():
            raise ValueError("direction must not be zero")
        shapes = np.einsum("nm,nd->ndm", shapes, way / np.linalg.norm(way, axis=1, keepdims=True))
    scale = fields.get("modal_mass")
    if scale is not None:
        scale = check.array("modal_mass", scale, found.shape, "kg")
        if scale.min() <= 0.0:
            raise ValueError(f"modal_mass must be positive, got {scale.min():g} kg")
        shapes = shapes / np.sqrt(scale)
    cell_kinds.refuse_twice(found, shapes)
    order = np.argsort(np.abs(found), kind="stable")  # our own solver, and what it saved, has zeros
    settled = found[order] if "own" in fields else cell_kinds.settle_frequencies(found[order])
    fields |= {"frequencies": settled, "shapes": shapes[..., order]}
    damping = fields.get("damping_ratio", 0.0)
    if np.ndim(damping):
        fields["damping_ratio"] = check.array("damping_ratio", damping, order.shape)[order]
    return {name: fields[name] for name in OWN if fields.get(name) is not None}


def _object(given: Any) -> dict[str, Any] | None:
    """What an object of another package, a mapping or an xarray.Dataset holds; None if it is a path."""
    if hasattr(given, "data_vars"):
        return {name: np.asarray(given[name].values) for name in (*OWN, *MORE) if name in given}
    if isinstance(given, Mapping):
        for name in given:
            check.one_of("files", name, (*OWN, *MORE))
        return {
            name: value if hasattr(value, "tocoo") or isinstance(value, (str, Mapping)) else np.asarray(value)
            for name, value in given.items()
        }
    if hasattr(given, "eig_vec") and hasattr(given, "dof_ref"):
        return _pyfbs(given)
    return _sdypy(given) if hasattr(given, "nat_freq") and hasattr(given, "nat_xi") else None


def _pyfbs(model: Any) -> dict[str, Any]:
    """Modes of a numerical model of pyFBS (``pyfbs.Model``), mass-normalised as it solves them."""
    if model.eig_vec is None or np.iscomplexobj(model.eig_vec) or model.eig_freq is None:
        raise ValueError("files must hold real modes; solve the pyFBS model undamped")
    nodes, dofs = np.asarray(model.nodes, float), np.asarray(model.dof_ref, int)
    vectors, moving = np.asarray(model.eig_vec, float), np.flatnonzero(dofs[:, 1] < 3)
    shapes = np.zeros((len(nodes), 3, vectors.shape[1]))
    shapes[dofs[moving, 0] - 1, dofs[moving, 1]] = vectors[moving]
    frequencies = np.nan_to_num(np.abs(np.asarray(model.eig_freq, float)))[: vectors.shape[1]]
    found = {"frequencies": frequencies, "shapes": shapes, "nodes": nodes, "numbers": np.arange(1, len(nodes) + 1)}
    grid = model.mesh
    if grid is not None and len(grid.points) == len(nodes):
        found |= cell_kinds.surface_and_kind(nodes, grid.cells_dict)
    return found


def _sdypy(model: Any) -> dict[str, Any]:
    """Modes identified by sdypy-EMA or pyEMA, scaled by their driving point, at places measured along a direction.

    Its constants A are those of a receptance ``A / (i omega - pole) + conjugate``, of real modes ``shape * (shape at
    the driving point) / (2 i omega_d)``; for proportional damping they are real, without the denominator.
    """
    constants, drive = getattr(model, "A", None), getattr(model, "driving_point", None)
    if constants is None or drive is None:
        raise ValueError(
            "files must hold scaled modes: give the model of sdypy-EMA its driving_point and call get_constants()"
        )
    frequencies, damping = np.asarray(model.nat_freq, float), np.asarray(model.nat_xi, float)
    residues = np.asarray(constants)
    if np.iscomplexobj(residues):
        residues = residues * (4j * np.pi * frequencies * np.sqrt(1.0 - damping**2))
    turned = residues / (residues[drive] / np.abs(residues[drive])) / np.sqrt(np.abs(residues[drive]))
    wrong = (np.abs(turned.imag).max(axis=0) > PHASE * np.abs(turned.real).max(axis=0)) | (
        np.abs(np.angle(residues[drive])) > np.arctan(PHASE)
    )
    if wrong.any():
        raise ValueError(
            f"files must hold real modes, positive at their driving point; that at {frequencies[wrong][0]:g} Hz has "
            "phases far from 0 and 180 degrees"
        )
    return {"frequencies": frequencies, "damping_ratio": damping, "shapes": turned.real}
