"""Tolerance in, smallest model out: decides which body, modes and steps a scene's blow needs, and carries it out."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from . import _check, accuracy, idealisation, integrator, spectrum
from .assembly import System, support_of_facets
from .contact import Contact
from .integrator import BAND_POINTS
from .modal import FieldShapes, Modes
from .plans import Plan, asked_for
from .response import Response
from .striker import Striker

SHARE = 0.45  # [-] of the tolerance each for what the model leaves out and for the time steps; the rest is the mesh's
MARGINS = (1.0, 4.0, 16.0)  # [-] stricter choices of modes, taken one after another while those left out matter
NOTCH = 8.0  # [-] by which a verifying run is stricter
FINEST = 1e-10  # [-] but never stricter than this
CAUTION = 2.0  # [-] by which modes are chosen more strictly than expected: a quarter more, and seldom a second time
FIRST_LOOK = 20  # [-] modes found first: enough to set the scale and to tell how densely the others follow
MOST_MODES = {"fe": 2000, "analytic": 50_000}  # [-] about 2 GB, and minutes
SHORT_WAVES = {"argyris": 1e-5, "hermite": 1e-9}  # [-] error of the frequencies that `find_modes` sets the mesh for
LOOK = 20.0  # [-] closed-form modes that judge whether a body yields reach this multiple of the contact frequency
MOST_LOOKED_AT = 5000  # [-] of them at most
PIECES = {"target": "", "size": "m", "n_modes": "", "max_frequency": "Hz", "n_striker_modes": ""}  # that one may set
TARGETS = ("rigid", "infinite", "modal")
DOFS_PER_AREA = {"argyris": 10.4, "hermite": 2.0}  # [-] unknowns in a square, or a length, of the element size
RATES = {"start": 0.02, "dofs": 6e-5, "pairs": 3.5e-7, "steps": 1e-8}  # [s] each; studies/frontier.py measures them
BYTES = {"start": 2e8, "dofs": 6e3, "pairs": 40.0}  # [byte] likewise

Watch = Callable[[str], AbstractContextManager[Any]]


@dataclass(frozen=True)
class Run:
    """One strike of a scene with what it took."""

    response: Response
    seconds: Mapping[str, float]  # [s] wall time of each stage, by its name
    plan: Plan  # that was carried out; its number of modes and errors are those of the run
    notes: tuple[str, ...] = ()  # what was mended or assumed of the mesh
    verified: Mapping[str, float] | None = None  # [-] differences to a finer run, see `verify`
    finer: Plan | None = None  # what that run was


class Stages:
    """Wall time of each stage, and whoever watches."""

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
    """The blow of a scene, checked."""

    values: Mapping[str, Any]  # arguments of `strike`
    pieces: Mapping[str, Any]  # of the plan, set by the user
    tolerance: float  # [-]
    quantities: Mapping[str, float | None]
    striker: Striker
    contact: Contact
    duration: float  # [s] of the contact with a rigid wall


@dataclass(frozen=True)
class _Outside:
    """A target seen without finite elements: how it would err to simplify it."""

    mass: float  # [kg] of the whole body
    rigid: float  # [-] error of holding it for rigid
    endless: float  # [-] error of holding it for infinite; inf where that is wrong or cannot be judged
    mobility: float  # [m/(N s)] of the infinite plate; inf where it is not known


def make(scene: Any, changes: Mapping[str, Any], stages: Stages) -> Plan:
    """Decide how a scene will be modelled (see `Scene.plan`)."""
    changes = {name: value for name, value in changes.items() if value is not None}
    blow = _checked(scene, changes)
    target = blow.pieces.get("target")
    if target is None and {"size", "n_modes", "max_frequency"} & set(blow.pieces):
        target = "modal"
    plan = None if target == "modal" else _idealised(scene, changes, blow, target, stages)
    return plan or _modal(scene, changes, blow, stages)


def carry_out(plan: Plan, stages: Stages, keep: Any = None) -> Run:
    """Strike as planned; where the modes left out turn out to matter, with more of them.

    ``keep`` is a file for the modes of a costly plan.
    """
    scene = plan.scene
    blow = _checked(scene, plan.changes)
    fixed = {"n_modes", "max_frequency"} & set(blow.pieces) or not blow.values.get("residual", True)
    asked = {**blow.values, "tolerance": SHARE * blow.tolerance}
    for margin in MARGINS:
        if margin > 1.0:
            plan = _modal(scene, plan.changes, blow, stages, plan.first, margin)
        modes, striker = target(plan, stages, keep), integrator.shortened(blow.striker, plan.n_striker_modes)
        if plan.target == "modal":
            with scene.blame("observe"):
                for point in scene.points:
                    modes.points("points", [point])
        with stages("strike"), scene.blame("strike"):
            response = integrator.strike(modes, striker, blow.contact, **asked)
        if plan.target != "modal" or fixed or response.error.truncation <= SHARE * blow.tolerance:
            break
    idealised = plan.errors.get("rigid target", 0.0) + plan.errors.get("infinite plate", 0.0)
    error = replace(response.error, idealisation=idealised)
    response = replace(response, tolerance=blow.tolerance, error=error)
    plan = replace(plan, n_modes=modes.n_modes if plan.target == "modal" else 0)
    notes = plan.first.shapes.system.mesh.notes if plan.n_dofs else ()
    return Run(response, MappingProxyType(stages.seconds), plan, notes)


def tolerance_of(scene: Any, values: Mapping[str, Any] | None = None) -> float:
    """The tolerance [-] of a scene, or of values that replace those of its blow."""
    with scene.blame("strike"):
        wanted = (scene.blow.values if values is None else values).get("tolerance", integrator.TOLERANCE)
        return _check.between("tolerance", wanted, 1e-12, 1.0)


def verify(run: Run, watch: Watch | None = None) -> Run:
    """Strike again with everything one notch finer, and note by how much the answers differ (`Run.verified`).

    The tolerance is an eighth, the elements are smaller by a third, and a target held for rigid or infinite is one of
    modes, where their number allows.
    """
    plan = run.plan
    finer: dict[str, Any] = {"tolerance": max(FINEST, plan.tolerance / NOTCH), "target": "modal"}
    if plan.size is not None:
        finer["size"] = plan.size / 1.5
    finer.update({name: None for name in ("n_modes", "max_frequency", "n_striker_modes", "dt") if name in plan.changes})
    try:
        other = plan.scene.run(watch, **{**plan.changes, **finer})
    except _check.SimulationError:
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
    with scene.blame("strike"):
        for name, value in pieces.items():
            if name == "target":
                _check.one_of("target", value, TARGETS)
            elif PIECES[name]:
                _check.positive(name, value, PIECES[name])
            else:
                _check.count(name, value)
        tolerance = tolerance_of(scene, values)
        speed = _check.positive("speed", values["speed"], "m/s")
        quantities = asked_for(values.get("quantity"))
    striker, contact = scene.make_striker(), scene.make_contact()
    duration = accuracy.contact_duration(contact, striker.felt_mass, speed)
    return _Blow(values, pieces, tolerance, quantities, striker, contact, duration)


def _idealised(scene: Any, changes: Mapping[str, Any], blow: _Blow, target: str | None, stages: Stages) -> Plan | None:
    """The plan for a body that does not yield or has no edges, where that is good enough or wanted; else None."""
    values = blow.values
    pressed = values.get("striker_force") or values.get("target_force") or blow.contact.gap < 0.0
    moving = "sound" in blow.quantities or scene.observe is not None  # the target's own motion is asked for
    if target is None and (pressed or moving or not values.get("residual", True)):
        return None
    seen = _outside(scene, blow, stages)
    allowed = SHARE * blow.tolerance
    if target is not None:
        if seen is None or (target == "infinite" and not np.isfinite(seen.mobility)):
            raise scene.fault(f"[strike] target = {target!r} needs a plate whose rigidity is known beforehand")
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
        kept = f"the target, {seen.mass:.3g} kg, is held for rigid: it would change the blow by {seen.rigid:.1e}"
    else:
        error = {"infinite plate": seen.endless}
        kept = (
            f"the target is held for an infinite plate of mobility {seen.mobility:.3g} m/(N s): the striker is gone "
            f"before an echo comes from the edge, which would change the blow by {seen.endless:.1e}"
        )
    dropped = "nothing is assembled, no mode is found; the target's sound is not computed"
    return _plan(
        scene, changes, blow, target=target, errors=error, reasons=(kept, dropped), mass=seen.mass,
        mobility=seen.mobility if target == "infinite" else 0.0,
    )  # fmt: skip


def _outside(scene: Any, blow: _Blow, stages: Stages) -> _Outside | None:
    """The target as far as it is known without finite elements; None where that is not enough."""
    scale, find = scene.scale, scene.closed_form()
    mass, duration = blow.striker.felt_mass, blow.duration
    stretch, rigid = 1.0, np.inf
    if find is not None:
        with stages("modes"):
            first = find(FIRST_LOOK)
        modes = first.scaled(**scale)
        stretch = modes.frequencies[-1] / first.frequencies[-1]
        with scene.blame("strike"):
            at = modes.point("at", blow.values["at"])[0]
        most = modes.frequencies[-1] * (MOST_LOOKED_AT / FIRST_LOOK) ** (2.0 / modes.dimension)
        limit = min(LOOK * 0.5 / duration, most)
        if limit > modes.frequencies[-1]:
            modes = find(FIRST_LOOK, limit / stretch, first).scaled(**scale)
        rigid = idealisation.rigid_error(modes, at, mass, duration)
        if modes.dimension == 1:
            return _Outside(modes.mass, rigid, np.inf, np.inf)
    with stages("mesh"):
        body = scene.body()
    if body.dimension == 1:
        return None
    with scene.blame("supports"):
        free = "free" in support_of_facets(body, dict(scene.supports.values))
    with scene.blame("strike"):
        at = _check.array("at", blow.values["at"], (2,), "m", lift=True)
    view = idealisation.Surroundings.seen(body, at)
    if view is None:
        return None
    section = scene.make_section("plate")
    material = section.material
    rate = stretch * section.thickness * float(np.sqrt(material.E / 12.0 / (1.0 - material.nu**2) / material.rho))
    whole = scale.get("mass", section.thickness * material.rho * view.area)
    if find is None:
        if "first_frequency" in scale:
            low = idealisation.slowest_rate(view, scale["first_frequency"])
        else:
            low = rate * float(np.sqrt(min(material.E, material.E_across or np.inf) / material.E))
        rigid = idealisation.rigid_bound(view, whole, low, free, mass, duration)
        if "first_frequency" in scale or material.E_across is not None or section.tension:
            return _Outside(whole, rigid, np.inf, np.inf)
    mobility = view.area / (8.0 * rate * whole)
    far = idealisation.endless_error(view, mobility, rate, mass, duration)
    return _Outside(whole, rigid, far, mobility)


def _modal(
    scene: Any,
    changes: Mapping[str, Any],
    blow: _Blow,
    stages: Stages,
    first: Modes | None = None,
    margin: float = 1.0,
) -> Plan:
    """The plan for a target of modes; its first ones are found, because they tell how many it takes."""
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
        # Weyl's law; the first modes, already found, are kept where fewer would do
        number = max(modes.n_modes, round(modes.n_modes * (limit / modes.frequencies[-1]) ** (0.5 * modes.dimension)))
    else:
        limit = modes.frequencies[min(number, modes.n_modes) - 1] * max(1.0, number / modes.n_modes) ** (
            2.0 / modes.dimension
        )
    if number > MOST_MODES[scene.source]:
        raise _check.SimulationError(
            f"{scene.path}: this blow needs some {number:.2g} modes, up to {limit:.2g} Hz, more than "
            f"{MOST_MODES[scene.source]}; allow a larger tolerance, a softer contact or a lower speed"
        )
    left = accuracy.truncation_error(modes, blow.values["at"], limit, mass=blow.striker.felt_mass, **law)
    kept = f"the target keeps its modes up to {limit:.4g} Hz, about {number}; the rest yields as a spring"
    why = f"the contact lasts about {blow.duration:.3g} s"
    if band > needed:
        kept += f" ({band:g} Hz asked for, {needed:.4g} Hz needed for the blow)"
    plan = _plan(
        scene, changes, blow, target="modal", errors={"target modes left out": left}, reasons=(why, kept),
        mass=modes.mass, n_modes=number, max_frequency=limit, first=first, element="closed form", margin=margin,
    )  # fmt: skip
    if isinstance(first.shapes, FieldShapes):
        plan = _with_mesh(plan, first, first.shapes.system, limit * first.frequencies[-1] / modes.frequencies[-1])
    return plan


def _with_mesh(plan: Plan, first: Modes, system: System, limit: float) -> Plan:
    """The plan with elements that resolve a frequency [Hz] of the body as assembled."""
    assert first.frequency_error is not None
    mesh = system.mesh
    stated = plan.scene.size_stated or "size" in plan.changes or spectrum.resolves(system, limit)
    size = mesh.size if stated else min(mesh.size, spectrum.size_for(system, None, limit, None))
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
    scene: Any, changes: Mapping[str, Any], blow: _Blow, *, errors, reasons, n_modes=0, margin=1.0, **chosen: Any
) -> Plan:
    """A plan with what every target has in common: the striker, the steps, and their share of errors and cost."""
    kept, left = _striker_modes(blow, margin)
    modes = blow.striker.modes
    if modes.dimension:
        errors = {**errors, "striker modes left out": left}
        bending, whole = kept - modes.n_rigid, modes.n_modes - modes.n_rigid
        stiff = "is held for rigid" if bending == 0 else f"keeps {bending} of its {whole} bending modes"
        reasons = (*reasons, f"the striker {stiff}")
    fixed = blow.values.get("scheme"), blow.values.get("dt")
    scheme, dt = integrator.steps_for(blow.contact, blow.duration, SHARE * blow.tolerance, blow.quantities, *fixed)
    until = "as told" if fixed[1] else f"halved until two runs agree to {SHARE * blow.tolerance:.1e}"
    lasts = blow.values.get("duration")
    end = "until the two have parted for good" if lasts is None else f"for {lasts:g} s"
    count = blow.duration / dt
    reasons = (*reasons, f"scheme {scheme}, steps of {dt:.3g} s ({count:.0f} a contact), {until}; followed {end}")
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
    )


def _striker_modes(blow: _Blow, margin: float) -> tuple[int, float]:
    """How many modes of the striker are kept, and the error of leaving out the others."""
    modes, kept = blow.striker.modes, blow.pieces.get("n_striker_modes")
    if not modes.dimension:
        return modes.n_modes, 0.0
    law = {"contact": blow.contact, "speed": blow.values["speed"]}
    if kept is None and blow.values.get("residual", True):
        return integrator.striker_modes(blow.striker, tolerance=blow.tolerance / margin, **law)
    kept = max(modes.n_rigid, min(kept or modes.n_modes, modes.n_modes))
    return kept, integrator.striker_error(blow.striker, kept, **law)


def target(plan: Plan, stages: Stages, keep: Any = None) -> Modes:
    """The struck body as planned; ``keep`` as in `carry_out`."""
    keep = keep if plan.costly and plan.n_dofs else None
    scene = plan.scene
    blow = _checked(scene, plan.changes)
    if plan.target != "modal":
        at = np.atleast_1d(np.asarray(blow.values["at"], float))
        if plan.target == "rigid":
            return idealisation.unyielding(at, plan.mass)
        return idealisation.endless(at, plan.mass, plan.mobility, blow.duration)
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
