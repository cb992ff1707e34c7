"""A body known elsewhere: modes at the nodes of another program's model, or of a modal test, in three dimensions."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._base import check
from ..fe import plausible
from . import cell_kinds, dents, free_body, imported, matrices, universal_files, unstated
from .modal import Modes, damping_ratios

NOTE = "the error of the mesh on which modes were found elsewhere is not known, and no blow counts it"


@dataclass(frozen=True, eq=False, repr=False)
class Body(check.Brief):
    """Modes at the nodes of a body in three dimensions, struck at any node in any direction by way of `modes`.

    Parameters
    ----------
    frequencies : array_like, shape (n_modes,) [Hz], ascending; 0 for rigid motions
    shapes : array_like, shape (n_nodes, 3, n_modes) [kg**-0.5], mass-normalised
    nodes : array_like, shape (n_nodes, 3) [m]
    mass : float [kg] of the whole body
    damping_ratio : float, array (n_modes,) or function of frequency [Hz]
    numbers : array_like of int, shape (n_nodes,), optional
        What the other program calls the nodes; by default from 1.
    cells : array_like, shape (n_cells, 3 or 2), optional
        Triangles of the surface, or lines, by rows of ``nodes``.
    normals : array_like, shape (n_nodes, 3), optional
        By default those of the triangles, or of the plane of a flat body; zero at nodes inside.
    names : mapping of str to node number, optional
    static : array_like, shape (n_nodes, 3, n_loads) [m], optional
        Static deflections of the whole body, each under one of ``loads``; of a free body with inertia relief, and
        without any rigid motion.
    loads : sequence of (node number, force), optional
        The forces (3,) [N].
    solid : Material, (E [Pa], nu), True or False, optional
        Material of a solid mesh, isotropic: its static deflections contain the dent under each load, which a contact
        law has, too. It is taken out where a load acts on one node along the normal. True if the mesh is solid, of a
        material not known: the dent counts as an error. False if there is none, as of shells. Without it, loads that
        dent the body as they would a solid count that as an error.

    Raises
    ------
    ValueError
        If lengths disagree, a number is not finite or frequencies do not ascend; or if a node is named that is none.

    Examples
    --------
    >>> nodes = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.2, 0.0)]
    >>> shapes = np.zeros((3, 3, 1))
    >>> shapes[:, 2, 0] = [1.2, -0.9, 0.4]  # kg**-0.5, along z
    >>> body = fi.Body([110.0], shapes, nodes, mass=0.5, names={"corner": 2})
    >>> body.at("corner"), body.modes("z").shape_at(body.at("corner")).tolist()
    ((0.3, 0.0), [[-0.9]])
    """

    frequencies: np.ndarray  # (n_modes,) [Hz]
    shapes: np.ndarray  # (n_nodes, 3, n_modes) [kg**-0.5]
    nodes: np.ndarray  # (n_nodes, 3) [m]
    mass: float  # [kg]
    damping_ratio: Any = 0.0  # (n_modes,) [-]
    numbers: Any = None  # (n_nodes,)
    cells: Any = None  # (n_cells, 3 or 2)
    normals: Any = None  # (n_nodes, 3) [-], or None if they are not known
    names: Mapping[str, int] = field(default_factory=dict)
    static: Any = None  # (n_nodes, 3, n_loads) [m]
    loads: Any = ()  # (n_loads, 4) node number and force [N]
    solid: Any = None  # E [Pa] and nu of a solid mesh, True if they are not known, () of a shell, None if nothing is

    def __post_init__(self) -> None:
        frequencies = check.ascending("frequencies", self.frequencies, "Hz")
        nodes = check.array("nodes", self.nodes, (None, 3), "m")
        n, omega = len(nodes), 2.0 * np.pi * frequencies
        given = np.arange(1, n + 1) if self.numbers is None else self.numbers
        given = check.array("numbers", given, (n,))
        numbers = given.astype(int)
        if len(np.unique(numbers)) < n or (numbers != given).any():
            raise ValueError("numbers must be whole and differ from node to node")
        cells = np.zeros((0, 3)) if self.cells is None else check.array("cells", self.cells, (None, None))
        if cells.shape[1] not in (2, 3) or (cells < 0).any() or (cells >= n).any() or (cells % 1.0).any():
            raise ValueError(f"cells must be rows of nodes from 0 to {n - 1}, two or three each, got {cells.shape}")
        if not isinstance(self.names, Mapping) or not all(isinstance(name, str) for name in self.names):
            raise ValueError(f"names must map names to node numbers, as {{'rim': 17}}, got {check.shown(self.names)}")
        static = np.zeros((n, 3, 0)) if self.static is None else self.static
        check.settle(
            self, frequencies=frequencies, nodes=nodes, numbers=numbers, cells=cells.astype(int),
            shapes=check.array("shapes", self.shapes, (n, 3, len(frequencies)), "kg**-0.5"),
            mass=check.positive("mass", self.mass, "kg"), damping_ratio=damping_ratios(self.damping_ratio, omega),
            loads=_forces(self.loads), solid=dents.stated_material(self.solid), names={
                name: check.count(f"names[{name!r}]", number, low=-(10**9)) for name, number in self.names.items()
            },
            normals=None if self.normals is None else check.array("normals", self.normals, (n, 3)),
        )  # fmt: skip
        check.settle(self, static=check.array("static", static, (n, 3, None), "m"))
        if len(self.loads) != self.static.shape[2]:
            raise ValueError(
                f"loads must be given as (node number, force) for each of {self.static.shape[2]} static solutions, got "
                f"{len(self.loads)}"
            )
        for name, number in (*self.names.items(), *(("loads", number) for number in self.loads[:, 0].tolist())):
            if number not in self._row:
                raise ValueError(f"{name!r} must be a node of the body, got {number:g}; {self._known}")
        if self.normals is None:
            check.settle(self, normals=_normals(nodes, self.cells))
        check.lock_arrays(self)

    @classmethod
    def load(
        cls, files: Any, *, mass: float | None = None, loads: Any = None, damping_ratio: Any = None,
        modal_mass: "ArrayLike | None" = None, names: Mapping[str, int] | None = None,
        normals: "ArrayLike | None" = None, solid: Any = None, n_modes: int | None = None,
    ) -> "Body":  # fmt: skip
        """Read a body from files of other programs, or objects of other packages.

        - universal files: ``.uff``, ``.unv``, data sets 15, 55, 2411, 2412, 2414 (needs pyuff)
        - Nastran: results ``.op2``, with the ``.bdf`` beside them unless the nodes are in them; matrices ``.op4``, or
          DMIG in a ``.bdf`` or ``.pch`` (needs pyNastran)
        - CalculiX: ``.frd``, with its ``.inp`` for names of nodes (needs pyvista-frd-reader)
        - Code_Aster: ``.med`` (needs h5py); displacements at times other than zero are modes, by their frequencies
        - Ansys: ``.rst``, ``.full``, ``.cdb`` (needs ansys-mapdl-reader)
        - Abaqus: a mesh ``.inp``, matrices as text ``.mtx``
        - NumPy and SciPy: ``.npz`` as `save` writes it, or a sparse matrix; MatrixMarket ``.mtx``
        - ``xarray.Dataset`` or a dict with the fields of a body by name, or with ``dofs``, ``recovery``,
          ``mass_matrix``, ``stiffness_matrix`` as of `from_matrices`, ``modal_mass``, ``direction``
        - a model of pyFBS with its modes, or of sdypy-EMA or pyEMA with its driving point, and
          ``{"nodes": ..., "direction": "z"}`` of what was measured

        Matrices make `from_matrices` of it; their names, or those of their files, begin with K, M and R or hold STIF
        and MASS. Elements show whether a mesh is ``solid``.

        Parameters
        ----------
        files : path or object, or a sequence of both
            Modes are in one of them; static solutions may be in the same or in others.
        mass : float [kg], optional
            Of the whole body; only NumPy's files, xarray and matrices of free bodies hold it.
        loads : sequence of (node number, force (3,) [N]), optional
            Of the static solutions, in the order in which the files hold them; these do not say it.
        damping_ratio : float, array (n_modes,) or function of frequency [Hz], optional
            Instead of what the files hold, which is zero where they hold none.
        modal_mass : array_like, shape (n_modes,) [kg], optional
            If shapes are not mass-normalised and the files do not say how large their modal masses are.
        names : mapping of str to node number, optional
        normals : array_like, shape (n_nodes, 3), optional
        solid : Material, (E [Pa], nu), True or False, optional
            Whether loads dent the mesh, see `Body`.
        n_modes : int, optional
            Of matrices, see `from_matrices`.

        Raises
        ------
        ValueError
            If a file cannot be read or a library is missing; if no file states the mass, modes or loads; or if
            two files are about different nodes.
        """
        fields: dict[str, Any] = {}
        for found in imported.read_bodies(files):
            numbers = [each["numbers"] for each in (fields, found) if "numbers" in each]
            if len(numbers) == 2 and not np.array_equal(numbers[0], numbers[1]):
                raise ValueError("files must be about the same nodes; export all results of one model")
            for name in fields.keys() & found.keys():
                if name == "recovery" or name.endswith(("_matrix", "_entries")):
                    kind = name.partition("_")[0]
                    raise ValueError(f"files must hold the matrix of {kind} once, but two of them do; leave out one")
            static = [each["static"] for each in (fields, found) if "static" in each]
            found = {name: value for name, value in found.items() if np.size(value) or name not in fields}
            fields |= found | ({"static": np.concatenate(static, axis=2)} if static else {})
        if "names" in fields and not isinstance(fields["names"], Mapping):
            fields["names"] = dict(zip(fields["names"].tolist(), fields.pop("named").tolist()))
        if "cells" not in fields:
            fields["cells"] = fields.get("triangles") if len(fields.get("triangles", ())) else fields.get("lines")
        loads = None if loads is None else _forces(loads)
        given = {"mass": mass, "loads": loads, "damping_ratio": damping_ratio, "names": names, "normals": normals}
        given |= {"solid": solid, "modal_mass": modal_mass}
        if damping_ratio is None and "stated_in" in fields:
            fields["damping_ratio"] = universal_files.damping_of(
                fields["stated_in"], fields["frequencies"], fields["damping_ratio"]
            )
        fields |= {name: value for name, value in given.items() if value is not None}
        return cls(**imported.fields_of_body(fields, n_modes))

    @classmethod
    def from_matrices(
        cls, mass: Any, stiffness: Any, nodes: "ArrayLike", *, dofs: Any = None, recovery: Any = None,
        total_mass: float | None = None, loads: Any = None, n_modes: int | None = None, **fields: Any,
    ) -> "Body":  # fmt: skip
        """A body from its matrices, of a whole model or of a reduced one, as of Craig and Bampton.

        Parameters
        ----------
        mass, stiffness : array_like or sparse matrix, shape (n_unknowns, n_unknowns) [kg, N/m]
            Symmetric. Of a free body stiffness resists no rigid motion; loads are then balanced by inertia.
        nodes : array_like, shape (n_nodes, 3) [m]
        dofs : array_like of int, shape (n_unknowns, 2), optional
            Node number and direction of each unknown: 1 to 3 along x, y and z, 4 to 6 turns about them; direction 0 is
            no motion of a node, such as a mode of a reduction. By default all three or all six of each node.
        recovery : array_like or sparse matrix, shape (3 n_nodes, n_unknowns), optional
            Displacements of the nodes, x, y and z of each in turn, by unknowns; by default nodes move by their own
            unknowns, and those that have none are left out.
        total_mass : float [kg], optional
            Of a body that is held; that of a free body follows from the matrices.
        loads : sequence of (node number, force (3,) [N]), optional
            Static solutions are found for them: by default unit loads along x, y and z on all nodes that have unknowns
            of their own, if there are at most 600 unknowns. On nodes that move by ``recovery`` alone they are as exact
            as the reduction.
        n_modes : int, optional
            By default all of at most 600 unknowns, else 100.
        **fields
            Other fields of a body: numbers, damping_ratio, cells, normals, names, solid.

        Raises
        ------
        ValueError
            If matrices are not symmetric or not positive, apart from rigid motions, or shapes disagree.

        Examples
        --------
        >>> springs = 1e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])  # two masses and a spring along x, free
        >>> dofs = [(1, 1), (2, 1)]
        >>> body = fi.Body.from_matrices(
        ...     np.diag([0.1, 0.3]), springs, [(0, 0, 0), (0.2, 0, 0)], dofs=dofs, loads=[(1, (1, 0, 0))]
        ... )
        >>> round(body.mass, 6), body.frequencies.round(2).tolist(), round(float(body.static[0, 0, 0] * 1e6), 3)
        (0.4, [0.0, 58.12], 56.25)
        """
        allowed = "numbers", "damping_ratio", "cells", "normals", "names", "solid"
        for name in fields:
            check.one_of("fields", name, allowed)
        given = fields | {"mass_matrix": mass, "stiffness_matrix": stiffness, "nodes": nodes, "dofs": dofs}
        given |= {"recovery": recovery}
        if total_mass is not None:
            given["mass"] = check.positive("total_mass", total_mass, "kg")
        found = given | matrices.solve_matrices(given, None if loads is None else _forces(loads), n_modes)
        return cls(**{name: found[name] for name in imported.OWN if found.get(name) is not None})

    @classmethod
    def rigid(
        cls, mass: float, inertia: Any, nodes: "ArrayLike", *, centre: "ArrayLike" = (0.0, 0.0, 0.0), **more: Any
    ) -> "Body":
        """A rigid body, free to move and to turn: six modes of 0 Hz.

        A blow at a lever arm r along n feels it as ``1 / (1 / mass + (r x n) . inertia**-1 (r x n))``.

        Parameters
        ----------
        mass : float [kg]
        inertia : float, (3,) or (3, 3) [kg m^2]
            About the centre of mass: of a sphere, along the axes, or the tensor.
        nodes : array_like, shape (n_nodes, 3) [m]
            Points that are struck or looked at.
        centre : array_like, shape (3,) [m] of mass
        **more
            ``names``, ``numbers``, ``cells`` and ``normals`` as of `Body`.

        Examples
        --------
        >>> block = fi.Body.rigid(0.6, (4e-4, 4e-4, 2e-4), [(0, 0, 0), (0.03, 0, 0.05)], names={"corner": 2})
        >>> 0.6 / (1.0 + 0.6 * 0.03**2 / 4e-4), fi.Striker.of(block, "corner", direction="z").felt_mass
        (0.25531914893617025, 0.25531914893617025)
        """
        mass, nodes = check.positive("mass", mass, "kg"), check.array("nodes", nodes, (None, 3), "m")
        shapes = free_body.rigid_shapes(nodes, mass, inertia, centre)
        return cls(np.zeros(shapes.shape[2]), shapes, nodes, mass, **more)

    def freed(self, inertia: Any, centre: "ArrayLike") -> "Body":
        """The same body with its rigid motions, which its modes lack: as of a free one, tested on soft springs.

        Parameters
        ----------
        inertia : float, (3,) or (3, 3) [kg m^2] about the centre of mass, along the axes of the nodes
        centre : array_like, shape (3,) [m] of mass
        """
        if not self.frequencies.all():
            raise ValueError("body must have no rigid motions yet, but its first modes are at 0 Hz; it is free already")
        moving = free_body.rigid_shapes(self.nodes, self.mass, inertia, centre)
        still = np.zeros(moving.shape[2])
        return replace(
            self, frequencies=np.append(still, self.frequencies), shapes=np.concatenate([moving, self.shapes], axis=2),
            damping_ratio=np.append(still, self.damping_ratio),
        )  # fmt: skip

    def save(self, path: Any) -> Path:
        """Write a ``.npz`` file that `load` reads."""
        path = check.path("path", path).with_suffix(".npz")
        fields = {name: getattr(self, name) for name in imported.FIELDS if getattr(self, name) is not None}
        names = np.array(list(self.names), str), np.array(list(self.names.values()), int)
        np.savez_compressed(path, **fields, names=names[0], named=names[1])
        return path

    @cached_property
    def _row(self) -> dict[int, int]:
        return {int(number): row for row, number in enumerate(self.numbers)}

    @property
    def _known(self) -> str:
        return f"nodes are {self.numbers.min()} to {self.numbers.max()}, names {', '.join(self.names) or 'none'}"

    @cached_property
    def axes(self) -> list[int]:
        """The axes along which nodes differ: points of `modes` have these coordinates alone."""
        return cell_kinds.differing_axes(self.nodes)

    def node(self, where: Any) -> int:
        """Row of a node given by its number, its name or a point (3,) [m] within a thousandth of the body's size."""
        if isinstance(where, str):
            where = self.names[check.one_of("where", where, self.names)]
        if isinstance(where, (int, float, np.number)) or where is None:
            if where not in self._row:
                raise ValueError(f"where must be a node of the body, got {check.shown(where)}; {self._known}")
            return self._row[int(where)]
        apart = np.linalg.norm(self.nodes - check.array("where", where, (3,), "m"), axis=1)
        row = int(apart.argmin())
        if apart[row] > 1e-3 * float(np.ptp(self.nodes, axis=0).max()):
            place = ", ".join(f"{x:g}" for x in self.nodes[row])
            raise ValueError(
                f"where must be a node of the body, got one {apart[row]:.3g} m away from the nearest, node "
                f"{self.numbers[row]} at ({place}) m; give that one"
            )
        return row

    def at(self, where: Any) -> tuple[float, ...]:
        """Coordinates of a node, as blows on `modes` take them: those that differ from node to node [m]."""
        return tuple(self.nodes[self.node(where), self.axes].tolist())

    def modes(self, direction: Any = "normal", *, free: bool | None = None) -> Modes:
        """The body as it is struck and observed along a direction.

        Parameters
        ----------
        direction : "normal", "x", "y", "z" or a vector (3,)
            Of the blow and of all responses; along normals, nodes inside the body are left out, and always nodes at
            the place of others that move otherwise.
        free : bool, optional
            As in `Modes.from_arrays`.

        Returns
        -------
        Modes
            Where a unit load of ``loads`` acts along the direction, its static compliance is known; elsewhere what the
            modes left out yield is estimated, and a blow there counts the error of that estimate and says so.
        """
        ways = self._ways(direction)
        if free and ways[:, self.axes].any():
            raise ValueError(
                "free must be False or left out: rigid motions are known only of a flat body struck across; give "
                "them as modes of 0 Hz instead"
            )
        kept = np.flatnonzero(ways.any(axis=1))
        moved = np.einsum("ndm,nd->nm", self.shapes[kept], ways[kept])
        unclear = cell_kinds.contradicting(self.nodes[kept][:, self.axes], moved)
        kept, moved = (np.delete(each, unclear, axis=0) for each in (kept, moved))
        place = np.full(len(self.nodes), -1)
        place[kept] = np.arange(len(kept))
        cells = place[self.cells]
        cells = cells[(cells >= 0).all(axis=1)]
        columns, loads, unit_loads = self._unit_loads(ways, place)
        points, flat = self.nodes[kept][:, self.axes], len(self.axes) + 1 == cells.shape[1]
        made = Modes.from_arrays(
            self.frequencies, moved, points=points, mass=self.mass, damping_ratio=self.damping_ratio,
            compliance=columns[kept] if len(loads) else None, loads=loads if len(loads) else None,
            cells=cells if flat and len(cells) else None, free=free, solid=False,
        )  # fmt: skip
        made = dents.settle_dents(made, unit_loads, self.solid)
        odd = plausible.imported_notes(self.nodes, self.shapes, self.mass, self.frequencies)
        squares = unstated.mean_squares(self.nodes, None, self.shapes[..., self.frequencies > 0.0])
        odd = (*odd, *plausible.notes_on_mass(squares, self.mass), *[NOTE] * bool(made.omega.any()))
        sideways = free_body.shapes_sideways(self.shapes[kept], ways[kept], made.n_modes)
        # along one direction they may be small
        notes = [note for note in made.notes if not note.startswith("shapes are")]
        return replace(made, shapes=replace(made.shapes, sideways=sideways), notes=plausible.together(notes, odd))

    def way(self, where: Any, direction: Any = "normal") -> np.ndarray:
        """Unit vector (3,) of a direction, as of `modes`, at a node."""
        row = self.node(where)
        way = self._ways(direction)[row]
        if not way.any():
            raise ValueError(f"direction must be x, y, z or a vector: node {self.numbers[row]} has no normal")
        return np.array(way)

    def _ways(self, direction: Any) -> np.ndarray:
        """Unit vector (n_nodes, 3) along which each node is struck; zero where it cannot be."""
        if isinstance(direction, str) and check.one_of("direction", direction, ("normal", *"xyz")) == "normal":
            if self.normals is None:
                raise ValueError("direction must be x, y, z or a vector: neither cells nor a plane define the normals")
            size = np.linalg.norm(self.normals, axis=1, keepdims=True)
            return np.divide(self.normals, size, out=np.zeros_like(self.normals), where=size > 0.0)
        vector = np.eye(3)["xyz".index(direction)] if isinstance(direction, str) else direction
        vector = check.array("direction", vector, (3,))
        if not vector.any():
            raise ValueError("direction must not be zero")
        return np.tile(vector / np.linalg.norm(vector), (len(self.nodes), 1))

    def _unit_loads(self, ways: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, list[int], list[dents.Load]]:
        """Deflections (n_nodes, n) [m/N] along the ways under unit loads along them, and the points of these loads.

        Several loads on a node are added up to one along its way.
        """
        columns, points, unit_loads = [], [], []
        for number in dict.fromkeys(self.loads[:, 0].astype(int).tolist()):
            row, given = self._row[number], np.flatnonzero(self.loads[:, 0] == number)
            force = self.loads[given, 1:]
            share = np.linalg.lstsq(force.T, ways[row], rcond=None)[0]
            if place[row] >= 0 and np.linalg.norm(share @ force - ways[row]) <= 1.4e-3:  # a twelfth of a degree
                static, others = self.static[:, :, given] @ share, self.numbers != number
                columns.append(np.einsum("nd,nd->n", static, ways))
                points.append(int(place[row]))
                normal = ways[row] if self.normals is None else self.normals[row]
                square = abs(normal @ ways[row]) >= dents.SQUARE * np.linalg.norm(normal)
                axes, under = np.linalg.svd(ways[[row]])[2], static @ ways[row]
                apart = (self.nodes[others] - self.nodes[row]) @ axes[[1, 2, 0]].T  # the third axis along the load
                unit_loads.append(dents.Load(points[-1], apart, under[others], float(under[row]), square))
        return np.column_stack(columns) if columns else np.zeros((len(ways), 0)), points, unit_loads

    def along(self, where: Any, direction: Any = "normal") -> np.ndarray:
        """Shapes (n_modes,) [kg**-0.5] of a node along a direction, both as `node` and `modes` take them."""
        row = self.node(where)
        return np.asarray(self._ways(direction)[row] @ self.shapes[row])

    def displacement(self, q: "ArrayLike", where: Any = None) -> np.ndarray:
        """Displacements (n_times, n_points, 3) [m] at nodes, of the kept modes alone.

        Parameters
        ----------
        q : array_like, shape (n_times, n_modes) [m kg**0.5]
            Modal displacements after a blow on `modes`, ``hit.modal_state(times)[0]``.
        where : a node, by number, name or point, or a list of names or points; by default all nodes
        """
        several = isinstance(where, (list, tuple)) and any(np.ndim(each) or isinstance(each, str) for each in where)
        rows: Any = [self.node(each) for each in where] if several else slice(None)
        rows = rows if several or where is None else [self.node(where)]
        n, moved = len(self.frequencies), check.array("q", q, (None, None))
        if moved.shape[1] < n:
            raise ValueError(f"q must be of modes of this body, {n} of them, got {moved.shape[1]}")
        return np.einsum("tm,ndm->tnd", moved[:, moved.shape[1] - n :], self.shapes[rows])  # added rigid motions first


