"""Modes from closed formulas, in the same type as FE modes, so that each can check the other."""

from collections.abc import Callable
from functools import partial
from typing import Any

from ..fe.assembly import support_of_facets
from ..fe.section import Beam, Plate
from ..mesh.meshes import Mesh
from .disk import disk
from .modal import Modes
from .rectangle import rectangle
from .slender import beam

__all__ = ["beam", "closed_form", "disk", "rectangle"]


def closed_form(
    mesh: Mesh, section: Plate | Beam, supports: dict[str, Any], theory: str | None = None
) -> Callable[..., Modes] | None:
    """Function of ``n_modes`` or ``max_frequency`` [Hz] that finds the modes of this body; None if no formula does.

    There are formulas for beams of constant section, and for thin flat isotropic plates of constant thickness without
    tension, ribs and uneven layers that are rectangles hinged all round or disks with the same support all round.
    """
    if theory == "mindlin" or mesh.rise is not None or not getattr(section, "plain", True):
        return None
    kinds, (form, *sizes) = support_of_facets(mesh, supports), mesh.form or ("",)
    held = {kind if isinstance(kind, str) else "elastic" for kind in kinds}
    if "elastic" in held:
        return None
    if isinstance(section, Beam):
        uniform = form == "line" and not callable(section.width) and not callable(section.height)
        ends = str(kinds[0]), str(kinds[-1])
        return partial(beam, *sizes, ends=ends, section=section, theory=theory or "euler") if uniform else None
    if not section.uniform or section.material.E_across is not None or section.tension or len(held) > 1:
        return None
    if form == "rectangle" and held == {"hinged"}:
        return partial(rectangle, *sizes, section=section)
    if form == "disk":
        return partial(disk, *sizes, edge=held.pop(), section=section)
    return None
