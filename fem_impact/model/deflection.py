"""Are the deflections small? What the stretching of the body, which the linear theory leaves out, does to a blow.

Berger's tension N = E h / (2 A (1 - nu**2)) int |grad w|**2 of the motion found stiffens every mode by
N int |grad phi|**2. It is exact for a beam with held ends and 13 % too stiff for a hinged square that cannot slip at
its edges; what is left of it where edges are free follows from the stresses in the plane (`modes.stretching`). During
the blow the bent part of the plate, as far as its waves have come, is held by the part around it. A blow that has
stretching in it is struck again with half the stress fields, and a blow on a curved, ribbed or unevenly layered body
without it with the stretching of its lowest modes: the tension of a flat plate says nothing of those, whose stretching
has quadratic forces, too. Pressed on its top a dome softens, and where its tangent stiffness turns negative it may snap
through.

References
----------
Berger (1955), J. Appl. Mech. 22, 465-472; Chu and Herrmann (1956), J. Appl. Mech. 23, 532-540; Woinowsky-Krieger
(1950), J. Appl. Mech. 17, 35-36 (beams).
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy import special

from .._base.check import SimulationError
from .._base.rounding import ROUNDING
from ..fe import membrane, shallow
from ..fe.section import Plate
from ..impact import distance
from ..impact.assumption import Assumption
from ..impact.engine import follow_again
from ..impact.stretched import Stretched
from ..modes.modal import Modes
from ..modes.stretching import MOST, Stretching, stretch
from .bending import Bending, Known, has_quadratic_shapes
from .idealisation import Waves
from .restrike import Doubt, Struck

SLIPS = 0.25  # [-] stretching of a plate whose edge may move in its plane over that of one whose edge may not
# [-] instants of the blow, and of each period after it, at which tension is found: the largest deflection to 1e-3
TIMES = 64
RINGING = 1.5  # [-] tension that acts on a mode swinging alone, over the mean tension, fact: 3/4 and 1/2 of its largest
FRONT = 2.0 * np.pi  # [-] radius squared of the bent region over rate times time: where Si(r**2 / (4 rate t)) turns
# [-] deflection over thickness beyond which no first-order estimate of the stretching helps
GONG = 1.0
REMEDY = "take a softer blow or a thicker body: stretching is not modelled"
BETTER = "let it stretch, stretching = true, or take a softer blow or a thicker body"
DARING = "take a softer blow or a thicker body: stretching = true holds up to deflections of the thickness"
OTHER = "take element 'argyris'"
SNAPS = "it may snap through, as its stiffness turns negative on the way"
LOCAL = "take a softer blow or a thicker body: local stretching is not modelled"
# from 0.2 on the frequency of a hinged square rises by 2 %
SMALL = Doubt("small deflections", "deflection over thickness", 0.2, "give material and section")
STRETCHED = replace(SMALL, limit=GONG)


def examine_deflection(struck: Struck) -> Assumption:
    """The struck body."""
    body, modes, hit = struck.target, struck.bodies[1], struck.hit
    if modes.dimension == 0:
        return SMALL.holds(struck)
    if body is None or body.thickness is None:
        if struck.ideal != "rigid" or struck.planned:
            return SMALL.unknown(struck, "the thickness of the body")
        # if it stretched as much as it bends
        return SMALL.judged(struck, None, dict.fromkeys(struck.quantities, hit.error.idealisation), REMEDY)
    if struck.ideal:
        return _simplified(struck, body)
    integrals = struck.bending
    assert integrals is not None
    if struck.planned:
        value = _impulse_deflection(struck, body, integrals)
        if modes.stretches:
            return STRETCHED.judged(struck, value, {}, LOCAL)
        return SMALL.judged(struck, value, {}, _remedy(body, value))
    if hit.history.stretched is not None:
        return _stretched(struck, body, integrals)
    if body.shaped:
        return _curved(struck, body, integrals)
    history, mine = hit.history, struck.mine
    times = np.linspace(0.0, struck.end, TIMES + 1)[1:]
    rocks, pulled = _share_of_bending(body, integrals, history.omega[mine])
    moved = history.states(times)[0][:, mine] * rocks
    row = np.abs(history.shape[0, mine])
    largest = float(np.abs(moved @ (pulled * history.shape[0, mine])).max(initial=0.0))
    swing = np.divide(rocks * pulled * row, history.omega[mine], out=np.zeros(len(row)), where=rocks > 0.0)
    value = max(largest, float(np.sqrt(2.0 * struck.target_energy @ swing**2))) / body.thickness
    # free edges are not looked at closely where a plate stiffens by less than 1e-3
    share = _share(body, integrals, moved) if value > 0.03 else _crude_share(body)
    slopes = moved**2 @ integrals.slope  # (n_times,) int |grad w|**2
    area = _bent_area(body, integrals, times)
    local = 1.0 + (share - 1.0) * area / body.extent  # before its waves reach the edges, they do not matter
    # power of the slopes' share within the bent region: 2 on an endless plate, least errors on others
    tension = _tension(body, slopes, area, local) * _share_within(body, area) ** 1.5
    held = float(tension @ slopes / slopes.sum()) if slopes.any() else 0.0
    omega = np.sqrt(history.omega[mine] ** 2 + held * rocks**2 * integrals.slope)

    def rise(of: Known, found: Bending) -> np.ndarray | None:
        if of.section is None:
            return None
        omega = of.modes.omega
        energy = np.where(omega > 0.0, hit.modal_energy([struck.end])[0], 0.0)
        soft = np.divide(found.slope, omega**2, out=np.zeros(len(omega)), where=omega > 0.0)
        mean = RINGING * float(_tension(of, np.array([energy @ soft]), np.array([of.extent]), share)[0])
        return np.sqrt(1.0 + mean * soft) - 1.0

    effect = struck.add_sound(struck.changes(omega=struck.with_target(omega)), rise)
    most = int(slopes.argmax())
    bending = 0.5 * float(((moved[most] * history.omega[mine]) ** 2).sum())
    pulling = 0.25 * float(tension[most] * slopes[most])
    return SMALL.judged(struck, value, effect, _remedy(body, value * _held_back(pulling / bending if bending else 0.0)))


def _remedy(body: Known, deflection: float) -> str:
    """What makes the answer right, for the deflection over the thickness [-] of a body that stretches."""
    if body.held < 1.0 and (body.plate is None or body.sprung) and not body.shaped:
        return REMEDY
    # estimated on six plates to 0.74 to 1.07 of that deflection where it nears the thickness
    better = DARING if 1.1 * deflection > GONG else BETTER
    return f"{OTHER} and {better}" if has_quadratic_shapes(body.modes) else better


def _held_back(share: float) -> float:
    """Largest deflection of a body that stretches over that without, [-].

    ``share`` is the energy of stretching over that of bending at the deflection without: both together, as the second
    and fourth power of the deflection, take what bending alone would.
    """
    return float(np.sqrt(2.0 / (1.0 + np.sqrt(1.0 + 4.0 * share))))


def _impulse_deflection(struck: Struck, body: Known, integrals: Bending) -> float:
    """Deflection over thickness [-] that the impulse of a blow on a wall leaves in the modes."""
    modes, hit = body.modes, struck.hit
    assert struck.place is not None
    row = modes.shapes.at(struck.place)[0]
    rocks, pulled = _share_of_bending(body, integrals, modes.omega)
    swing = np.divide(rocks * pulled * row**2, modes.omega, out=np.zeros(len(row)), where=modes.omega > 0.0)
    found, plate = float(np.sqrt(swing @ swing)), body.plate
    if plate is not None and not callable(plate.thickness) and not plate.tension:
        found = max(found, Waves.of(plate.material, plate.thickness).mobility(body.per_extent))
    assert body.thickness is not None
    return found * hit.impulse / body.thickness


def _curved(struck: Struck, body: Known, integrals: Bending) -> Assumption:
    """A blow without stretching on a body whose plane answers: it is struck again with that of its lowest modes.

    The lowest of a free shell hardly stretch it: sixteen of them give 2 000 times too little on a cymbal.
    """
    assert body.thickness is not None
    if body.modes.n_modes == body.modes.n_rigid:
        return SMALL.holds(struck)
    history, mine, found = struck.hit.history, struck.mine, _forms(body.modes, MOST)
    omega, n = history.omega[mine], found.forms.shape[1]
    rocks, _ = _share_of_bending(body, integrals, omega)
    row = rocks * history.shape[0, mine] / body.thickness
    value = float(np.abs(history.states(_times(struck))[0][:, mine] @ row).max(initial=0.0))

    def shift(of: Known, _: Bending) -> np.ndarray | None:
        if of.section is None:
            return None
        own, energy = _forms(of.modes, MOST), struck.hit.modal_energy([struck.end])[0]
        m = own.forms.shape[1]
        return np.pad(shift_frequencies(own, of.modes.omega[:m], energy[:m]), (0, of.modes.n_modes - m))

    try:
        better = follow_again(history, stretched=Stretched(found.forms, found.linear, mine.start))
        moved = _swinging(struck, better)[:, mine]
    except SimulationError:
        return SMALL.judged(struck, value, dict.fromkeys(struck.quantities), _remedy(body, value))
    effect = distance.of_blows(replace(struck.before, history=better), struck.before, struck.hit.quantities)
    remedy = _remedy(body, float(np.abs(moved @ row).max(initial=0.0))) + _of_rise(body, value)
    if may_snap(found, omega[:n], moved[:, :n]):
        remedy = f"{SNAPS}: {remedy}"
    return SMALL.judged(struck, value, struck.add_sound({**effect}, shift), remedy)


def stiffness_by_stretching(found: Stretching, q: np.ndarray) -> np.ndarray:
    """Stiffness (n_times, n, n) [s**-2] that stretching adds to the modes in states q (n_times, n)."""
    bent = np.einsum("kij,tj->tki", found.forms, q)
    pull = np.einsum("tki,ti->tk", bent, q)
    result = 2.0 * np.einsum("tki,tkj->tij", bent, bent)
    if len(found.linear):
        mixed = np.einsum("ki,tkj->tij", found.linear, bent)
        result += mixed + mixed.transpose(0, 2, 1)
        pull = pull + q @ found.linear.T
    return np.asarray(result + np.einsum("tk,kij->tij", pull, found.forms))


def may_snap(found: Stretching, omega: np.ndarray, q: np.ndarray) -> bool:
    """Whether the tangent stiffness of modes (n,) turns negative in one of some states (n_times, n)."""
    flexible = omega > 0.0
    added = stiffness_by_stretching(found, q)[:, flexible][:, :, flexible] / np.outer(omega[flexible], omega[flexible])
    return bool(np.linalg.eigvalsh(added)[:, 0].min(initial=0.0) < -1.0)


def shift_frequencies(found: Stretching, omega: np.ndarray, energy: np.ndarray) -> np.ndarray:
    """Relative shift of the frequencies of modes (n,) that ring with some energies (n,) [J], each in its own phase.

    Quartic energies raise them by the mean stiffness, of its own motion by half of it; cubic ones lower them in second
    order.
    """
    still = omega == 0.0
    soft = np.divide(1.0, omega, out=np.zeros(len(omega)), where=~still)
    forms = found.forms * np.outer(soft, soft)
    raised = 2.0 * np.einsum("kij,kij,j->i", forms, forms, energy)
    raised += np.einsum("kjj,j,kii->i", forms, energy, forms)
    raised -= 1.5 * np.einsum("kii,kii,i->i", forms, forms, energy)
    if not len(found.linear):
        return np.asarray(0.5 * raised)
    part = np.einsum("km,kij->ijm", found.linear * soft, forms)
    mixed = part + part.transpose(2, 0, 1) + part.transpose(0, 2, 1)
    # a force a q**2 lowers the frequency of q'' + w**2 q by 5/12 (a / w**2)**2 of the squared amplitude, whose
    # stiffness 2 a q has the mean square 2 a**2 of it
    return np.asarray(0.5 * raised - 5.0 / 24.0 * np.einsum("ijm,ijm,m->i", mixed, mixed, energy))


def _of_rise(body: Known, value: float) -> str:
    """The deflection, over the thickness [-], as a share of the rise, in words; "" of flat bodies."""
    if body.plate is None or body.plate.rise is None:
        return ""
    points, thickness = body.modes.shapes.grid()[0], body.thickness
    height = float(np.ptp(shallow.over_mean_plane(points, body.plate.rise(points))[0]))
    return f" (the deflection is {value * thickness / height:.2g} times the rise)" if height and thickness else ""


def _times(struck: Struck) -> np.ndarray:
    """Times [s] during the blow and in two periods of the first mode after it."""
    omega, end = struck.hit.history.omega[struck.mine], struck.end
    period = 2.0 * np.pi / float(omega[omega > 0.0][0])
    return np.append(np.linspace(0.0, end, TIMES + 1)[1:], np.linspace(end, end + 2.0 * period, 2 * TIMES))


def _swinging(struck: Struck, history: Any) -> np.ndarray:
    """States (n_times, n_all) [m kg**0.5] of a blow with stretching at `_times`, the steps between these after it."""
    times = _times(struck)
    longest = max(history.stretched.base, (times[-1] - struck.end) / (2.0 * TIMES))
    slower = replace(history, stretched=replace(history.stretched, base=longest))
    return np.asarray(slower.states(times)[0])


def _stretched(struck: Struck, body: Known, integrals: Bending) -> Assumption:
    """A blow that has stretching in it: how large it gets, and what stress fields and modes left out would change.

    The fields that are not kept change less than the smaller half of those that are. The largest deflection is
    searched in two periods of the first mode after the blow.
    """
    mine, history = struck.mine, struck.hit.history
    assert history.stretched is not None and body.thickness is not None
    flexible, states = history.omega[mine] > 0.0, _swinging(struck, history)
    moved = states[:, mine]
    value = float(np.abs(moved @ (flexible * history.shape[0, mine])).max(initial=0.0)) / body.thickness
    own, remedy = Stretching(history.stretched.forms, history.stretched.linear), LOCAL + _of_rise(body, value)
    omega, m = history.omega[mine], own.forms.shape[1]
    if len(own.linear) and may_snap(own, omega[:m], moved[:, :m]):
        return STRETCHED.unknown(struck, SNAPS, remedy, value)
    if value > GONG:
        return STRETCHED.unknown(struck, "this is a gong: large deflections are not modelled", remedy, value)
    forms = history.stretched.forms
    if len(forms) < membrane.most_fields(forms.shape[1]):
        return STRETCHED.judged(struck, value, dict.fromkeys(struck.quantities, 0.0), remedy)
    n = forms.shape[1] if forms.shape[1] == moved.shape[1] else forms.shape[1] // 2
    fewer = history.stretched.part(len(forms) // 2, n)
    effect = struck.changes(stretched=fewer)
    if "sound" in effect:
        effect["sound"] = _ringing_shift(struck, body, integrals, (history.stretched, fewer), states[TIMES:])
    return STRETCHED.judged(struck, value, effect, remedy)


def _ringing_shift(
    struck: Struck, body: Known, integrals: Bending, both: tuple[Stretched, Stretched], states: np.ndarray
) -> float:
    """Relative shift [-] of the frequencies that ring in states (n_times, n_all) by another stretching."""
    omega, energy, moved = struck.hit.history.omega[struck.mine], struck.target_energy, states[:, struck.mine]
    if len(both[0].linear):
        n, m = (each.forms.shape[1] for each in both)
        found = shift_frequencies(Stretching(both[0].forms, both[0].linear), omega[:n], energy[:n])
        found[:m] -= shift_frequencies(Stretching(both[1].forms, both[1].linear), omega[:m], energy[:m])
        return float(energy[:n] @ np.abs(found) / (energy.sum() or 1.0))
    whole, part = (sum(each.energy(q) for q in states) for each in both)
    soft = np.divide(integrals.slope, omega**2, out=np.zeros(len(omega)), where=omega > 0.0)
    slopes = moved**2 @ integrals.slope
    mean = float(np.mean(_tension(body, slopes, np.array([body.extent]), _share(body, integrals, moved))))
    rise = np.sqrt(1.0 + mean * soft) - 1.0
    return (1.0 - part / whole) * float(energy @ rise) / (energy.sum() or 1.0) if whole else 0.0


def _tension(body: Known, slopes: np.ndarray, extent: np.ndarray, share: Any) -> np.ndarray:
    """Berger's tension (n,) [N/m], of a beam [N], from int |grad w|**2 (n,) over an area (n,) [m**2] or length [m].

    ``share`` [-] of it is left as the edges may move in the plane.
    """
    section = body.section
    assert section is not None and body.thickness is not None
    if isinstance(section, Plate):
        moduli = section.material.plane_stress
        stiff = float(np.sqrt(moduli[0, 0] * moduli[1, 1])) * body.thickness
        return stiff / (2.0 * extent) * slopes * share
    area = body.modes.mass / body.extent / section.material.rho
    return section.material.E * area / (2.0 * extent) * slopes * share


def _crude_share(body: Known) -> float:
    """Share [-] of Berger's tension that is left, by the share of the edges that supports hold."""
    return body.held if body.plate is None else SLIPS + (1.0 - SLIPS) * body.held


