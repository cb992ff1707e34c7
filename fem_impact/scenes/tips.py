"""Hammers for a scene: what their tips can do at its strike point."""

from typing import Any

from .._base import check
from ..impact import accuracy
from ..sweeps import hammers
from .scene import Scene


@check.typed
def hammers_for(
    scene: Scene, bandwidth: float, masses: Any, *, drop: float = 10.0, between: bool = False
) -> tuple[hammers.Hammer, ...]:
    """What each hammer can do at the strike point of a scene; its own striker and contact are ignored (`said_of`)."""
    return hammers.choose_on(scene.built.target, scene.blow.values["at"], bandwidth, masses, drop=drop, between=between)


def said_of(scene: Scene) -> tuple[str, ...]:
    """A note if the scene's own contact is not a linear spring, as the tips of hammers are: what it amounts to."""
    if scene.contact.kind == "linear":
        return ()
    law, mass, speed = scene.make_contact(), scene.make_striker().felt_mass, float(scene.blow.values["speed"])
    alike = accuracy.resonant_stiffness(mass, accuracy.contact_resonance(law, mass, speed))
    return (
        f"tips are linear springs [N/m]; the scene's contact is of another kind ({scene.contact.kind}) and not used: "
        f"under {1e3 * mass:.4g} g at {speed:g} m/s it acts as long as a tip of {alike:.3g} N/m",
    )
