"""Materials, strikers and impact hammers by name, each number with its source and with how well it is known."""

import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, TypeVar

import numpy as np

from .._base import check, known
from ..fe.material import Material
from .contact import Contact, hertz_stiffness, pressed_compliance
from .striker import Striker

FILE = Path(__file__).with_suffix(".toml")
UNITS = {  # number of the file -> its unit
    **dict.fromkeys(("E", "E_across", "G", "G_xz", "G_yz", "yield_strength", "tip_E"), "Pa"),
    **dict.fromkeys(("E_L", "E_R", "E_T", "G_LR", "G_LT", "G_RT"), "Pa"),
    **dict.fromkeys(("nu", "nu_LR", "nu_LT", "nu_RT", "tip_nu", "loss_factor", "exponent", "restitution"), "-"),
    **dict.fromkeys(("radius", "tip_radius"), "m"), "rho": "kg/m^3", "mass": "kg", "first_frequency": "Hz",
    "stiffness": "N/m^exponent", "loss": "s/m", "speed": "m/s", "force": "N", "sensitivity": "V/N",
}  # fmt: skip
# names of the constants of wood that a plate of each cut needs; L along the grain, R along the rays, T along the rings
CUTS = {
    "": {"E": "E_L", "E_across": "E_R", "nu": "nu_LR", "G": "G_LR", "G_xz": "G_LT", "G_yz": "G_RT"},
    ", flat-sawn": {"E": "E_L", "E_across": "E_T", "nu": "nu_LT", "G": "G_LT", "G_xz": "G_LR", "G_yz": "G_RT"},
}
OF_MATERIAL = ("E", "nu", "rho", "E_across", "G", "G_xz", "G_yz", "yield_strength")
OF_STRIKER = {
    "rigid": ("mass",), "stick": ("mass", "first_frequency"),
    "sphere": ("radius", "E", "nu", "rho", "yield_strength"),
}  # fmt: skip
# numbers that scenes take without their intervals: nu changes plates less than E does, by a tenth at most, and bodies
# with another nu need modes of their own; a yield strength changes no blow of an elastic body
SINGLE = ("nu", "yield_strength")
TIP = ("tip_radius", "tip_E", "tip_nu")

T = TypeVar("T")


class Unlisted(KeyError, ValueError):
    """The catalogue has no such name."""

    __str__ = Exception.__str__  # that of KeyError would put the text in quotation marks


@dataclass(frozen=True)
class Fact:
    """One number of the catalogue."""

    value: float
    interval: Mapping[str, float]  # {about} [-] or {low, high}, as in scenes; empty: exact, or fixed with another one
    unit: str
    source: str
    read: bool  # whether its source could be read when the number was entered; if not, it is from memory

    @property
    def table(self) -> Any:
        """The number as a scene states it."""
        return {"value": self.value, **self.interval} if self.interval else self.value

    @property
    def ends(self) -> tuple[float, float]:
        """Nine tenths of what it may be, or all of it, lie between these."""
        if "about" in self.interval:
            return self.value * np.exp(-self.interval["about"]), self.value * np.exp(self.interval["about"])
        return self.interval.get("low", self.value), self.interval.get("high", self.value)