def _share(body: Known, integrals: Bending, moved: np.ndarray) -> float:
    """The same from the stresses in the plane as modes move, (n_times, n_modes) [m kg**0.5], if an edge is free.

    What bends to a cylinder or a cone between free edges does not stretch at all.
    """
    still = body.modes.n_modes == body.modes.n_rigid
    if body.plate is None or body.held == 1.0 or body.sprung or has_quadratic_shapes(body.modes) or still:
        return _crude_share(body)
    forms = _forms(body.modes).forms
    n = forms.shape[1]
    q = moved[:, :n]
    energy = 0.25 * (np.einsum("ti,kij,tj->tk", q, forms, q, optimize=True) ** 2).sum()
    slope = q**2 @ integrals.slope[:n]
    berger = 0.25 * (_tension(body, slope, np.array([body.extent]), 1.0) @ slope)
    return float(energy / berger) if berger else _crude_share(body)


def _forms(modes: Modes, most: int = membrane.SWINGING) -> Stretching:
    """Stretching of the first modes that bend, as in `modes.stretching`; it takes a second, and they remember it."""
    n_modes = min(modes.n_modes, modes.n_rigid + most)
    found: Stretching = modes.known.recall(("stretching", n_modes), lambda: stretch(modes.truncated(n_modes=n_modes)))
    return found


