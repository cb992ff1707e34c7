"""What the program asks of a contact law, and the spring and the point that its kernels pass on."""

from typing import Any, ClassVar, NamedTuple

import numpy as np

POWER = 0.0  # kind of a law that is a power of the approach and nothing else


class Spring(NamedTuple):
    """One contact as it is now; a plastic one measured from its dent."""

    stiffness: float  # [N/m**exponent]
    exponent: float  # [-]
    loss: float  # [s/m]
    compliance: float  # [m/N] in series
    kind: float  # [-]
    corner: float  # [m] compression from which the force takes another course; infinite if none
    hard: float  # [N/m**hard_exponent] stiffness of what the force gains from there; of felt, what the memory takes;
    # of the user's own law the address of its table
    hard_exponent: float  # [-]; of the user's own law its number of knots
    relaxation: float  # [s] of a memory that fades; 0: there is none
    memory: float  # [m**exponent] of felt
    steeper: float  # [N/m] of one that yields: how much steeper its force becomes far beyond the corner
    reach: float  # [m] over which it does


class Point(NamedTuple):
    """A contact's spring at one approach."""

    approach: float  # [m]
    compression: float  # [m]
    force: float  # [N] elastic
    energy: float  # [J]


class LawNumber(NamedTuple):
    """A number of a law: a field of `Contact`, of the compiled rows and of the table [contact] of a scene."""

    unit: str
    axis: str  # what it is, on the axis of a map
    key: str  # what it is, in a scene file
    least: float | None = 0.0  # None: more than 0
    most: float = np.inf


class Law:
    """A contact law; those of `law.LAWS` say what differs.

    Its numbers as it is asked are a `Contact` or a `law.Row`: both have the fields by name.
    """

    kind = POWER  # of its rows
    name = ""  # of the method of `Contact` that makes one, and of its kind in a scene
    mark = ""  # field that is positive for this law alone
    numbers: ClassVar[dict[str, LawNumber]] = {}  # its own
    keys: ClassVar[dict[str, LawNumber]] = {}  # further arguments of the method, or with other words in a scene
    damped = False  # whether a loss factor may go with it
    remembers = False  # whether the force depends on what was before
    rated = False  # whether it depends on how fast the contact is pressed, even without a loss factor
    hertzian = False  # whether with exponent 1.5 the area of the contact is that of round bodies
    slopes: tuple[str, ...] = ("stiffness", "exponent")  # numbers in which gradients are taken
    words = ""  # what follows the name of a power law in a report of fitted taps

    def check(self, contact: Any) -> None:
        """ValueError where numbers that are good alone do not go together."""
        if self.remembers and contact.exponent < 1.0:
            raise ValueError(
                f"exponent must be at least 1 for a contact that yields or is felt, got {contact.exponent:g}"
            )

    def check_reached(self, contact: Any, history: Any, i: int) -> None:
        """ValueError where contact i of a run went deeper than its law is known."""

    def acts(self, contact: Any) -> bool:
        """Whether these numbers make it more than a power law."""
        return True

    def table(self, contact: Any) -> Any:
        """Its knots as kernels read them; see `tabled`."""
        return 0.0

    def force(self, contact: Any, pressed: np.ndarray) -> np.ndarray:
        """Force [N] at approaches >= 0 [m], first pressed, so fast that nothing relaxes, without the loss factor."""
        return np.asarray(contact.stiffness * pressed**contact.exponent)

    def acting(self, row: Any, mobility: Any, speed: Any) -> np.ndarray:
        """See `contact.acting_stiffness`: of the power law that stores as much at the same deepest approach."""
        energy = np.asarray(0.5 * np.asarray(speed) ** 2 / np.asarray(mobility))  # [J]
        deepest, power = self.deepest(row, energy), row.exponent + 1.0
        stands_in = power * energy / np.where(deepest > 0.0, deepest, 1.0) ** power
        return np.where(deepest > 0.0, stands_in, row.stiffness)

    def deepest(self, row: Any, energy: np.ndarray) -> np.ndarray:
        """Approach [m] at which it has taken an energy [J], first pressed; 0 of a power law."""
        return np.zeros(energy.shape)

    def steepest(self, row: Any, energy: np.ndarray) -> np.ndarray:
        """Slope of its force [N/m] where it is pressed deepest, or leaves from there; 0 of a power law."""
        deepest = self.deepest(row, energy)
        less = (1.0 - 1e-4) * deepest
        rise = self.force(row, deepest) - self.force(row, less)
        return np.asarray(rise / np.where(deepest > 0.0, deepest - less, 1.0))

    def sunk(self, row: Any, memory: np.ndarray, left: np.ndarray) -> np.ndarray:
        """How much lower than at first the surface lies [m], by its memory and the time it has been ``left`` [s]."""
        return np.zeros(memory.shape)

    def remembered(self, row: Any, memory: float, pressed: float, force: float, left: float) -> float:
        """What it remembers ``left`` [s] after a step began with this memory.

        Its spring is then ``pressed`` by so much [m], and its force [N] zero if it has been so all the while.
        """
        return 0.0

    def approach(self, contact: Any, force: float) -> float:
        """Approach [m] at which it first has a force [N]."""
        return float((force / contact.stiffness) ** (1.0 / contact.exponent))

    def wide(self, contact: Any, approach: float) -> float:
        """Approach [m] at which round bodies that do not yield have a contact as wide as these at an approach [m]."""
        return approach

    def sentence(self, contact: Any, si: Any) -> str:
        """What a report adds to the sentence on a power law; ``si`` writes a number with its unit."""
        return ""
