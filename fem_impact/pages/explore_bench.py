"""What lies on the bench of the live page: a drawing, a material and a mallet, and the blows kept to compare."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._base import check
from ..impact.catalogue import Catalogue, materials, strikers
from ..mesh.loops import UNITS
from ..scenes import adapted, templates
from ..scenes.scene import Scene, load_scene, scene_of

LARGEST_DRAWING = 8_000_000  # [byte] of a dropped file: drawings take some kilobytes, meshes of a million nodes more
RESCALED = ("mass", "first_frequency")  # keys of [target] that were measured on the scene's own material


@dataclass(frozen=True)
class Order:
    """What a page wants on the bench; None leaves what the scene says."""

    drawing: Path | None = None  # or a mesh file; None: the scene that the server began with
    unit: str | None = None  # of the numbers in the drawing
    material: str | None = None
    mallet: str | None = None
    thickness: float | None = None  # [m]
    at: tuple[float, ...] | None = None  # [m] strike point
    dropped: bool = False  # whether the drawing lies in a folder that ends with the server


def first_scene(what: Scene | str | Path | None) -> tuple[Scene, Order]:
    """The scene that a server begins with, and what lies on the bench then: `scene_of_order` makes a drawing's."""
    if isinstance(what, Scene):
        return what, Order()
    path = None if what is None else check.path("scene", what)
    if path is not None and path.suffix.lower() == ".toml":
        return load_scene(path), Order()
    plate = scene_of(tomllib.loads(templates.text("plate")), Path("plate.toml"), folder=Path())
    return plate, Order(path)


def scene_of_order(first: Scene, order: Order) -> Scene:
    """The scene of an order; ``first`` is the one that the server began with.

    A drawing makes the scene that ``fem-impact new --from`` writes for it; names replace tables as they do there.
    """
    scene, body = first, first.path.stem
    if order.drawing is not None:
        whole, _ = adapted.text("plate", order.drawing.parent, drawing=order.drawing, unit=order.unit)
        scene = scene_of(tomllib.loads(whole), order.drawing.with_suffix(".toml"), folder=order.drawing.parent)
        body = order.drawing.stem
    tables = scene.data()
    for name, wanted, table in (("material", order.material, "material"), ("thickness", order.thickness, "section")):
        if wanted is not None and (table not in tables or "layer" in tables):
            raise ValueError(f"{name} must be left to this scene, whose tables say it in another way")
    if order.material is not None:
        tables["material"] = {"name": order.material}
        target = {key: value for key, value in tables.get("target", {}).items() if key not in RESCALED}
        damped = adapted.damping_of(order.material)
        tables["target"] = target if damped is None else {**target, "damping_ratio": damped}
    if order.mallet is not None:
        tables["striker"] = {"name": order.mallet}
        tables.pop("contact", None)
    if order.thickness is not None:
        tables["section"] = {**tables["section"], "thickness": order.thickness}
    if order.at is not None:
        tables["strike"] = {**tables["strike"], "at": list(order.at)}
    if order.drawing is not None or order.material is not None or order.mallet is not None:
        tables["title"] = adapted.title_of_body(body, order.material, order.mallet)
    return scene_of(tables, scene.path, folder=Path())


def pickable(first: Scene, order: Order, scene: Scene) -> dict[str, Any]:
    """What the page offers to pick: names by group, units, the thickness [mm], and what is picked."""
    tables = scene.data()
    thickness = tables.get("section", {}).get("thickness")
    flat = isinstance(thickness, float) and "layer" not in tables
    return {
        "materials": _grouped(materials) if "material" in tables and "layer" not in tables else [],
        "mallets": _grouped(strikers), "units": list(UNITS) if order.drawing is not None else [],
        "thickness": 1e3 * thickness if flat else None, "drawing": order.drawing.name if order.drawing else "",
        "unit": order.unit or "", "material": order.material or "", "mallet": order.mallet or "",
        "first": first.title or first.path.stem,
    }  # fmt: skip


def _grouped(names: Catalogue[Any]) -> list[tuple[str, list[str]]]:
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(names.entry(name).group, []).append(name)
    return list(groups.items())


def order_of(wanted: Any, folder: Path | None, before: Order, at: tuple[float, ...]) -> Order:
    """What a page asks for; ValueError if that makes no sense. A point stays where the body stays."""
    if not isinstance(wanted, dict) or not all(isinstance(value, (str, int, float)) for value in wanted.values()):
        raise ValueError("open must be a table of words and numbers")
    words = {key: str(wanted[key]) or None for key in ("unit", "material", "mallet") if key in wanted}
    drawing, dropped, same = before.drawing, before.dropped, True
    if "drawing" in wanted:
        same = False
        drawing = None if folder is None or not wanted["drawing"] else folder / safe_name(str(wanted["drawing"]))
        dropped = drawing is not None
    thickness = before.thickness
    if "thickness" in wanted:
        thickness = check.between("thickness", float(wanted["thickness"]) * 1e-3, 1e-5, 1.0, "m")  # a film, a wall
    unit = words.get("unit", before.unit if same else None)
    place = at if same and unit == before.unit else None
    return Order(
        drawing, unit, words.get("material", before.material), words.get("mallet", before.mallet), thickness, place,
        dropped,
    )  # fmt: skip


def safe_name(name: str) -> str:
    """The name of a dropped file without folders and odd characters; ValueError if its kind cannot be explored."""
    found = re.sub(r"[^\w.-]+", "_", name.replace("\\", "/").rpartition("/")[2]).lstrip(".")[-80:]
    ending = Path(found).suffix.lower()
    if ending in ("", ".toml"):
        raise ValueError(
            f"{check.line(name)} must be an .svg or .dxf drawing or a mesh file; open a scene by "
            "`fem-impact explore SCENE`"
        )
    return found
