"""What is struck: a body to assemble, an assembled `System` or finished `Modes`, and how its modes are found."""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from .._base import check
from .._base.remembered import Remembered
from .._base.rounding import SAME
from ..fe import plausible, refinement
from ..fe.assembly import (
    EVERY,
    THEORIES,
    THICK,
    System,
    assemble,
    notes_on,
    reassemble,
    support_of_facets,
    support_words,
    unknowns_near,
    usual_theory,
)  # fmt: skip
from ..fe.ribs import mesh_along_ribs
from ..fe.section import Beam, Plate
from ..fe.springs import is_sprung
from ..mesh.meshes import Mesh, sizes
from ..modes import analytic, finding
from ..modes.air import in_air
from ..modes.modal import Damping, Modes
from ..modes.shapes import FieldShapes
from ..modes.stretching import HELD
from .budget import CHEAP

LOG = logging.getLogger(__name__)
MODELS = ("stated", "auto")  # whether the theory and the air of a target are chosen
BOTH = "both sides"
AIR = {"one side": 1, BOTH: 2}  # sides of a plate in open air
FIRST_LOOK = 20  # [-] modes found first: enough to scale the body and to predict the density of the others
RIGID_MOTIONS = 3  # [-] fact: most that a free body has before its first flexible mode
FIRST_FLEXIBLE = RIGID_MOTIONS + 1  # [-] fact: modes that hold a flexible one
CLOSE = 1e-6  # [-] error of a frequency to which a body is scaled or designed: far below the tolerance of usual blows

Watch = Callable[[str], AbstractContextManager[Any]]
# Says where an error comes from; takes "mesh", "supports" or another part of a scene, and the names of what was changed
Blame = Callable[..., AbstractContextManager[Any]]


class Elements(NamedTuple):
    """The triangles of a struck plate."""

    size: float  # [m]
    coarseness: float = 0.0  # [-] of those at the blow, see `assemble`; stands for 1 if it is less
    layer: float = 1.0  # [-] of those where it is curved, see `assemble`

    @property
    def at_blow(self) -> float:
        """Coarseness as `assemble` takes it."""
        return max(1.0, self.coarseness)


def _nobody(*_: Any) -> AbstractContextManager[Any]:
    return nullcontext()


class Stages:
    """Wall time of each stage; ``watch`` may display the stages, and the log of the package reports them."""

    def __init__(self, watch: Watch | None = None) -> None:
        self.watch: Watch = watch or nullcontext
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        start = perf_counter()
        try:
            with self.watch(name):
                yield
        finally:
            spent = perf_counter() - start
            self.seconds[name] = self.seconds.get(name, 0.0) + spent
            LOG.info("%s: %.3f s", name, spent)