@dataclass(frozen=True)
class Entry:
    """What the catalogue knows of one material, striker or hammer."""

    name: str
    group: str
    facts: Mapping[str, Fact]
    kind: str = ""  # of a striker, as in scenes
    tips: tuple[str, ...] = ()  # of a hammer: names in `TIPS`
    note: str = ""

    @property
    def table(self) -> dict[str, Any]:
        """The table [material] or [striker] of a scene, its numbers with their intervals."""
        keys = OF_STRIKER[self.kind] if self.kind else OF_MATERIAL
        stated = {key: self.facts[key] for key in keys if key in self.facts}
        found = {key: fact.value if key in SINGLE else fact.table for key, fact in stated.items()}
        return {"kind": self.kind, **found} if self.kind else found

    def vary(self, table: str) -> dict[str, Any]:
        """How its numbers are distributed, for `fem_impact.spread`; ``table`` is "material" or "striker"."""
        return known.taken(table, self.table)[1]

    def contact_table(self, on: Material | None = None) -> dict[str, Any]:
        """The table [contact] of a scene in which it strikes a material, or a rigid wall; see `contact`."""
        facts = self.facts
        law = {key: facts[key].table for key in ("stiffness", "exponent") if key in facts}
        if not law:  # a round tip
            radius, E, nu = (facts[name] for name in (("radius", "E", "nu") if "radius" in facts else TIP))
            tip, under, wood = pressed_compliance(E.value, nu.value), 0.0, 0.0
            if on is not None:
                # wood pressed across its grain may differ by half from a body that is as soft in every way; 0.3 stands
                # for its Poisson's ratios: 0.5 makes it 18 % stiffer
                wood = 0.0 if on.E_across is None else 0.5
                under = pressed_compliance(*(on.E_across, 0.3) if on.E_across else (on.E, on.nu))
            stiffness, share = hertz_stiffness(tip + under, radius.value), tip / (tip + under)
            spread = [0.5 * float(np.log(fact.ends[1] / fact.ends[0])) for fact in (radius, E)]
            about = float(np.hypot(0.5 * spread[0] + share * spread[1], (1.0 - share) * wood))
            law = {"stiffness": {"value": stiffness, "about": about}, "exponent": 1.5}
        if "restitution" in facts:
            return {"kind": "restituting", **law, **{key: facts[key].table for key in ("restitution", "speed")}}
        return {"kind": "power", **law, **({"loss": facts["loss"].table} if "loss" in facts else {})}

    def contact(self, on: Material | None = None) -> Contact:
        """The contact law between this striker and a body.

        A soft head has a law of its own, whatever it strikes. A hard and round tip follows Hertz's law with the
        stiffness of both bodies; without a material it strikes a rigid wall. Wood counts as if it were as soft in all
        directions as it is across its grain.

        Parameters
        ----------
        on : Material, optional
            What it strikes.
        """
        if not self.kind:
            raise ValueError(f"contact needs a striker, got {self.name!r} of the group {self.group}")
        if on is not None:
            check.instance("on", on, Material)
        values = known.taken("", self.contact_table(on))[0]
        make: Callable[..., Contact] = getattr(Contact, values.pop("kind"))
        return make(**values)


@dataclass(frozen=True)
class ImpactHammer:
    """An impact hammer with a force sensor, as its data sheet describes it."""

    name: str
    mass: float  # [kg] of its head
    force: float  # [N] largest that it measures
    sensitivity: float | None  # [V/N]; None: it gives a charge, or the data sheet was not at hand
    tips: Mapping[str, float]  # name -> stiffness [N/m] of the linear spring with the same contact time on a rigid wall

    def striker(self) -> Striker:
        """The hammer as a rigid mass."""
        return Striker.rigid(self.mass)

    def contact(self, tip: str) -> Contact:
        """The contact through one of its tips."""
        return Contact.linear(self.tips[check.one_of("tip", tip, self.tips)])


