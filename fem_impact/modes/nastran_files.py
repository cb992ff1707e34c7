"""Read what Nastran wrote of a body: results (.op2), matrices (.op4), and decks with nodes, elements and DMIG (.bdf).

Needs pyNastran; runs in the reader process (see `isolated`).
"""

import contextlib
import re
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from . import cell_kinds

# vtk's codes of Nastran's elements, corners alone: their surface is drawn and struck, not computed with
ELEMENTS = {
    "CBAR": (3, 2), "CBEAM": (3, 2), "CROD": (3, 2), "CTRIA3": (5, 3), "CTRIA6": (5, 3), "CTRIAR": (5, 3),
    "CQUAD4": (9, 4), "CQUAD8": (9, 4), "CQUADR": (9, 4), "CTETRA": (10, 4), "CHEXA": (12, 8), "CPENTA": (13, 6),
    "CPYRAM": (14, 5),
}  # fmt: skip
FREE = re.compile(r"^\s*BEGIN\s+BULK", re.MULTILINE | re.IGNORECASE)  # line of a deck above which other sections are


def results(path: Path, deck: str = "") -> dict[str, np.ndarray]:
    """Eigenvectors and static displacements of an OP2 file; its nodes and elements are in it, or in the deck."""
    with _quiet() as quiet:
        from pyNastran.op2.op2 import read_op2
        from pyNastran.op2.op2_geom import read_op2_geom

        found = read_op2(str(path), **quiet) if deck else read_op2_geom(str(path), xref=False, validate=False, **quiet)
        model = _deck(Path(deck), quiet) if deck else found
        if not model.nodes:
            raise ValueError(
                f"{path.name} holds no nodes; give the deck (.bdf) beside it: files=[{path.name!r}, 'it.bdf']"
            )
        model.cross_reference(xref=False, xref_nodes=True)
        fields, (moved, frames) = _nodes(model)
        table = list(found.eigenvectors.values())
        given = [one.node_gridtype[:, 0] for one in (*table, *found.displacements.values())]
        if frames.any() and any(len(each) < len(model.nodes) for each in given):
            raise ValueError(f"{path.name} has results in frames of their own; export them at all nodes")
        if frames.any():
            found.transform_displacements_to_global(moved, model.coords, xyz_cid0=fields["nodes"])
        fields |= _elements(model.elements, fields)
        numbers, cases = fields["numbers"], list[list[np.ndarray]]()
        for tables in (table, found.displacements.values()):  # modes and static displacements
            cases.append([])
            for one in tables:
                moved = np.zeros((len(one.data), len(numbers), 3))
                moved[:, cell_kinds.rows_of(numbers, one.node_gridtype[:, 0])] = one.data[:, :, :3]
                cases[-1].extend(moved)
        cycles = [np.asarray(one.mode_cycles if hasattr(one, "mode_cycles") else one.freqs, float) for one in table]
        signs = [np.where(np.asarray(getattr(one, "eigns", 0.0)) < 0.0, -1.0, 1.0) for one in table]
        frequencies = np.concatenate([np.zeros(0), *(sign * np.abs(each) for sign, each in zip(signs, cycles))])
        fields |= cell_kinds.steps(len(numbers), *cases) | {"frequencies": frequencies}
        told = np.all([np.isin(numbers, each) for each in (list(model.nodes), *given)], axis=0)  # no scalar points
        place = np.where(told, np.cumsum(told) - 1, -1)
        fields |= {name: fields[name][told] for name in ("numbers", "nodes", "shapes", "static")}
        fields["cells"] = place[fields["cells"][told[fields["cells"]].all(axis=1)]]
        told_masses = [
            dict(zip(one.mode.tolist(), one.generalized_mass.tolist())) for one in found.eigenvalues.values()
        ]
        if len(told_masses) == len(table):  # of all modes, of which a set may be written
            pairs = [(mass, mode) for mass, one in zip(told_masses, table) for mode in np.asarray(one.modes).tolist()]
            if all(mode in mass for mass, mode in pairs):
                fields["modal_mass"] = np.array([mass[mode] for mass, mode in pairs], float)
    return fields