@dataclass(frozen=True, eq=False)
class Target:
    """The struck body. Its modes are found at its own mass and stiffness, then scaled and damped."""

    mesh: Mesh | None = None  # None if only modes are known
    section: Plate | Beam | None = None
    supports: Mapping[str, Any] = field(default_factory=dict)
    point_masses: tuple[Any, ...] = ()
    point_supports: tuple[Any, ...] = ()
    scale: Mapping[str, float] = field(default_factory=dict)  # mass [kg], first_frequency [Hz] to scale to
    damping_ratio: Damping | None = None  # None keeps that of the modes
    source: str = "auto"  # "fe", "analytic" or "auto": closed formulas if there are any and no size is stated
    theory: str | None = None  # "kirchhoff", "mindlin", "euler", "timoshenko"; None is the thin one
    system: System | None = None  # assembled by the user
    modes: Modes | None = None  # found by the user
    model: str = "stated"  # "auto" takes a thick theory, air and stretching where the tolerance requires them
    air: str | None = None  # which sides face open air, of AIR; None is a vacuum
    baffle: bool = True  # whether a plate fills a hole in a large rigid wall, as air and sound see it
    stretching: bool = False  # whether large deflections stretch and stiffen it
    blame: Blame = _nobody

    def __post_init__(self) -> None:
        if self.theory is not None and self.mesh is not None:
            check.one_of("theory", self.theory, THEORIES[self.mesh.dimension])
        if self.mesh is not None:
            check.settle(self, mesh=mesh_along_ribs(self.mesh, self.section))
        if self.air is not None and self.mesh is not None and self.mesh.dimension != 2:
            raise ValueError("air is known around plates only; leave it out")
        if self.source == "analytic" and self.closed is None:
            raise ValueError(
                "source = 'analytic' covers beams of constant section, thin rectangles hinged all round and thin disks "
                "without a hole held alike all round, isotropic and without springs, masses or point supports; use "
                "source = 'fe'"
            )

    @classmethod
    def of(cls, body: "System | Modes", damping_ratio: Damping | None = None) -> "Target":
        """The target that a user has assembled, or whose modes a user has found."""
        if isinstance(body, Modes):
            return cls(modes=body, damping_ratio=damping_ratio)
        if body.element == "morley":
            raise ValueError(
                "target must not be a system of element 'morley', which serves to check frequencies; assemble it with "
                "'argyris', or give its modes of `find_modes`"
            )
        if body.rules not in EVERY:
            raise ValueError(f"target must be the modes of `find_modes`, as the theory {body.theory!r} is your own")
        posts = tuple((at, "hinged" if np.isinf(stiffness) else stiffness) for at, stiffness in body.point_supports)
        held, masses = body.supports, body.point_masses
        return cls(body.mesh, body.section, held, masses, posts, {}, damping_ratio, "fe", body.theory, body)

    def changed(self, **changes: Any) -> "Target":
        """The same body by another model, which has the first modes that are known, unless its theory is another."""
        better = replace(self, **changes)
        if "theory" not in changes:
            check.settle(better, _known=self._known)
        return better

    @cached_property
    def closed(self) -> Callable[..., Modes] | None:
        """Closed formulas for this body, see `analytic.closed_form`; None if there are none."""
        if self.mesh is None or self.section is None or self.point_masses or self.point_supports:
            return None
        return analytic.closed_form(self.mesh, self.section, dict(self.supports), self.theory)

    @property
    def thick(self) -> bool:
        """Whether shear and rotary inertia count."""
        return self.theory in THICK

    @property
    def element(self) -> str:
        """The elements of a thin plate, as `near` assembles it."""
        return usual_theory(self.section, 2).element

    @property
    def similar(self) -> bool:
        """Whether other lengths, or another thickness, rescale all its modes alike."""
        section = self.section
        pulled = isinstance(section, Plate) and (section.tension or not section.plain)
        held = is_sprung(self.supports, self.point_supports) or bool(self.point_masses)
        return self.mesh is not None and not (pulled or held or self.thick or self.air)

    @property
    def can_stretch(self) -> bool:
        """Whether it is known how it stretches: material and section are stated, and what holds it in its plane."""
        if self.mesh is None or self.section is None or self.scale:
            return False
        kinds = support_of_facets(self.mesh, dict(self.supports), support_words(self.theory))
        if self.mesh.dimension == 2:
            return all(isinstance(kind, str) for kind in kinds)
        return set(kinds) <= set(HELD)

    @property
    def kind(self) -> str:
        """Where the modes come from: "modes", "fe" or "analytic"."""
        if self.modes is not None:
            return "modes"
        if self.source != "auto":
            return self.source
        return "fe" if self.size_stated or self.closed is None else "analytic"

    @property
    def size_stated(self) -> bool:
        """Whether the user chose the element size."""
        return self.mesh is not None and self.mesh.size_stated

    @property
    def assumed(self) -> tuple[str, ...]:
        """What the mesh assumed, and numbers of the body that are probably a slip of a unit."""
        if self.mesh is None or self.section is None:
            return () if self.modes is None else self.modes.notes
        ratio = self.damping_ratio
        damping = () if ratio is None or callable(ratio) else plausible.notes_on_damping(np.atleast_1d(ratio))
        return plausible.together(notes_on(self.mesh, self.section), damping)

    def damped(self, modes: Modes) -> Modes:
        """The modes with the damping of this body, if it has its own."""
        return modes if self.damping_ratio is None else modes.damped(self.damping_ratio)

    def finished(self, modes: Modes) -> Modes:
        """The modes scaled and damped."""
        return self.damped(modes.scaled(**self.scale) if self.scale else modes)

    def surrounded(self, modes: Modes, finer: float = 1.0) -> Modes:
        """The modes as struck: scaled, damped and in the air around; ``finer`` as in `in_air`."""
        modes = self.finished(modes)
        if self.air is not None:
            with self.blame("target"):
                modes = in_air(modes, sides=AIR[self.air], baffled=self.baffle, finer=finer)
        return replace(modes, stretches=True) if self.stretching else modes

    @cached_property
    def stretch(self) -> float:
        """Factor [-] by which scaling raises every frequency; found from the first mode."""
        if "first_frequency" not in self.scale:
            return 1.0
        if self.closed is not None and self.source != "fe":
            modes = self.closed(n_modes=FIRST_LOOK)
        else:
            modes = self.first_flexible
        return float(self.finished(modes).frequencies[-1] / modes.frequencies[-1])

    @cached_property
    def first_flexible(self) -> Modes:
        """The modes up to the first that bends the body, to 1e-6, or as close as corners let any mesh come."""
        return self.find(FIRST_FLEXIBLE, tolerance=CLOSE, enough=refinement.LOOSEST)

    def check_first(self, tolerance: float) -> None:
        """Raise SimulationError if the first mode, to which the body is scaled, is too uncertain for a tolerance."""
        if "first_frequency" not in self.scale or self.closed is not None:
            return
        errors, omega = self.first_flexible.frequency_error, self.first_flexible.omega
        error = 0.0 if errors is None else float(errors[omega > 0.0][0])
        if error > (allowed := 2.0 * CHEAP * tolerance):
            raise check.SimulationError(
                f"the first mode, which first_frequency sets, is uncertain by {error:.1e} on any mesh, and "
                f"tolerance = {tolerance:g} allows {allowed:.1e}; give a tolerance of at least "
                f"{float(f'{1.1 * error / allowed * tolerance:.1e}'):g}"
            )

    def wave(self, frequency: float, tense: bool = True) -> float:
        """Largest wavenumber [rad/m] of the plate's own waves, before scaling, at a frequency [Hz].

        If not ``tense``, that without its tension, which does not act on lengths below that of the bending layer.
        """
        bending, tension, inertia = self._sections
        tension, pull = tension if tense else 0.0, inertia * (2.0 * np.pi * frequency) ** 2
        # omega**2 inertia = bending k**4 + tension k**2; k is zero at 0 Hz without tension, too, where both are
        root = np.sqrt(tension**2 + 4.0 * bending * pull)
        return float((2.0 * pull / np.maximum(root + tension, np.finfo(float).tiny)).max() ** 0.5)

    @property
    def _sections(self) -> tuple[np.ndarray, float, np.ndarray]:
        """Least bending stiffness [N m], tension [N/m] and mass per area [kg/m^2] of the plate in its cells."""
        section, mesh = self.section, self.mesh
        assert isinstance(section, Plate) and mesh is not None
        middle = mesh.points[mesh.cells].mean(axis=1)
        stiffness = section.stiffness(middle)
        return np.minimum(stiffness[:, 0, 0], stiffness[:, 1, 1]), section.tension or 0.0, section.inertia(middle)

    @property
    def mass(self) -> float:
        """Mass [kg] of the body as struck."""
        assert self.mesh is not None and self.section is not None
        points, cells = self.mesh.points, self.mesh.cells
        within = sizes(points, cells)
        own = self.mesh.area * float(within @ self.section.inertia(points[cells].mean(axis=1)) / within.sum())
        return self.scale.get("mass", own + sum(mass for _, mass in self.point_masses))

    def count_below(self, frequency: float) -> float:
        """About how many modes the plate has below a frequency [Hz], before scaling; Weyl's law without its edges.

        Waves of a thick plate are shorter, and above a frequency those of shear and twist over its thickness come, too.
        """
        assert self.mesh is not None
        square, section = self.wave(frequency) ** 2, self.section
        if self.thick and isinstance(section, Plate):
            middle, pull = self.mesh.points[self.mesh.cells].mean(axis=1), (2.0 * np.pi * frequency) ** 2
            bending, _, inertia = self._sections
            shear, turning = np.linalg.eigvalsh(section.shear(middle))[:, 0], pull * section.rotary(middle)
            mean, root = 0.5 * (pull * inertia / shear + turning / bending), pull * inertia / bending
            root = np.sqrt(root + 0.25 * (pull * inertia / shear - turning / bending) ** 2)
            twisted = (turning - shear) / section.stiffness(middle)[:, 2, 2]
            square = (mean + root + np.maximum(mean - root, 0.0) + np.maximum(twisted, 0.0)).max()
        return float(square * self.mesh.area / (4.0 * np.pi))

    def frequency_below(self, count: float) -> float:
        """Frequency [Hz], before scaling, below which the plate has about so many modes; see `count_below`."""
        assert self.mesh is not None
        squared, (bending, tension, inertia) = 4.0 * np.pi * count / self.mesh.area, self._sections  # of its wave
        return float(((bending * squared + tension) * squared / inertia).min() ** 0.5 / (2.0 * np.pi))

    @cached_property
    def _known(self) -> Remembered:  # first modes; meshes and their unknowns, of which a plan counts two or three
        return Remembered(7)

    def _meshed(self, size: float, stages: Stages) -> Mesh:
        """The mesh with elements of another size [m]."""
        assert self.mesh is not None
        mesh = self.mesh
        if np.isclose(size, mesh.size, rtol=1e-9):
            return mesh
        with stages("mesh"), self.blame("mesh"):
            return self._known.recall(size, lambda: mesh.refined(mesh.size / size))

    def n_cells(self, size: float, stages: Stages) -> int:
        """Number of triangles of a size [m], before they shrink towards a blow."""
        return len(self._meshed(size, stages).cells)

    def unknowns(self, at: np.ndarray, elements: Elements, stages: Stages) -> int:
        """About how many unknowns `near` makes; it takes a tenth of the time."""

        def count() -> int:
            assert isinstance(self.section, Plate)
            mesh, graded = self._meshed(elements.size, stages), self.system is None or self.system.graded
            with stages("mesh"), self.blame("supports"), np.errstate(all="ignore"):
                masses = np.reshape([place for place, _ in self.point_masses], (-1, 2))
                points, coarseness = np.vstack([at, masses]), np.ones(len(at) + len(masses))
                coarseness[: len(at)] = elements.at_blow
                each = coarseness, elements.layer
                return unknowns_near(mesh, self.section, dict(self.supports), points, graded, *each)

        return self._known.recall(np.append(elements, at).tobytes(), count)

    def near(self, at: np.ndarray, elements: Elements, stages: Stages) -> System:
        """The body assembled with elements that shrink towards points (n_points, 2) [m]."""
        graded = self.system is None or self.system.graded
        how = {"near": at, "coarseness": elements.at_blow, "graded": graded, "layer": elements.layer}
        return self._assembled(self._meshed(elements.size, stages), stages, **how)

    def _assembled(self, mesh: Mesh, stages: Stages, **how: Any) -> System:
        assert self.section is not None
        with stages("assembly"), self.blame("supports"), np.errstate(all="ignore"):
            masses, posts = self.point_masses, self.point_supports
            return assemble(mesh, self.section, dict(self.supports), point_masses=masses, point_supports=posts, **how)

    def find(
        self,
        n_modes: int,
        max_frequency: float | None = None,
        *,
        tolerance: float,
        size: float | None = None,
        first: Modes | None = None,
        stages: Stages | None = None,
        keep: Any = None,
        enough: float = 0.0,
    ) -> Modes:
        """Modes before `finished`: the first ``n_modes``, or those up to a frequency [Hz] if it is given.

        ``tolerance`` [-] is the largest error of the first modes' frequencies, or ``enough`` where no mesh comes as
        close; an element ``size`` [m] replaces the mesh's own. The mesh of modes found ``first`` is refined if it
        cannot resolve the frequency. ``stages`` measure meshing and assembly; ``keep`` as in `find_modes`.
        """
        reach: dict[str, Any] = {"n_modes": n_modes} if max_frequency is None else {"max_frequency": max_frequency}
        if self.modes is not None:
            return self.modes.truncated(**reach)
        find = partial(self._found, reach, (tolerance, enough), size, first, stages, keep)
        if reach == {"n_modes": FIRST_LOOK} and first is None and keep is None:  # plans of several blows share them
            return self._known.recall((tolerance, size), find)
        return find()

    def _found(
        self, reach: Mapping[str, Any], close: tuple[float, float], size: float | None, first: Modes | None,
        stages: Stages | None, keep: Any,
    ) -> Modes:  # fmt: skip
        """What `find` finds of a body whose modes are not known."""
        insisted, allowed = size is not None or self.size_stated, min(close[0], refinement.LOOSEST)
        if self.kind == "analytic" and (size is None or self.source == "analytic"):
            assert self.closed is not None
            with self.blame("mesh"), np.errstate(all="ignore"):  # an overflow becomes inf, which the checks refuse
                return self.closed(**reach)
        if first is not None:
            return self._following(first, reach, allowed, insisted, keep)
        body = self.assembled(stages or Stages(), size)
        with self.blame("mesh"), np.errstate(all="ignore"):
            if insisted:
                return finding.find_modes(body, **reach, keep=keep)
            return finding.modes_of(
                refinement.refine(body, reach.get("n_modes"), reach.get("max_frequency"), allowed, True, close[1])
            )

    def _following(self, first: Modes, reach: Mapping[str, Any], allowed: float, insisted: bool, keep: Any) -> Modes:
        """Modes from the mesh of the ``first`` ones, refined where it is too coarse for their waves."""
        assert isinstance(first.shapes, FieldShapes)
        body = first.shapes.system
        with self.blame("mesh"), np.errstate(all="ignore"):
            side = refinement.longest_side(body.rules, allowed)
            size = refinement.size_for(body, reach.get("n_modes"), reach.get("max_frequency"), side)
            body = refinement.fine_enough(replace(body, mesh=replace(body.mesh, size_stated=insisted)), size)
            body = replace(body, mesh=replace(body.mesh, size_stated=True))
            modes = finding.find_modes(body, **reach, keep=keep)
            assert isinstance(modes.shapes, FieldShapes)
            return replace(modes, shapes=modes.shapes.after(first.shapes))

    def number_below(self, modes: Modes, limit: float) -> float:
        """About how many modes there are below a frequency [Hz], by Weyl's law from the first ones, all as struck.

        What its edges add or take grows as the root of its own count; the first modes say how much. Those of a strip
        crowd, or are those of a beam, and mislead: then the law itself counts the others.
        """
        section, low, number = self.section, float(modes.frequencies[-1]), float(modes.n_modes)
        if not low:  # a rigid body has no others
            return number
        if self.mesh is None or not isinstance(section, Plate):
            return number * (limit / low) ** (0.5 * modes.dimension)
        near, far = (self.count_below(frequency / self.stretch) for frequency in (low, limit))
        grown, law = max(0.0, far + (number - near) * (far / near) ** 0.5), number + far - near
        # the largest of its wavenumbers is twice the mean across strong grain
        return law if limit > low and not law / 3.0 <= grown <= 3.0 * law else grown

    def assembled(self, stages: Stages, size: float | None = None) -> System:
        """The assembled body, with elements of the given size [m] or the mesh's own."""
        assert self.mesh is not None
        mesh = self.mesh
        if size is not None:
            with stages("mesh"), self.blame("mesh"):
                mesh = mesh.refined(max(SAME, mesh.size / check.positive("size", size, "m")))
        if self.system is not None:
            return self.system if size is None else reassemble(self.system, mesh)
        return self._assembled(mesh, stages, theory=self.theory)
