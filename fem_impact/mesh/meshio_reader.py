"""Read nodes, cells and names of a mesh file with meshio, in a separate process (see `isolated`)."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from .._base import isolated, kept

# meshio's keys for the numbers of cells, preferred first
TAGS = ("gmsh:physical", "medit:ref", "edge", "cell_tags", "su2:tag", "nastran:ref")


NASTRAN = (".bdf", ".fem", ".nas")


@dataclass(frozen=True, eq=False)
class Raw:
    """Contents of a mesh file, unchecked."""

    points: np.ndarray  # (n_points, 2 or 3)
    blocks: Sequence[tuple[str, np.ndarray, np.ndarray | None]]  # cell type, nodes (n_cells, n), tags (n_cells,)
    labels: dict[int, str]  # tag of line cells -> name
    sets: dict[str, Sequence[np.ndarray | None]]  # name -> cell numbers in each block
    nodes: dict[str, np.ndarray] = field(default_factory=dict)  # name -> numbers of nodes


KINDS = kept.kinds(Raw)


def read_raw(path: Path) -> Raw:
    """Read a mesh file; ValueError names the file and the fault."""
    found: Raw = kept.restore(KINDS, isolated.read_apart(path, "a mesh", "mesh.meshio_reader:arrays"))["mesh"]
    return found


def arrays(path: Path) -> dict[str, np.ndarray]:
    """A `Raw`, as arrays; runs in the reader process."""
    import meshio

    known = sorted(meshio.extension_to_filetypes)
    if not set(path.suffixes) & set(known):
        raise ValueError(f"its ending is {path.suffix!r}, but meshio reads {', '.join(known)}")
    if path.suffix.lower() in NASTRAN:
        _refuse_left_out(path)
    if path.suffix.lower() == ".inp":
        deck_labels(path)
        _refuse_split_sets(path)
    with closed_hdf5(path), _whole_groups():
        mesh = _read_obj(path) if path.suffix.lower() == ".obj" else meshio.read(path)

    def whole_numbers(values: Any) -> Any:
        return None if values is None else np.asarray(values, np.int64).ravel()

    key = next((key for key in TAGS if key in mesh.cell_data), None)
    tags = [None] * len(mesh.cells) if key is None else mesh.cell_data[key]
    blocks = [(each.type, np.asarray(each.data, np.int64), whole_numbers(tag)) for each, tag in zip(mesh.cells, tags)]
    sets = {name: members for name, members in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    families = {int(tag): own for tag, own in getattr(mesh, "cell_tags", {}).items() if own}  # groups of MED
    for name in sorted({name for own in families.values() for name in own[1:]}):
        held = [tag for tag, own in families.items() if name in own]
        sets[name] = [np.flatnonzero(np.isin(tags, held)) for tags in mesh.cell_data["cell_tags"]]
    labels = {int(v[0]): name for name, v in mesh.field_data.items() if len(v) == 2 and int(v[1]) == 1}
    labels |= {tag: own[0] for tag, own in families.items()}
    chosen: dict[str, Any] = {name: list(map(whole_numbers, each)) for name, each in sets.items()}
    nodes = {name: whole_numbers(members) for name, members in mesh.point_sets.items()}
    return kept.flatten(KINDS, mesh=Raw(np.asarray(mesh.points, float), blocks, labels, chosen, nodes))


def _read_obj(path: Path) -> Any:
    """A mesh of an OBJ file; meshio takes textures for those of its nodes, and numbers from the end for none."""
    from meshio.obj import _obj

    lines: list[str] = []
    n = 0
    for line in path.read_text("utf-8", "replace").splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            n, rest = n + 1, rest[:3]
        elif word == "f":
            numbers = [int(each.split("/")[0]) for each in rest]
            rest = [str(number if number > 0 else n + 1 + number) for number in numbers]
        lines += [" ".join([word, *rest])] if word in ("v", "f") else []
    return _obj.read_buffer(StringIO("\n".join(lines)))


def _refuse_left_out(path: Path) -> None:
    """ValueError if a Nastran deck has what meshio ignores: cells, files that it includes, and frames of its nodes."""
    from meshio.nastran import _nastran

    for line in path.read_text("utf-8", "replace").splitlines():
        card = line[:8].upper()
        own = line[:8].split(",")[0].strip(" *")
        if card.startswith(("CTRIA", "CQUAD")) and own not in _nastran.nastran_to_meshio_type:
            raise ValueError(f"{path.name} has {own}, which is not read; export CTRIA3 or CQUAD4")
        if card.lstrip().startswith("INCLUDE"):
            raise ValueError(f"{path.name} includes other files; write all into one")
        if card.startswith(("GRID", "GRDSET")):
            frame = line.split(",")[2:3] if "," in line else [line[24:40] if "*" in card else line[16:24]]
            if "".join(frame).strip() not in ("", "0"):
                raise ValueError(
                    f"{path.name} has nodes in coordinate system {frame[0].strip()}; export all in the global one"
                )


def deck_labels(path: Path) -> list[str]:
    """Labels of the nodes of an Abaqus deck, in its order, which meshio drops; ValueError if meshio loses nodes.

    It keeps those of the last block, the last of one number, and neither generates nodes nor turns them.
    """
    labels: dict[str, None] = {}
    within = False
    for line in path.read_text("utf-8", "replace").splitlines():
        words = [word.strip().upper() for word in line.lstrip("*").split(",")]
        if line.startswith("*") and not line.startswith("**"):
            within = words[0] == "NODE"
            if words[0] in ("NGEN", "NCOPY", "NFILL", "SYSTEM") or (within and {"SYSTEM=C", "SYSTEM=S"} & set(words)):
                raise ValueError(f"{path.name} has {line.strip()}, which is not read; write all nodes by x, y and z")
            if within and labels:
                raise ValueError(f"{path.name} has several blocks of nodes, as of several parts; write all into one")
        elif within and not line.startswith("**") and words[0]:
            if words[0] in labels:
                raise ValueError(f"{path.name} has node {words[0]} twice; export it again")
            labels[words[0]] = None
    return list(labels)


def _refuse_split_sets(path: Path) -> None:
    """ValueError if an Abaqus deck adds nodes to a set in a second place; meshio keeps those of the last alone."""
    sets: set[str] = set()
    keywords = (line for line in path.read_text("utf-8", "replace").splitlines() if "*" in line)
    for line in keywords:
        word, *rest = line.upper().replace(" ", "").split(",")
        own = [each for each in rest if each.startswith("NSET=")] if word == "*NSET" else []
        if sets & set(own):
            raise ValueError(f"{path.name} has set {own[0][5:]} of nodes twice; write all its nodes into one")
        sets = set() if word in ("*ENDPART", "*ASSEMBLY", "*INSTANCE") else sets.union(own)  # there names start anew


@contextmanager
def _whole_groups() -> Iterator[None]:
    """Meanwhile, meshio knows Gmsh's curves in all of their groups, also those that run against them or have no name.

    Without it, these curves would be missing from their edges, and curves of no group beside others an error.
    """
    from meshio.gmsh import _gmsh41

    known = _gmsh41._read_elements

    def read_elements(file: Any, points: Any, groups: Any, *rest: Any) -> Any:
        named, names = {(int(kind), int(tag)) for tag, kind in rest[-1].values()}, rest[-1]
        groups = tuple({own: [abs(tag) for tag in tags] or [0] for own, tags in each.items()} for each in groups or ())
        for tag in {tag for tags in groups[1].values() for tag in tags} if groups else ():
            if tag and (1, tag) not in named:
                names[f"edge{tag}"] = np.array([tag, 1])
        return known(file, points, groups, *rest)

    _gmsh41._read_elements = read_elements
    try:
        yield
    finally:
        _gmsh41._read_elements = known


@contextmanager
def closed_hdf5(path: Path) -> Iterator[None]:
    """Meanwhile, h5py.File only reads files in the folder of ``path``, and refuses references to other files.

    Without it, an HDF5 file could link to any file on the disk or map its bytes.
    """
    try:
        import h5py
    except ImportError:
        yield
        return
    own, folder, known = path.resolve(), path.parent.resolve(), h5py.File

    class File(h5py.File):
        def __init__(self, name: Any, mode: str = "r", **options: Any) -> None:
            place = Path(name).resolve()
            if place != own and not place.is_relative_to(folder):
                raise PermissionError("it refers to a file outside its folder")
            super().__init__(name, "r", **options)
            self._refuse_references(self)

        def _refuse_references(self, group: Any) -> None:
            for name in group:
                link = group.get(name, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    raise PermissionError("it links to another file")
                if isinstance(link, h5py.SoftLink):
                    continue
                item = group[name]
                if isinstance(item, h5py.Group):
                    self._refuse_references(item)
                elif isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
                    raise PermissionError("it stores its data in another file")

    h5py.File = File
    try:
        yield
    finally:
        h5py.File = known
