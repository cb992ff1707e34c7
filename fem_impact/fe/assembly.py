"""Assemble the stiffness and mass matrices of a body from its mesh, section and supports."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._base import check
from .._base.threads import one_thread
from ..mesh.meshes import Mesh, aligned, mesh_with_holes
from .constraints import Attached, load_and_release
from .corners import Singular, around_corners, around_plane_corners
from .euler import EULER
from .interpolation import Interpolation
from .kirchhoff import ARGYRIS, MORLEY
from .plates import words_in_plane
from .ribs import Rib, mesh_along_ribs
from .section import KINDS, Beam, Elastic, Plate, size_at
from .shallow import SHALLOW
from .shear_beam import TIMOSHENKO
from .splitting import towards_points
from .springs import check_masses, check_posts
from .supports import support_of_facets
from .system import System, notes_on
from .theory import Strain, Subject, Theory, check_own, integrals, plain_kinds, scatter
from .thick import MINDLIN

__all__ = [
    "BY_ELEMENT", "THEORIES", "THICK", "System", "assemble", "clamped", "notes_on", "reassemble", "support_of_facets",
    "support_words", "unknowns_near",
]  # fmt: skip

# the first of a dimension, and of a theory, is the default
EVERY: tuple[Theory, ...] = ARGYRIS, MORLEY, MINDLIN, SHALLOW, EULER, TIMOSHENKO
BY_ELEMENT = {each.element: each for each in EVERY}
THEORIES = {n: tuple(dict.fromkeys(each.name for each in EVERY if each.dimension == n)) for n in (2, 1)}
THICK = tuple(each.name for each in EVERY if each.thick)  # theories with shear and rotary inertia
SECTIONS: dict[int, Any] = {2: Plate, 1: Beam}  # by dimension
HOLDS = {"hinged": 3, "clamped": 6}  # unknowns of a thin plate that a held facet and its first vertex take away


@check.typed
@one_thread
def assemble(
    mesh: Mesh,
    section: Plate | Beam,
    supports: Mapping[str, str | Elastic] | None = None,
    element: str | None = None,
    *,
    theory: str | Theory | None = None,
    point_masses: "Sequence[tuple[ArrayLike, float]]" = (),
    point_supports: "Sequence[ArrayLike | tuple[ArrayLike, float]]" = (),
    near: Any = None,
    coarseness: float = 1.0,
    graded: bool = True,
    layer: float = 1.0,
    rise: Any = None,
    ribs: Sequence[Rib] | None = None,
    in_plane: Mapping[str, str] | None = None,
) -> System:
    """Assemble stiffness and mass of a body supported at its named edges.

    Parameters
    ----------
    mesh : Mesh
    section : Plate on a plane mesh, Beam on a line
    supports : dict, name of an edge -> "clamped", "hinged", "free" or an Elastic
        Edges not named are free. "boundary" means all edges; a support of a part overrides that of the whole. On a
        thick plate "hinged" also holds the rotation along the edge; "soft hinged" does not, nor does an Elastic.
    element : str, optional
        For a thin plate "argyris" (the default; frequencies from above) or "morley" (from below, straight edges only,
        as a check). Otherwise there is one for each theory.
    theory : str or Theory, optional
        For a plate "kirchhoff" (the default; thin) or "mindlin" (with shear and rotary inertia); for a beam "euler" or
        "timoshenko". A thick plate takes some five times as long. A force, a mass or an observed point acts on it over
        a disk of radius 0.325 times the thickness, because under a point it would give way without limit. A plate that
        is curved, ribbed or unevenly layered is "shallow", see `fe.shallow`: thin, with displacements in its plane.
        A theory of your own is a `fe.theory.Theory`, as in ``studies/tutorials/own_theory.py``.
    point_masses : sequence of (point [m], mass [kg])
        Masses without extent that move with the plate or beam.
    point_supports : sequence of (point [m], "hinged" or stiffness [N/m]) or (point [m], "clamped", radius [m])
        Points held at rest, free to turn, or by a spring: cords at the nodes of a marimba bar, the feet of a panel. A
        disk of a plate that is clamped, such as between the nuts of a post, becomes a hole with a clamped edge
        "clamp0" ... of the mesh.
    near : array_like, shape (n_points, dimension) [m], optional
        Points where forces act, such as the strike point; triangles shrink towards them, and a beam gets a node there.
    coarseness : float [-]
        Size of the triangles at these points of a plate, at least 1; the error of the compliance there is about 1e-7
        times its square.
    graded : bool
        Whether to put rings of shrinking triangles at corners where the supports make the solution singular.
    layer : float [-]
        Size of the triangles along free edges of a thick plate, and where the rise of a curved one bends much, over the
        usual one.
    rise : function of points (n, 2) [m] returning (n,) [m], optional
        Height of the unloaded surface of a curved plate above its outline, towards the striker: your own, or one of
        `fi.rise`. Such a shell must be shallow, with slopes below some 0.1.
    ribs : sequence of Rib, optional
        Bars, stiffeners or joists; sides of triangles follow them.
    in_plane : dict, name of an edge -> "held", "free", "sliding" or "across", optional
        How edges are held in the plane of a plate, for curved and stretched ones. A sliding edge is held along itself
        and free across itself, and the reverse is "across". By default hinged and clamped edges are held, others are
        free.

    Returns
    -------
    System

    Raises
    ------
    ValueError
        If section and mesh do not match, an edge does not exist or a support is unknown.

    Examples
    --------
    >>> plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    >>> system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, {"left": "clamped", "right": "hinged"})
    >>> round(system.mass, 6)  # kg
    0.188325
    """
    shaped: dict[str, Any] = {"rise": rise, "ribs": ribs, "in_plane": in_plane}
    shaped = {name: value for name, value in shaped.items() if value is not None}
    if shaped:
        if not isinstance(section, Plate):
            raise ValueError(f"section must be a Plate for {', '.join(shaped)}, got {check.shown(section)}")
        section = replace(section, **shaped)
    if isinstance(section, Plate) and (mesh.rise or section.ribs):
        ribs = [replace(rib, path=mesh.line(rib.path)) for rib in section.ribs]
        section = replace(section, rise=section.rise or mesh.rise, ribs=tuple(ribs))
    usual = usual_theory(section, mesh.dimension)
    if isinstance(theory, Theory):
        rules = theory
        if rules.dimension != mesh.dimension or element is not None:
            raise ValueError(
                f"theory must be of dimension {mesh.dimension} as the mesh, and element left out, got {rules.name!r} "
                f"of dimension {rules.dimension}"
            )
    else:
        named = check.one_of("theory", usual.name if theory is None else theory, THEORIES[mesh.dimension])
        for argument, only, got in (("theory", usual.name, named), ("element", usual.element, element)):
            if usual is SHALLOW and got not in (None, only):
                why = "a plate with rise, ribs or uneven layers"
                raise ValueError(f"{argument} must be {only!r} for {why}, got {check.shown(got)}")
        known = {each.element: each for each in EVERY if each.name == named}
        rules = known[check.one_of("element", next(iter(known)) if element is None else element, tuple(known))]
    supports = {} if supports is None else supports
    if callable(getattr(section, "thickness", None)):
        mesh = aligned(mesh)
    posts, clamps = check_posts(point_supports, mesh.dimension)
    if clamps:
        mesh, supports = mesh_with_holes(mesh, clamps), clamped(supports, len(clamps))
    mesh = mesh_along_ribs(mesh, section)
    attached = Attached(check_masses(point_masses, mesh.dimension), posts)
    near = None if near is None else check.places("near", near, mesh.dimension)
    near, coarseness = None if near is None or not len(near) else near, check.number("coarseness", coarseness)
    if coarseness < 1.0:
        raise ValueError(f"coarseness must be at least 1, got {coarseness:g}")
    layer = check.positive("layer", layer)
    return _assemble_checked(rules, mesh, section, supports, attached, near, graded, layer, coarseness)


def usual_theory(section: Any, dimension: int) -> Theory:
    """The theory of a thin body of a section, on a mesh of a dimension."""
    if dimension == 2 and isinstance(section, Plate) and not section.plain:
        return SHALLOW
    return ARGYRIS if dimension == 2 else EULER


def _assemble_checked(
    rules: Theory, mesh: Mesh, section: Any, supports: Any, attached: Attached, near: np.ndarray | None, graded: bool,
    layer: float = 1.0, coarseness: float = 1.0,
) -> System:  # fmt: skip
    """`assemble` with checked arguments, and `System.layer`."""
    wanted = SECTIONS[mesh.dimension]
    if not isinstance(section, wanted):
        raise ValueError(
            f"section must be a {wanted.__name__} on a mesh of dimension {mesh.dimension}, got {check.shown(section)}"
        )
    given = [] if near is None else list(near)
    held_at = [point for point, _ in (*attached.masses, *attached.posts)]
    marked = np.reshape([*given, *held_at], (-1, mesh.dimension))  # forces act here
    size = np.append(np.full(len(given), coarseness), np.ones(len(held_at)))
    corners, fine = _graded_mesh(rules, mesh, section, supports, marked, graded, layer, size)
    body = Subject(fine, section, support_of_facets(fine, supports, rules.words), marked)
    domain = rules.domain(body, rules.fields)
    held = rules.hold(body, domain)
    if rules not in EVERY:
        check_own(rules, domain, held)
    make = rules.matrices or (lambda _, domain: integrals(rules, domain, np.arange(len(domain.points.x))))
    K, M = (scatter(each, held.dofs, held.expand.shape[0]) for each in make(body, domain))
    if held.ribs is not None:
        K, M = K + held.ribs[0], M + held.ribs[1]
    rows = Interpolation(rules, section, domain.space, domain.frame, held.dofs)
    if near is not None:
        rows.check("near", near)
    matrices, springs = load_and_release(K, M, held, domain, attached, rows)
    mass = float(domain.fields["inertia"].sum()) * domain.frame.mass + sum(mass for _, mass in attached.masses)
    if held.ribs is not None:
        lifted = domain.space.rigid_unknowns(held.dofs, held.expand.shape[0])[:, 0]
        springs, mass = springs + held.ribs[0], mass + float(lifted @ (held.ribs[1] @ lifted)) * domain.frame.mass
    strain = Strain(domain, springs) if rules.sharp is not None and rules.sharp(domain) else None
    return System(
        mesh, section, supports, rules, mass, domain.frame, **matrices, element_dofs=held.dofs, space=domain.space,
        graded=graded, rim=held.rim, corners=corners, softness=domain.softness, point_masses=tuple(attached.masses),
        point_supports=tuple(attached.posts), strain=strain, near=near, coarseness=coarseness, layer=layer,
    )  # fmt: skip


def _graded_mesh(
    rules: Theory, mesh: Mesh, section: Any, supports: Any, points: np.ndarray, graded: bool, layer: float,
    coarseness: Any,
) -> tuple[dict[int, Singular], Mesh]:  # fmt: skip
    """Singular corners of a plate, and the mesh that shrinks to them, to layers and to points (n, 2) [m]."""
    if not rules.graded:
        return {}, mesh

    def kinds(mesh: Mesh) -> list[str]:
        return plain_kinds(support_of_facets(mesh, supports, rules.words))

    corners, fine = around_corners(mesh, kinds(mesh), section.material)
    fine = fine if graded else mesh
    if graded and rules.has_plane:
        fine = around_plane_corners(fine, words_in_plane(fine, section, kinds(fine)), section, layer)
    if rules.layered is not None:
        fine = rules.layered(fine, section, kinds(fine), layer)
    if len(points):
        least = rules.patch * size_at(section, "thickness", points) if rules.patch else 0.0
        held = np.array([kind != "free" for kind in support_of_facets(fine, supports, rules.words)])
        fine = towards_points(fine, points, held, least, coarseness)
    return corners, fine


def unknowns_near(
    mesh: Mesh, section: Plate, supports: dict[str, Any], points: np.ndarray, graded: bool = True,
    coarseness: Any = 1.0, layer: float = 1.0,
) -> int:  # fmt: skip
    """About how many unknowns `assemble` makes of a thin plate with elements that shrink towards points; 1 % more."""
    rules = usual_theory(section, 2)
    fine = _graded_mesh(rules, mesh, section, supports, points, graded, layer, coarseness)[1]
    held = [HOLDS.get(kind, 0) for kind in plain_kinds(support_of_facets(fine, supports))]
    sides = (3 * len(fine.cells) + len(fine.facets)) // 2
    within = 2 * (len(fine.points) + 3 * sides + 3 * len(fine.cells)) if rules.has_plane else 0
    return 6 * len(fine.points) + sides - sum(held) + within


def reassemble(
    system: System, mesh: Mesh, near: np.ndarray | None = None, layer: float | None = None, element: str | None = None
) -> System:
    """Assemble the same body on another mesh.

    ``near`` (n_points, dimension) [m], ``layer`` and ``element`` replace those of the system.
    """
    rules = system.rules if element is None else BY_ELEMENT[element]
    coarseness = system.coarseness if near is None else 1.0
    near, layer = system.near if near is None else near, system.layer if layer is None else layer
    attached = Attached(list(system.point_masses), list(system.point_supports))
    rest = attached, near, system.graded, layer, coarseness
    return _assemble_checked(rules, mesh, system.section, system.supports, *rest)


def clamped(supports: Any, n_clamps: int) -> dict[str, Any]:
    """Supports of the edges, with those of clamps by `mesh_with_holes`."""
    if not isinstance(supports, dict):
        raise ValueError(f"supports must be a dict of edge name -> support, got {check.shown(supports)}")
    return {**supports, **{f"clamp{i}": "clamped" for i in range(n_clamps)}}


def support_words(theory: str | None) -> tuple[str, ...]:
    """Words for the support of an edge, besides `Elastic`."""
    return next((each.words for each in EVERY if each.name == theory), KINDS)
