"""Choose the smallest model of a scene that meets its tolerance, and run it."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from .._base import check
from ..fe import plausible, refinement
from ..fe.assembly import System, notes_on, support_of_facets
from ..impact import accuracy, collision
from ..impact.collision import BAND_POINTS
from ..impact.contact import Contact
from ..impact.quantities import asked_for
from ..impact.response import Response
from ..impact.striker import Striker
from ..modes.modal import FieldShapes, Modes, at_rest, damping_notes
from . import idealisation
from .plan import Plan

SHARE = 0.45  # [-] of the tolerance for left-out modes, as much for the time steps; the mesh gets the rest
MARGINS = (1.0, 4.0, 16.0)  # [-] these divide the mode error limit in turn, until the left-out modes no longer matter
NOTCH = 8.0  # [-] the verifying run divides the tolerance by this
FINEST = 1e-10  # [-] lowest tolerance of a verifying run
CAUTION = 2.0  # [-] safety factor on the mode error: costs a quarter more modes, but seldom needs a second run
FIRST_LOOK = 20  # [-] modes found first: enough to scale the body and to predict the density of the others
MOST_MODES = {"fe": 2000, "analytic": 50_000}  # [-] limit by source: takes about 2 GB and some minutes
SHORT_WAVES = {"argyris": 1e-5, "hermite": 1e-9}  # [-] frequency error for which `find_modes` chooses the mesh
LOOK = 20.0  # [-] closed-form modes up to this multiple of the contact frequency decide if a body counts as rigid
MOST_LOOKED_AT = 5000  # [-] upper limit on the number of these modes
PIECES = {"target": "", "size": "m", "n_modes": "", "max_frequency": "Hz", "n_striker_modes": ""}  # that a user may set
TARGETS = ("rigid", "infinite", "modal")
DOFS_PER_AREA = {"argyris": 10.4, "hermite": 2.0}  # [-] unknowns per square, or length, of the element size
RATES = {"start": 0.02, "dofs": 6e-5, "pairs": 3.5e-7, "steps": 1e-8}  # [s] each, measured by studies/frontier.py
BYTES = {"start": 2e8, "dofs": 6e3, "pairs": 40.0}  # [byte] each, measured likewise

Watch = Callable[[str], AbstractContextManager[Any]]


@dataclass(frozen=True)
class Run:
    """The result of running a plan, with its run times."""

    response: Response
    seconds: Mapping[str, float]  # [s] wall time of each stage, by its name
    plan: Plan  # the plan as run, with the actual number of modes and errors
    notes: tuple[str, ...] = ()  # what was assumed, and numbers that are probably a slip of a unit
    verified: Mapping[str, float] | None = None  # [-] differences from a finer run, see `verify`
    finer: Plan | None = None  # plan of the finer run

    __repr__ = check.brief


class Stages:
    """Wall time of each stage; ``watch`` may display the stages."""

    def __init__(self, watch: Watch | None = None) -> None:
        self.watch = watch or (lambda name: nullcontext())
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            with self.watch(name):
                yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class _Blow:
    """The checked blow of a scene."""

    values: Mapping[str, Any]  # arguments of `strike`
    pieces: Mapping[str, Any]  # pieces of the plan set by the user
    tolerance: float  # [-]
    quantities: Mapping[str, float | None]
    striker: Striker
    contact: Contact
    duration: float  # [s] contact time on a rigid wall


@dataclass(frozen=True)
class _Outside:
    """What is known of a target without finite elements, and the errors of simplifying it."""

    mass: float  # [kg] mass of the whole body
    rigid: float  # [-] error of treating it as rigid
    endless: float  # [-] error of treating it as infinite; inf if that is wrong or unknown
    mobility: float  # [m/(N s)] of the infinite plate; inf if unknown
    notes: tuple[str, ...]  # as in `Plan`


def make(scene: Any, changes: Mapping[str, Any], stages: Stages) -> Plan:
    """Choose the model of a scene; see `Scene.plan`."""
    changes = {name: value for name, value in changes.items() if value is not None}
    blow = _checked(scene, changes)
    target = blow.pieces.get("target")
    if target is None and {"size", "n_modes", "max_frequency"} & set(blow.pieces):
        target = "modal"
    plan = None if target == "modal" else _idealised(scene, changes, blow, target, stages)
    return plan or _modal(scene, changes, blow, stages)


def carry_out(plan: Plan, stages: Stages, keep: Any = None) -> Run:
    """Run the plan; if the left-out modes turn out to matter, run it again with more modes.

    ``keep`` is a file that stores the modes of a costly plan.
    """
    scene = plan.scene
    blow = _checked(scene, plan.changes)
    fixed = {"n_modes", "max_frequency"} & set(blow.pieces) or not blow.values.get("residual", True)
    asked = {**blow.values, "tolerance": SHARE * blow.tolerance}
    for margin in MARGINS:
        if margin > 1.0:
            plan = _modal(scene, plan.changes, blow, stages, plan.first, margin)
        modes, striker = target(plan, stages, keep), collision.shortened(blow.striker, plan.n_striker_modes)
        if plan.target == "modal":
            with scene.blame("observe"):
                for point in scene.points:
                    modes.points("points", [point])
        with stages("strike"), scene.blame("strike"):
            response = collision.strike(modes, striker, blow.contact, **asked)
        if plan.target != "modal" or fixed or response.error.truncation <= SHARE * blow.tolerance:
            break
    idealised = plan.errors.get("rigid target", 0.0) + plan.errors.get("infinite plate", 0.0)
    error = replace(response.error, idealisation=idealised)
    response = replace(response, tolerance=blow.tolerance, error=error)
    plan = replace(plan, n_modes=modes.n_modes if plan.target == "modal" else 0)
    return Run(response, MappingProxyType(stages.seconds), plan, plausible.together(plan.notes, response.notes))


def tolerance_of(scene: Any, values: Mapping[str, Any] | None = None) -> float:
    """The tolerance [-] of a scene; ``values`` replaces the values of its blow."""
    if values is None:
        with scene.blame("strike"):
            return tolerance_of(scene, scene.blow.values)
    return check.between("tolerance", values.get("tolerance", collision.TOLERANCE), 1e-12, 1.0)


def verify(run: Run, watch: Watch | None = None) -> Run:
    """Run again with a finer model and record how much the results differ (`Run.verified`).

    The tolerance is divided by eight and the element size by 1.5. A rigid or infinite target gets modes, unless that
    takes too many.
    """
    plan = run.plan
    finer: dict[str, Any] = {"tolerance": max(FINEST, plan.tolerance / NOTCH), "target": "modal"}
    if plan.size is not None:
        finer["size"] = plan.size / 1.5
    finer.update({name: None for name in ("n_modes", "max_frequency", "n_striker_modes", "dt") if name in plan.changes})
    try:
        other = plan.scene.run(watch, **{**plan.changes, **finer})
    except check.SimulationError:
        if plan.target == "modal":
            raise
        other = plan.scene.run(watch, **{**plan.changes, **finer, "target": plan.target})
    one, two = run.response, other.response
    true = {
        "restitution": abs(one.restitution - two.restitution),
        "n_impacts": float(abs(one.n_impacts - two.n_impacts)),
    }
    for name in ("impulse", "contact_time", "peak_force"):
        size = getattr(two, name)
        true[name] = abs(getattr(one, name) - size) / size if size else 0.0
    for name, band in plan.quantities.items():
        if band is not None:
            spectra = [response.spectrum(np.linspace(0.0, band, BAND_POINTS)) for response in (one, two)]
            true[name] = float(np.abs(spectra[0] - spectra[1]).max() / (np.abs(spectra[1]).max() or 1.0))
    return replace(run, verified=MappingProxyType(true), finer=other.plan)


def _checked(scene: Any, changes: Mapping[str, Any]) -> _Blow:
    pieces = {name: changes[name] for name in PIECES if name in changes}
    values = {**scene.blow.values, **{name: value for name, value in changes.items() if name not in PIECES}}
    for name, value in pieces.items():
        if name == "target":
            check.one_of("target", value, TARGETS)
        elif PIECES[name]:
            check.positive(name, value, PIECES[name])
        else:
            check.count(name, value)
    with scene.blame("strike", changes):
        tolerance = tolerance_of(scene, values)
        speed = check.positive("speed", values["speed"], "m/s")
        for name in ("duration", "dt"):
            if values.get(name) is not None:
                values[name] = check.positive(name, values[name], "s")
        if values.get("scheme") is not None:
            check.one_of("scheme", values["scheme"], collision.SCHEMES)
        if values.get("max_impacts") is not None:
            check.count("max_impacts", values["max_impacts"])
        for name in ("striker_force", "target_force"):
            values[name] = check.number(name, values.get(name, 0.0), "N")
        quantities = asked_for(values.get("quantity"))
    striker, contact = scene.make_striker(), scene.make_contact()
    duration = accuracy.contact_duration(contact, striker.felt_mass, speed)
    return _Blow(values, pieces, tolerance, quantities, striker, contact, duration)


def _idealised(scene: Any, changes: Mapping[str, Any], blow: _Blow, target: str | None, stages: Stages) -> Plan | None:
    """The plan with a rigid or infinite target, if that is accurate enough or the user asks for it; else None."""
    values = blow.values
    pressed = values.get("striker_force") or values.get("target_force") or blow.contact.gap < 0.0
    moving = "sound" in blow.quantities or scene.observe is not None  # the user asks for the target's motion
    if target is None and (pressed or moving or not values.get("residual", True)):
        return None
    seen = _outside(scene, blow, stages)
    allowed = SHARE * blow.tolerance
    if target is not None:
        if seen is None or (target == "infinite" and not np.isfinite(seen.mobility)):
            raise scene.fault(f"target = {target!r} {_unfit(scene, blow)}; use target = 'modal'")
    elif seen is None:
        return None
    elif seen.rigid <= allowed:
        target = "rigid"
    elif seen.endless <= allowed:
        target = "infinite"
    else:
        return None
    if target == "rigid":
        error = {"rigid target": seen.rigid}
        kept = f"the target, {seen.mass:.3g} kg, is treated as rigid: that changes the blow by {seen.rigid:.1e}"
    else:
        error = {"infinite plate": seen.endless}
        kept = (
            f"the target is treated as an infinite plate of mobility {seen.mobility:.3g} m/(N s): the striker leaves "
            f"before an echo returns from the edge; that changes the blow by {seen.endless:.1e}"
        )
    dropped = "no mesh and no modes are needed; the target's sound is not computed"
    return _plan(
        scene, changes, blow, target=target, errors=error, reasons=(kept, dropped), mass=seen.mass,
        mobility=seen.mobility if target == "infinite" else 0.0, notes=seen.notes,
    )  # fmt: skip


def _unfit(scene: Any, blow: _Blow) -> str:
    """Why a target cannot be treated as rigid or infinite without its modes."""
    body = scene.body()
    if body.dimension == 1:
        return "is not known for this beam"
    view = idealisation.Surroundings.seen(body, check.array("at", blow.values["at"], (2,), "m", lift=True))
    if view is None:
        raise scene.fault(f"[strike] at must lie on the body, got {check.shown(blow.values['at'])} m")
    if "first_frequency" in scene.scale:
        return "needs E, nu, rho and thickness: first_frequency gives the rigidity only once the modes are known"
    return "is known for isotropic plates without tension only"


def _outside(scene: Any, blow: _Blow, stages: Stages) -> _Outside | None:
    """What is known of the target without finite elements; None if that is not enough."""
    scale, find = scene.scale, scene.closed_form()
    mass, duration = blow.striker.felt_mass, blow.duration
    stretch, rigid, notes = 1.0, np.inf, damping_notes(np.array([scene.damping_ratio]), np.ones(1))
    if find is not None:
        with stages("modes"):
            first = find(FIRST_LOOK)
        modes = first.scaled(**scale)
        stretch = modes.frequencies[-1] / first.frequencies[-1]
        with scene.blame("strike"):
            at = modes.point("at", blow.values["at"])[0]
        notes = plausible.together(modes.notes, notes, at_rest(modes, at[None]))
        most = modes.frequencies[-1] * (MOST_LOOKED_AT / FIRST_LOOK) ** (2.0 / modes.dimension)
        limit = min(LOOK * 0.5 / duration, most)
        if limit > modes.frequencies[-1]:
            modes = find(FIRST_LOOK, limit / stretch, first).scaled(**scale)
        rigid = idealisation.rigid_error(modes, at, mass, duration)
        if modes.dimension == 1:
            return _Outside(modes.mass, rigid, np.inf, np.inf, notes)
    with stages("mesh"):
        body = scene.body()
    if body.dimension == 1:
        return None
    with scene.blame("supports"):
        free = "free" in support_of_facets(body, dict(scene.supports.values))
    with scene.blame("strike"):
        at = check.array("at", blow.values["at"], (2,), "m", lift=True)
    view = idealisation.Surroundings.seen(body, at)
    if view is None:
        return None
    section = scene.make_section("plate")
    material, notes = section.material, plausible.together(notes_on(body, section), notes)
    rate = stretch * section.thickness * float(np.sqrt(material.E / 12.0 / (1.0 - material.nu**2) / material.rho))
    whole = scale.get("mass", section.thickness * material.rho * view.area)
    if find is None:
        if "first_frequency" in scale:
            low = idealisation.slowest_rate(view, scale["first_frequency"])
        else:
            low = rate * float(np.sqrt(min(material.E, material.E_across or np.inf) / material.E))
        rigid = idealisation.rigid_bound(view, whole, low, free, mass, duration)
        if "first_frequency" in scale or material.E_across is not None or section.tension:
            return _Outside(whole, rigid, np.inf, np.inf, notes)
    mobility = view.area / (8.0 * rate * whole)
    far = idealisation.endless_error(view, mobility, rate, mass, duration)
    return _Outside(whole, rigid, far, mobility, notes)


def _modal(
    scene: Any,
    changes: Mapping[str, Any],
    blow: _Blow,
    stages: Stages,
    first: Modes | None = None,
    margin: float = 1.0,
) -> Plan:
    """The plan with a modal target; finds its first modes, because they tell how many are needed."""
    find, scale = scene.finder(stages, blow.tolerance, blow.pieces.get("size")), scene.scale
    with stages("modes"):
        first = find(FIRST_LOOK) if first is None else first
    modes = first.scaled(**scale)
    with scene.blame("strike"):
        modes.point("at", blow.values["at"])
    allowed = SHARE * blow.tolerance / (CAUTION * margin) / (accuracy.LOSSY if blow.contact.loss else 1.0)
    law = {"contact": blow.contact, "speed": blow.values["speed"]}
    needed = accuracy.cutoff_frequency(modes, blow.values["at"], mass=blow.striker.felt_mass, tolerance=allowed, **law)
    band = max((band for band in blow.quantities.values() if band), default=0.0)
    limit, number = max(needed, band), blow.pieces.get("n_modes")
    if number is None:
        limit = blow.pieces.get("max_frequency", limit)
        # Weyl's law; the first modes are kept even if fewer are enough
        number = max(modes.n_modes, round(modes.n_modes * (limit / modes.frequencies[-1]) ** (0.5 * modes.dimension)))
    else:
        limit = modes.frequencies[min(number, modes.n_modes) - 1] * max(1.0, number / modes.n_modes) ** (
            2.0 / modes.dimension
        )
    if number > MOST_MODES[scene.source]:
        raise check.SimulationError(
            f"{scene.path}: this blow needs about {number:.2g} modes, up to {limit:.2g} Hz, more than the limit of "
            f"{MOST_MODES[scene.source]}; {_fewer(scene, blow, modes, band > needed)}"
        )
    left = accuracy.truncation_error(modes, blow.values["at"], limit, mass=blow.striker.felt_mass, **law)
    kept = f"the target keeps its modes up to {limit:.4g} Hz, about {number}; the others act as a spring"
    why = f"the contact lasts about {blow.duration:.3g} s"
    if band > needed:
        kept += f" ({band:g} Hz requested, {needed:.4g} Hz needed for the blow)"
    plan = _plan(
        scene, changes, blow, target="modal", errors={"target modes left out": left}, reasons=(why, kept),
        mass=modes.mass, n_modes=number, max_frequency=limit, first=first, element="closed form", margin=margin,
        notes=plausible.together(
            modes.damped(scene.damping_ratio).notes, at_rest(modes, modes.point("at", blow.values["at"]))
        ),
    )  # fmt: skip
    if isinstance(first.shapes, FieldShapes):
        plan = _with_mesh(plan, first, first.shapes.system, limit * first.frequencies[-1] / modes.frequencies[-1])
    return plan


def _fewer(scene: Any, blow: _Blow, first: Modes, banded: bool) -> str:
    """What makes a blow that needs more modes than allowed affordable, given its first modes."""
    most = MOST_MODES[scene.source]
    reach = float(first.frequencies[-1]) * (most / first.n_modes) ** (2.0 / first.dimension)
    if "n_modes" in blow.pieces:
        return f"give n_modes of at most {most}"
    if "max_frequency" in blow.pieces or banded:
        name = "max_frequency" if "max_frequency" in blow.pieces else "a band of the quantity"
        return f"give {name} of at most {float(f'{0.9 * reach:.1e}'):g} Hz"
    loss = accuracy.LOSSY if blow.contact.loss else 1.0

    def fits(tolerance: float, contact: Contact = blow.contact) -> bool:
        allowed = SHARE * tolerance / (CAUTION * MARGINS[1] * loss)  # with room for a second, finer run
        law = {"contact": contact, "speed": blow.values["speed"], "mass": blow.striker.felt_mass}
        return accuracy.cutoff_frequency(first, blow.values["at"], tolerance=allowed, **law) <= reach

    def soft(power: int) -> bool:
        return fits(blow.tolerance, replace(blow.contact, stiffness=blow.contact.stiffness * 10.0**-power))

    enough = accuracy.least_tolerance(fits)
    first_word = "no tolerance is large enough" if enough is None else f"tolerance = {enough:g} is affordable"
    powers = range(1, 31)
    softer = next((power for power in powers if soft(power)), None)
    second = "a heavier striker or a lower speed is needed" if softer is None else (
        f"so is a contact with stiffness = {blow.contact.stiffness * 10.0**-softer:.2g}"
    )  # fmt: skip
    return f"{first_word}; {second if enough is not None or softer is None else second.replace('so is ', 'take ')}"


def _with_mesh(plan: Plan, first: Modes, system: System, limit: float) -> Plan:
    """The plan with a mesh that resolves a frequency [Hz] of the body as assembled."""
    assert first.frequency_error is not None
    mesh = system.mesh
    stated = plan.scene.size_stated or "size" in plan.changes or refinement.resolves(system, limit)
    size = mesh.size if stated else min(mesh.size, refinement.size_for(system, None, limit, None))
    n_dofs = round(DOFS_PER_AREA[system.element] * mesh.area / size**mesh.dimension)
    error = max(float(first.frequency_error.max()), SHORT_WAVES[system.element])
    reason = f"{system.element} elements of {size:.3g} m, about {n_dofs} unknowns, resolve the shortest wave"
    seconds = plan.seconds + RATES["dofs"] * n_dofs + RATES["pairs"] * n_dofs * plan.n_modes
    memory = plan.memory + BYTES["dofs"] * n_dofs + BYTES["pairs"] * n_dofs * plan.n_modes
    return replace(
        plan, element=system.element, size=size, n_dofs=n_dofs, errors={**plan.errors, "mesh": error},
        reasons=(*plan.reasons, reason), seconds=seconds, memory=memory,
    )  # fmt: skip


def _plan(
    scene: Any, changes: Mapping[str, Any], blow: _Blow, *, errors, reasons, notes, n_modes=0, margin=1.0, **chosen: Any
) -> Plan:
    """The plan for any target: adds striker modes and time steps, with their errors and cost."""
    kept, left = _striker_modes(blow, margin)
    modes = blow.striker.modes
    if modes.dimension:
        errors = {**errors, "striker modes left out": left}
        bending, whole = kept - modes.n_rigid, modes.n_modes - modes.n_rigid
        stiff = "is treated as rigid" if bending == 0 else f"keeps {bending} of its {whole} bending modes"
        reasons = (*reasons, f"the striker {stiff}")
    fixed = blow.values.get("scheme"), blow.values.get("dt")
    scheme, dt = collision.steps_for(blow.contact, blow.duration, SHARE * blow.tolerance, blow.quantities, *fixed)
    until = "fixed by dt" if fixed[1] else f"halved until two runs agree to {SHARE * blow.tolerance:.1e}"
    lasts = blow.values.get("duration")
    end = "until the final separation" if lasts is None else f"for {lasts:g} s"
    count = blow.duration / dt
    reasons = (*reasons, f"scheme {scheme}, steps of {dt:.3g} s ({count:.0f} per contact), {until}; run {end}")
    return Plan(
        scene,
        MappingProxyType(dict(changes)),
        blow.tolerance,
        blow.quantities,
        **{"element": None, "size": None, "n_dofs": 0, "max_frequency": None, **chosen},
        n_modes=n_modes,
        n_striker_modes=kept,
        scheme=scheme,
        dt=dt,
        duration=blow.duration,
        errors=MappingProxyType({**errors, "steps": SHARE * blow.tolerance}),
        reasons=reasons,
        seconds=RATES["start"] + RATES["steps"] * 10.0 * count * (n_modes + kept),
        memory=BYTES["start"],
        notes=plausible.together(notes, blow.striker.notes, tuple(plausible.number("speed", blow.values["speed"]))),
    )


def _striker_modes(blow: _Blow, margin: float) -> tuple[int, float]:
    """Number of kept striker modes, and the error [-] of leaving out the others."""
    modes, kept = blow.striker.modes, blow.pieces.get("n_striker_modes")
    if not modes.dimension:
        return modes.n_modes, 0.0
    law = {"contact": blow.contact, "speed": blow.values["speed"]}
    if kept is None and blow.values.get("residual", True):
        return collision.striker_modes(blow.striker, tolerance=blow.tolerance / margin, **law)
    kept = max(modes.n_rigid, min(kept or modes.n_modes, modes.n_modes))
    return kept, collision.striker_error(blow.striker, kept, **law)


def target(plan: Plan, stages: Stages, keep: Any = None) -> Modes:
    """The modes of the target as planned; ``keep`` as in `carry_out`."""
    keep = keep if plan.costly and plan.n_dofs else None
    scene = plan.scene
    blow = _checked(scene, plan.changes)
    if plan.target != "modal":
        at = np.atleast_1d(np.asarray(blow.values["at"], float))
        if plan.target == "rigid":
            found = idealisation.unyielding(at, plan.mass)
        else:
            found = idealisation.endless(at, plan.mass, plan.mobility, blow.duration)
        return replace(found, notes=plan.notes)
    find = scene.finder(stages, blow.tolerance, blow.pieces.get("size"))
    with stages("modes"):
        first, modes, number = plan.first, plan.first, blow.pieces.get("n_modes")
        ratio = first.scaled(**scene.scale).frequencies[-1] / first.frequencies[-1]
        if number is not None and number > first.n_modes:
            modes = find(number, None, first, keep)
        elif plan.max_frequency > ratio * first.frequencies[-1] * (1.0 + 1e-9):
            modes = find(FIRST_LOOK, plan.max_frequency / ratio, first, keep)
        if number is not None:
            modes = modes.truncated(n_modes=number)
        elif "max_frequency" in blow.pieces:
            modes = modes.truncated(max_frequency=plan.max_frequency / ratio)
        return modes.scaled(**scene.scale).damped(scene.damping_ratio)