def _share_of_bending(body: Known, integrals: Bending, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share (n_modes,) of each mode's motion that bends the body, and of its stiffness that is not from tension.

    A body that rocks on soft supports, or turns about its hinges, is slower than its bending waves of that length; one
    that is pulled tight is faster, and its deflection may be many thicknesses.
    """
    section = body.section
    assert section is not None
    points = body.modes.shapes.grid()[0]
    stiffness = section.stiffness(points)
    if isinstance(section, Plate):
        stiffness = np.sqrt(stiffness[:, 0, 0] * stiffness[:, 1, 1])
    waves = np.sqrt(float(np.mean(stiffness)) / body.per_extent) * integrals.wave**2
    ratio = np.divide(omega, waves, out=np.zeros(len(omega)), where=waves > 0.0)
    # what is slower or faster than bending waves by three rocks or is pulled; wood differs by less
    pulled = np.minimum(1.0, np.divide(3.0, ratio, out=np.ones(len(omega)), where=ratio > 0.0))
    if body.shaped:  # whose modes are faster without being pulled
        pulled = np.ones(len(omega))
    return np.minimum(1.0, 3.0 * ratio), pulled


def _bent_area(body: Known, integrals: Bending, times: np.ndarray) -> np.ndarray:
    """Area (n,) [m**2] that bending waves have reached by some times, of a beam its length [m]."""
    flexible = integrals.wave > 0.0
    if body.modes.dimension == 1 or not flexible.any():
        return np.full(len(times), body.extent)
    rate = float(np.median(body.modes.omega[flexible] / integrals.wave[flexible] ** 2))
    return np.minimum(body.extent, np.pi * FRONT * rate * times)


def _share_within(body: Known, area: np.ndarray) -> np.ndarray:
    """Share (n,) [-] of int |grad w|**2 that is within the bent area (n,) [m**2]: ahead of it small waves run.

    Under a knock on a wide plate grad w goes as sin(x) / x with x = r**2 / (4 rate t), `FRONT` / 4 at its rim.
    """
    if body.modes.dimension == 1:
        return np.ones(len(area))
    whole = np.pi * body.extent / np.maximum(area, ROUNDING * body.extent)  # 2 x at the edge
    near, far = (np.euler_gamma + np.log(x) - special.sici(x)[1] for x in (0.5 * FRONT, whole))
    return near / far


def _simplified(struck: Struck, body: Known) -> Assumption:
    """A body treated as rigid or infinite: its plate gives by its mobility times the impulse."""
    plate, hit = body.plate, struck.hit
    if plate is None or callable(plate.thickness) or body.thickness is None:
        return SMALL.unknown(struck, "the deflection of a body treated as rigid")
    waves = Waves.of(plate.material, plate.thickness)
    value = waves.mobility(body.per_extent) * hit.impulse / body.thickness
    stiffening = 0.7 * value**2  # of a wide plate under a point force, from the held disk
    if struck.ideal == "rigid":  # what the body gives changes the blow by no more than the error of leaving it out
        effect: dict[str, float | None] = dict.fromkeys(
            struck.quantities, min(1.0, stiffening) * hit.error.idealisation
        )
    else:
        row = hit.history.shape[:, struck.mine] / (1.0 + stiffening) ** 0.25
        effect = struck.changes(shape=struck.with_target(row, "shape"))
    return SMALL.judged(struck, value, effect, _remedy(body, value))