class Catalogue(Mapping[str, T], Generic[T]):
    """Things by name, such as ``fi.materials["brass"]``, ``fi.strikers["yarn, medium"]`` or `fi.hammers.catalogue`.

    Each number has a source and an interval. Names stand in scenes, too: ``[material] name = "brass"``. The page
    `studies/catalogue.md` and ``fem-impact catalogue`` list them all. An unknown name raises an error that is a
    ValueError and a KeyError and names the nearest ones.

    Examples
    --------
    >>> fi.materials["brass"].E
    101000000000.0
    >>> spruce = fi.materials["spruce, Sitka"]  # quarter-sawn; "spruce, Sitka, flat-sawn" has T across
    >>> round(spruce.E_across / 1e6)
    849
    >>> mallet = fi.strikers.entry("yarn, medium")
    >>> fi.strikers["yarn, medium"].mass, mallet.contact(on=spruce).exponent
    (0.03, 2.0)
    >>> fi.materials.entry("brass").vary("material")["material.rho"][0]
    'lognormal'
    >>> fi.hammers.catalogue["PCB 086C03"].mass
    0.16
    """

    def __init__(self, section: str, make: Callable[[Entry], T]) -> None:
        self._section, self._make = section, make

    def __getitem__(self, name: str) -> T:
        return self._make(self.entry(name))

    def __iter__(self) -> Iterator[str]:
        return iter(_entries(self._section))

    def __len__(self) -> int:
        return len(_entries(self._section))

    def __repr__(self) -> str:
        return f"<{len(self)} {self._section} by name>"

    def entry(self, name: str) -> Entry:
        """All that is known of one: its numbers with their intervals and sources."""
        entries = _entries(self._section)
        if not isinstance(name, str) or name not in entries:
            near = [f"{each!r}" for each in self.find(name)[:4]] if isinstance(name, str) else []
            hint = f"; did you mean {' or '.join(near)}?" if near else check.nearest(name, entries)
            raise Unlisted(
                f"the catalogue of {self._section} has no {check.shown(name)}{hint}; `fem-impact catalogue` lists all"
            )
        return entries[name]

    def find(self, words: str) -> tuple[str, ...]:
        """The names, or names of groups, that contain each of some words."""
        wanted = words.lower().replace(",", " ").split()
        entries = _entries(self._section).values()
        return tuple(each.name for each in entries if all(w in f"{each.group} {each.name}".lower() for w in wanted))


@cache
def _file() -> Mapping[str, Any]:
    return tomllib.loads(FILE.read_text("utf-8"))


@cache
def _entries(section: str) -> Mapping[str, Entry]:
    """The entries of a section of the file; a wood with its constants in every direction comes once for each cut."""
    found: dict[str, Entry] = {}
    every = sources()
    for group, items in _file()[section].items():
        for name, given in items.items():
            words, facts = {key: value for key, value in given.items() if key in ("kind", "note")}, {}
            for key in (key for key in given if key not in (*words, "tips")):
                # [value, source], [value, about, source] or [value, low, high, source]
                value, *ends, source = given[key]
                interval = zip(((), ("about",), ("low", "high"))[len(ends)], map(float, ends))
                facts[key] = Fact(float(value), MappingProxyType(dict(interval)), UNITS[key], *every[source])
            tips = tuple(given.get("tips", ()))
            for cut, names in CUTS.items() if "E_L" in facts else [("", {})]:
                own = {key: facts[wood] for key, wood in names.items() if wood in facts}
                entry = Entry(name + cut, group, MappingProxyType({**facts, **own}), tips=tips, **words)
                found[entry.name] = entry
    return MappingProxyType(found)


def sources() -> Mapping[str, tuple[str, bool]]:
    """The sources of the catalogue by their keys in the file: in words, and whether they could be read."""
    return {key: (each["words"], each["read"]) for key, each in _file()["sources"].items()}


def _material(entry: Entry) -> Material:
    return Material(**known.taken("", entry.table)[0])


def _striker(entry: Entry) -> Striker:
    values = known.taken("", entry.table)[0]
    kind = values.pop("kind")
    if kind == "sphere":
        return Striker.sphere(Material(**{key: value for key, value in values.items() if key != "radius"}),
                              values["radius"])  # fmt: skip
    return Striker.rigid(**values) if kind == "rigid" else Striker.stick(**values)


def _hammer(entry: Entry) -> ImpactHammer:
    facts, tips = entry.facts, _entries("tips")
    sensitivity = facts["sensitivity"].value if "sensitivity" in facts else None
    stiffness = {tip: tips[tip].facts["stiffness"].value for tip in entry.tips}
    return ImpactHammer(entry.name, facts["mass"].value, facts["force"].value, sensitivity, MappingProxyType(stiffness))


materials: Catalogue[Material] = Catalogue("materials", _material)
strikers: Catalogue[Striker] = Catalogue("strikers", _striker)
hammers: Catalogue[ImpactHammer] = Catalogue("hammers", _hammer)