def deck(path: Path) -> dict[str, np.ndarray]:
    """Nodes, elements and matrices (DMIG) of a deck, and the unknowns of a reduction that it names."""
    with _quiet() as quiet:
        model = _deck(path, quiet)
        fields: dict[str, np.ndarray] = {}
        if model.nodes:
            model.cross_reference(xref=False, xref_nodes=True)
            fields, (_, frames) = _nodes(model)
            fields |= _elements(model.elements, fields)
            if frames.any():
                wrong = [number for number in set(frames.tolist()) if model.coords[number].type[-1:] != "R"]
                if wrong:
                    raise ValueError(f"{path.name} has displacements in frame {wrong[0]}, which is not rectangular")
                fields["frames"] = np.array([model.coords[number].beta() for number in frames.tolist()])
    for kind, name in cell_kinds.matrices_by_kind(path.name, model.dmig).items():
        matrix = model.dmig[name]
        if matrix.is_complex:
            raise ValueError(f"{kind} must be real; give damping as damping_ratio")
        if kind != "recovery":
            pair = np.asarray(matrix.GCj), np.asarray(matrix.GCi)
            fields[f"{kind}_entries"] = np.column_stack([*pair, np.asarray(matrix.Real, float)])
    kept = [card for cards in (model.asets, model.bsets, model.csets) for card in cards]
    dofs = [(int(node), int(way)) for card in kept for node, ways in _components(card) for way in ways]
    dofs += [(int(node), 0) for card in model.qsets for node, _ in _components(card)]
    if dofs:
        fields["dofs"] = np.array(sorted(set(dofs)), int)  # as Nastran orders the rows of matrices of its a-set
    return fields


def matrices(path: Path) -> dict[str, np.ndarray]:
    """Mass, stiffness and recovery in an OP4 file, by the first letters of their names."""
    with _quiet() as quiet:
        from pyNastran.op4.op4 import read_op4

        found = read_op4(str(path), **quiet)
    fields: dict[str, np.ndarray] = {}
    for kind, name in cell_kinds.matrices_by_kind(path.name, found).items():
        matrix = found[name]
        fields |= cell_kinds.triplets(kind, matrix[1] if isinstance(matrix, tuple) else matrix.data)
    if not fields:
        raise ValueError(f"{path.name} must hold matrices named K... and M..., got {', '.join(found) or 'none'}")
    return fields


@contextlib.contextmanager
def _quiet() -> Any:
    """In a folder where pyNastran leaves what it could not read, without its warnings."""
    if not hasattr(np, "in1d"):  # numpy 2.4 lacks it, and pyNastran 1.3 asks for it
        setattr(np, "in1d", np.isin)  # noqa: B010
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its own use of numpy
        from cpylog import SimpleLogger

        yield {"debug": False, "log": SimpleLogger("critical")}


def _deck(path: Path, quiet: dict[str, Any]) -> Any:
    from pyNastran.bdf.bdf import read_bdf

    bulk = not FREE.search(path.read_text("utf-8", "replace"))
    model = read_bdf(str(path), xref=False, validate=False, punch=bulk, **quiet)
    if model.grdset and (model.grdset.cp or model.grdset.cd):
        raise ValueError(f"{path.name} names coordinate systems in GRDSET; write them to each GRID")
    for name in {"CK2", "CM2"} & model.params.keys():
        if model.params[name].values != [1.0]:
            raise ValueError(f"{path.name} scales matrices by PARAM {name}; write them as they are meant, without it")
    return model


def _components(card: Any) -> list[tuple[int, str]]:
    ways = card.components if isinstance(card.components, list) else [card.components] * len(card.node_ids)
    return list(zip(card.node_ids, map(str, ways)))


def _nodes(read: Any) -> tuple[dict[str, np.ndarray], tuple[Any, np.ndarray]]:
    """Numbers and places of nodes; what pyNastran knows of their frames, and the numbers of these."""
    moved, placed, places, numbers = read.get_displacement_index_xyz_cp_cd()
    at = numbers[:, 0].astype(int)
    return {"numbers": at, "nodes": read.transform_xyzcp_to_xyz_cid(places, at, placed, cid=0)}, (moved, numbers[:, 2])


def _elements(cards: Any, fields: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    blocks: dict[int, list[list[int]]] = {}
    for element in cards.values():
        code, corners = ELEMENTS.get(element.type, (0, 0))
        if code:
            blocks.setdefault(code, []).append(element.node_ids[:corners])
    rows = {code: cell_kinds.rows_of(fields["numbers"], each) for code, each in blocks.items()}
    return cell_kinds.surface_and_kind(fields["nodes"], rows)