def _forces(loads: Any) -> np.ndarray:
    """Loads as (n_loads, 4), node number and force [N]."""
    given = list(loads) if isinstance(loads, (list, tuple, np.ndarray)) else [loads]
    found = np.zeros((len(given), 4))
    for row, each in zip(found, given):
        pair = each if isinstance(each, (list, tuple, np.ndarray)) else ()
        if len(pair) not in (2, 4):
            raise ValueError(f"loads must be pairs (node number, force (3,) in N), got {check.shown(each)}")
        force = check.array("loads", pair[1] if len(pair) == 2 else pair[1:], (3,), "N")
        row[0], row[1:] = check.count("loads", pair[0], low=-(10**9)) if len(pair) == 2 else pair[0], force
        if not force.any():
            raise ValueError("loads must not be forces of zero")
    return found


def _normals(nodes: np.ndarray, cells: np.ndarray) -> np.ndarray | None:
    """Unit normals (n_nodes, 3) of triangles, by their areas, or of a flat body; None of other bodies."""
    result = np.zeros(nodes.shape)
    if cells.shape[1] == 3 and len(cells):
        corners = nodes[cells]
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        for corner in cells.T:
            np.add.at(result, corner, areas)
    elif len(nodes) > 2:
        _, size, axes = np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)
        if size[1] <= 1e-6 * size[0] or size[2] > 1e-6 * size[0]:
            return None
        result += axes[2]
    else:
        return None
    size = np.linalg.norm(result, axis=1, keepdims=True)
    return np.divide(result, size, out=np.zeros_like(result), where=size > 0.0)
