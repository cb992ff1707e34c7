"""The numbers of a blow that a gradient can be taken in, and what each changes in the modes and contact of the run."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import check
from .._base.rounding import ROUNDING
from ..fe.section import Beam, Plate
from ..fe.springs import is_sprung
from ..fe.variation import DIFFERENCES, SectionChange
from ..modes import varied, viewing
from ..modes.modal import Modes
from . import motion
from .compiled.bundles import KernelSystem
from .compiled.law import LAWS, NUMBERS, Row, law_of

if TYPE_CHECKING:
    from .response import Response

LAW = tuple(dict.fromkeys(name for law in LAWS for name in law.slopes))  # numbers of a contact with a gradient
UNITS = {
    "contact.stiffness": "N/m**exponent", "contact.loss": "s/m", "contact.gap": "m",
    **{f"contact.{name}": number.unit for name, number in NUMBERS.items() if number.unit and name in LAW},
    "strike.speed": "m/s", "strike.x": "m", "strike.y": "m",
    "striker.mass": "kg", "striker.first_frequency": "Hz", "target.mass": "kg", "target.first_frequency": "Hz",
    "section.thickness": "m", "section.height": "m", "section.width": "m", "section.diameter": "m",
    "material.E": "Pa", "material.rho": "kg/m^3",
}  # fmt: skip
INDEXED = {"contacts": "contact", "bodies": "target"}  # what has the same units as each of several
# powers with which frequencies and mass of a thin body grow with a number of it
STUFF = {"material.E": (0.5, 0.0), "material.rho": (-0.5, 1.0)}
PLATE = {"section.thickness": (1.0, 1.0), **STUFF, "target.scale": (-2.0, 2.0)}  # scale: lengths along the body
BAR = {"section.height": (1.0, 1.0), "section.width": (0.0, 1.0), **STUFF, "target.scale": (-2.0, 1.0)}
ROD = {"section.diameter": (1.0, 2.0), **STUFF, "target.scale": (-2.0, 1.0)}
RESCALED = {"mass": (0.0, 1.0), "first_frequency": (1.0, 0.0)}  # the same of any body
# [-] distance for the slope of a shape in radians of the shortest wave, and of the static compliance in lengths of the
# body: errs by the fourth power, 1e-12, and leaves 1e-9 of the rounding of a compliance
SHIFT = 1e-3
ONE_SIDED = ".loss", ".damping_ratio"  # numbers that are never negative


def unit(name: str) -> str:
    """Unit of a number, by its name; empty for none."""
    home, _, part = name.rpartition(".")
    group = home.partition(".")[0]
    return UNITS["strike.speed"] if home == "speeds" else UNITS.get(f"{INDEXED.get(group, home)}.{part}", "")


def numbers_of(body: str, modes: Modes) -> dict[str, float]:
    """Mass, first flexible frequency and its damping ratio, by the names of the numbers of a body."""
    flexible = modes.omega > 0.0
    found = {f"{body}.mass": modes.mass}
    if flexible.any():
        found[f"{body}.first_frequency"] = float(modes.frequencies[flexible][0])
        found[f"{body}.damping_ratio"] = float(modes.damping_ratio[flexible][0])
    return found


@dataclass(frozen=True, eq=False, repr=False)
class Parameters(check.Brief):
    """The numbers of one blow: of `strike` by the names that scene files give them, of `collide` by its own.

    The latter are as "contacts.0.stiffness", "bodies.1.mass" and "speeds.0".
    """

    hit: "Response"
    # further numbers of the user's: their values, and how each changes the section
    sections: Mapping[str, tuple[float, SectionChange]] = field(default_factory=dict)

    @property
    def struck(self) -> bool:
        """Whether it is a blow of `strike`."""
        return self.hit.striker is not None

    @cached_property
    def laws(self) -> dict[str, int]:
        """Names of the contacts, and their indices."""
        return {"contact": 0} if self.struck else {f"contacts.{c}": c for c in range(len(self.hit.contacts))}

    @cached_property
    def bodies(self) -> dict[str, int]:
        """Names of the bodies, and their indices."""
        return {"striker": 0, "target": 1} if self.struck else {f"bodies.{b}": b for b in range(len(self.hit.bodies))}

    @cached_property
    def values(self) -> dict[str, float]:
        """Every number in which a gradient can be taken, and its value."""
        hit = self.hit
        found: dict[str, float] = {}
        for name, c in self.laws.items():
            parts = law_of(Row._make(hit.history.law[c].item())).slopes
            found |= {f"{name}.{part}": float(getattr(hit.contacts[c], part)) for part in (*parts, "gap")}
        if self.struck:
            found["strike.speed"] = hit.speed
            if not self.why_no_target and hit.bodies[-1].continuous:
                found |= {f"strike.{name}": float(x) for name, x in zip("xy", hit.at if hit.at is not None else ())}
        else:
            for b, ends in enumerate(hit.ends):  # of bodies that can move rigidly at their first contact
                row = hit.history.shape[ends.touched[0][0], hit.body_slice(b)] if ends.touched else np.zeros(0)
                if row.size and row[hit.bodies[b].omega == 0.0].any():
                    found[f"speeds.{b}"] = ends.speed
        for name, b in self.bodies.items():
            if name == "target" and self.why_no_target:
                continue
            modes = hit.striker.modes if name == "striker" and hit.striker is not None else hit.bodies[b]
            found |= numbers_of(name, modes)
        if not self.why_no_section:
            section = hit.bodies[-1].section
            assert section is not None
            for name in self._powers:
                home, _, part = name.partition(".")
                part = "width" if part == "diameter" else part
                value = 1.0 if part == "scale" else getattr(section.material if home == "material" else section, part)
                if not callable(value):
                    found[name] = float(value)
        return {name: value for name, value in found.items() if name not in self._barred}

    @cached_property
    def _barred(self) -> dict[str, str]:
        """Numbers in which this blow has no gradient although it has them, and why."""
        barred, hit = {}, self.hit
        for name, c in self.laws.items():
            if hit.contacts[c].gap == 0.0:
                barred[f"{name}.gap"] = (
                    "the bodies touch at the start, and even a small gap would change how they meet; give a gap"
                )
            # modes may stand for those left out that would be others if any contact had a loss
            alone = not self._rated and any(ends.forms.start < ends.forms.stop for ends in hit.ends)
            sprung = alone or hit.history.law["compliance"][c] > 0.0
            if hit.contacts[c].loss == 0.0 and sprung:
                barred[f"{name}.loss"] = (
                    "without loss the modes left out act as a spring in series, with loss they cannot; give the "
                    "contact a small loss"
                )
        if self.struck and hit.speed == 0.0:
            barred["strike.speed"] = "the speed is zero"
        # contacts whose bodies touch at the start without pressing or approaching each other
        h, size = hit.history, np.abs(hit.history.shape)
        q, p = h.start_q, h.start_p
        touch = np.abs(h.offset + h.shape @ q) <= ROUNDING * (size @ np.abs(q) + np.abs(h.offset))
        resting = touch & (np.abs(h.shape @ p) <= ROUNDING * (size @ np.abs(p)))
        for b, ends in enumerate(hit.ends):
            if not self.struck and resting[[c for c, _ in ends.touched]].any():
                barred[f"speeds.{b}"] = (
                    "the body rests against another at the start, and a speed would press or part them; give a gap"
                )
        return barred

    @property
    def _rated(self) -> bool:
        """Whether any contact's force depends on rates, so that modes in the place of others are critically damped."""
        return any(contact.rated for contact in self.hit.contacts)

    @cached_property
    def why_no_target(self) -> str:
        """Why numbers of the target have no gradient; empty if they have."""
        if self.hit.error.idealisation > 0.0:
            return "the target is treated as rigid or infinite; strike its modes, with target = 'modal'"
        return ""

    @cached_property
    def why_no_section(self) -> str:
        """Why numbers of section and material have no gradient; empty if they have."""
        if not self.struck:
            return "only the target of `strike` has one; take the mass and first frequency of the body"
        target = self.hit.bodies[-1]
        section, system = target.section, viewing.body_of(target)
        if self.why_no_target:
            return self.why_no_target
        if section is None:
            return "section and material of the target are not known"
        if target.thick or target.air:
            return "a thick target, or one in air, does not scale by powers of its numbers"
        if isinstance(section, Plate) and not section.plain:
            return "a curved, ribbed or unevenly layered plate does not scale by powers of its numbers; give sections"
        if isinstance(section, Plate) and (section.tension or section.material.E_across is not None):
            return "the effect of E cannot be separated from that of tension or grain; rescale modes instead"
        if system is not None and (is_sprung(system.supports, system.point_supports) or system.point_masses):
            return "springs and point masses on the target do not scale with it"
        return ""

    @property
    def _powers(self) -> dict[str, tuple[float, float]]:
        section = self.hit.bodies[-1].section
        if isinstance(section, Plate):
            return PLATE
        return ROD if isinstance(section, Beam) and section.round else BAR

    def checked(self, wrt: Any) -> tuple[str, ...]:
        """Names as a tuple; all that there are if None. ValueError names those there are, and why one is not."""
        if wrt is None:
            return (*self.values, *(name for name in self.sections if name not in self.values))
        names = (wrt,) if isinstance(wrt, str) else check.tuple_of("wrt", wrt, str)
        for name in names:
            if name in self.sections or name in self.values:
                continue
            reason, home = self._barred.get(name, ""), name.partition(".")[0]
            if home in ("section", "material") or name == "target.scale":
                reason = reason or self.why_no_section
            elif name in ("strike.x", "strike.y") and self.struck:
                reason = reason or self.why_no_target
                if not reason and not self.hit.bodies[-1].continuous:
                    reason = "the shapes of the target are known at single points only"
            elif home == "target" and self.struck:
                reason = reason or self.why_no_target
            if reason:
                raise check.SimulationError(f"no gradient in {name}: {reason}")
            check.one_of("wrt", name, self.values)
        return names

    def change(self, names: tuple[str, ...]) -> KernelSystem:
        """What a unit of each number changes in the run: its arrays have a first axis more, of the numbers."""
        whole = self.hit.history.system
        found = KernelSystem(*(np.zeros((len(names), *each.shape), each.dtype) for each in whole))
        axes = {}
        for i, name in enumerate(names):
            if name in self.sections:
                self._vary(found, i, self.sections[name][1])
            elif name in ("strike.x", "strike.y"):
                axes[i] = "xy".index(name[-1])
            else:
                self._enter(found, i, name)
        if axes:
            self._shift(found, axes)
        return found

    def numbers(self, names: tuple[str, ...]) -> np.ndarray:
        """The numbers of these names, (n,)."""
        return np.array([self.sections[name][0] if name in self.sections else self.values[name] for name in names])

    def faster(self, names: tuple[str, ...]) -> np.ndarray:
        """What a unit of each number adds to the speed of arrival, (n,) [m/s]."""
        moving = next((b for b, ends in enumerate(self.hit.ends) if ends.speed), 0)
        own = "strike.speed" if self.struck else f"speeds.{moving}"
        return np.array([float(name == own) for name in names])

    def size(self, name: str) -> float:
        """What counts as much of a number that is zero."""
        if name.endswith(".loss"):
            return 1.0 / (abs(self.hit.speed) or 1.0)
        if name in ("strike.x", "strike.y"):
            return max(float(np.ptp(column)) for column in self.hit.bodies[1].shapes.grid()[0].T)
        return abs(self.hit.speed) if name.startswith("speeds.") and self.hit.speed else 1.0

    def _enter(self, found: KernelSystem, i: int, name: str) -> None:
        """Enter what a unit of a number changes that is none of the strike point or of a section."""
        home, _, part = name.rpartition(".")
        value, striker = self.values[name], self.hit.striker
        if home in self.laws and part == "gap":
            found.offset[i, self.laws[home]] = -1.0
        elif home in self.laws:
            found.law[part][i, self.laws[home]] = 1.0
        elif name == "strike.speed":
            assert striker is not None
            found.p[i, self._modes[0]] = striker.motion  # the target may move already, whatever that speed
        elif home == "speeds":
            b = int(part)
            modes, ends = self.hit.bodies[b], self.hit.ends[b]
            found.p[i, self._modes[b]] = modes.rigid_motion(ends.points[:1]) if ends.coming is None else ends.coming
        elif part == "damping_ratio":
            b = self.bodies[home]
            found.zeta[i, self._modes[b]] = self.hit.history.omega[self._modes[b]] > 0.0
            found.zeta[i, self.hit.ends[b].forms] = not self._rated
        else:  # frequencies and mass grow with powers of the number
            faster, heavier = RESCALED.get(part) or self._powers[name]
            b, h = self.bodies.get(home, 1), self.hit.history.system
            own = self._modes[b]
            found.omega[i, own] = faster / value * h.omega[own]
            found.shape[i, :, own] = -0.5 * heavier / value * h.shape[:, own]
            for each, power in (("bias", -0.5), ("q", 0.5), ("p", 0.5)):  # displacement and velocity at start stay
                getattr(found, each)[i, own] = power * heavier / value * getattr(h, each)[own]
            if b == 0 and striker is not None:  # its weight grows, where other constant forces stay
                found.bias[i, own] += heavier / value * striker.gravity * striker.motion[: own.stop - own.start]
            self._raise(found, i, b, faster / value)
            self._soften(found, i, b, -(heavier + 2.0 * faster) / value * self.hit.ends[b].rest)

    @cached_property
    def _modes(self) -> tuple[slice, ...]:
        """The modes of every body in the run."""
        return tuple(self.hit.body_slice(b) for b in range(len(self.hit.bodies)))

    def _soften(self, found: KernelSystem, i: int, b: int, change: np.ndarray) -> None:
        """Enter a change (n_ends, n_ends) of the compliance of modes left out [m/N]."""
        ends, h = self.hit.ends[b], self.hit.history
        if not ends.rest.any():
            return
        contacts, signs = (list(column) for column in zip(*ends.touched))
        if ends.forms.start == ends.forms.stop:
            found.law["compliance"][i, contacts[0]] += change[0, 0]
            found.offset[i, contacts[0]] += signs[0] * ends.dip_force * change[0, 0]
            return
        above = h.omega[ends.forms.start]
        forms = h.shape[contacts, ends.forms] * np.array(signs)[:, None] / above
        inverse = np.linalg.pinv(forms)
        # of the changes that differ by a rotation of the forms, which have one frequency: any is as good
        changed = (np.eye(len(forms)) - 0.5 * forms @ inverse) @ change @ inverse.T
        for c, sign, row in zip(contacts, signs, changed):
            found.shape[i, c, ends.forms] += sign * above * row

    def _raise(self, found: KernelSystem, i: int, b: int, faster: float) -> None:
        """Let the modes that stand for those left out of a body follow its last one, ``faster`` per unit."""
        forms, h = self.hit.ends[b].forms, self.hit.history
        found.omega[i, forms] = faster * h.omega[forms]
        found.shape[i, :, forms] += faster * h.shape[:, forms]

    def _vary(self, found: KernelSystem, i: int, change: SectionChange) -> None:
        """A target whose section changes along its length or over its area."""
        hit, target, part, h = self.hit, self.hit.bodies[1], self._modes[1], self.hit.history
        if self.why_no_target or hit.at is None or h.start_q[part].any() or h.start_p[part].any():
            raise check.SimulationError(
                f"no gradient in the section: {self.why_no_target or 'the target moved before the blow'}"
            )
        changed = varied.changed_modes(target, change, hit.at)
        found.omega[i, part] = changed.omega
        found.shape[i, 0, part] = -changed.shape
        found.bias[i, part] = motion.constant_force(hit) * changed.shape
        self._raise(found, i, 1, changed.omega[-1] / max(target.omega[-1], np.finfo(float).tiny))
        flexible = target.omega > 0.0
        row, omega = target.shapes.at(hit.at[None])[0, flexible], target.omega[flexible]
        carried = 2.0 * row / omega**2 @ (changed.shape[flexible] - row * changed.omega[flexible] / omega)
        self._soften(found, i, 1, np.array([[changed.compliance - float(carried)]]))

    def _shift(self, found: KernelSystem, axes: Mapping[int, int]) -> None:
        """The target struck further along an axis, for each parameter its own."""
        hit, target, part = self.hit, self.hit.bodies[1], self._modes[1]
        assert hit.at is not None
        span = max(float(np.ptp(column)) for column in target.shapes.grid()[0].T)
        waves = np.pi * float(len(target.omega)) ** (1.0 / target.dimension) / span  # [rad/m] of the shortest wave
        slopes = _slopes(target, hit.at, axes.values(), SHIFT / waves, target.shapes.at)
        flexible = target.omega > 0.0
        carried = target.shapes.at(hit.at[None])[0, flexible] / target.omega[flexible] ** 2
        rests = [None] * len(axes)
        if hit.ends[1].rest.any():
            rests = _slopes(
                target, hit.at, axes.values(), SHIFT * span,
                # twice the deflection under a force at a fixed point changes as the compliance there
                lambda points: 2.0 * target.shapes.deflection(hit.at[None], points),
            )  # fmt: skip
        striker = hit.striker
        assert striker is not None  # it starts at the surface, which may be displaced
        for i, slope, rest in zip(axes, slopes, rests):
            found.shape[i, 0, part] = -slope
            found.bias[i, part] = motion.constant_force(hit) * slope
            found.q[i, self._modes[0]] = float(slope @ hit.history.start_q[part]) * striker.motion
            if rest is not None:
                self._soften(found, i, 1, np.array([[float(rest[0] - 2.0 * carried @ slope[flexible])]]))


def _slopes(target: Modes, at: np.ndarray, axes: Iterable[int], distance: float, function: Any) -> list[Any]:
    """Derivatives along axes of a function of points (n, dimension) that returns (n, m), (m,) each."""
    stencils = []
    for axis in axes:
        for multiples, weights in DIFFERENCES:
            points = np.tile(at, (len(multiples), 1))
            points[:, axis] += distance * np.array(multiples)
            if target.shapes.contains(points).all():
                stencils.append((points, np.array(weights)))
                break
        else:
            raise check.SimulationError("no gradient in the strike point: the body is too narrow there")
    values = np.split(function(np.vstack([points for points, _ in stencils])), np.cumsum([len(p) for p, _ in stencils]))
    return [weights @ each / distance for (_, weights), each in zip(stencils, values)]
