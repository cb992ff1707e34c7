"""What each cause of error may take of the tolerance of a blow."""

from dataclasses import dataclass

from ..impact import accuracy
from ..impact.error import Error

# [-] of the tolerance for left-out modes, as much for the time steps, as neither is cheap; the mesh gets the rest
SHARE = 0.45
# [-] of the tolerance for what costs little: the time steps of a blow by Ritz vectors, the modes of strikers that meet
# on the body, and the mesh, whose frequencies may err twice as much as the blow then does
CHEAP = 0.1
# [-] each attempt divides by this what modes left out, highest pairs or the mesh may err: less may need one more
NOTCH = 4.0
# [-] the verifying run divides the tolerance by this: its own error is then an eighth of what it judges
VERIFYING = 8.0
FINEST = 1e-10  # [-] lowest tolerance of a verifying run: below, rounding of long runs begins to show


@dataclass(frozen=True)
class Budget:
    """A tolerance and its shares."""

    total: float  # [-]
    lossy: bool = False  # whether the contact is: left-out modes then err more than their compliance indicates
    margin: float = 1.0  # [-] divides what left-out modes may err
    fineness: float = 1.0  # [-] divides what frequencies may err

    @property
    def half(self) -> float:
        """What the time steps may err [-], and as much what a poorer description leaves out."""
        return SHARE * self.total

    @property
    def cheap(self) -> float:
        """What anything may err [-] that costs little."""
        return CHEAP * self.total

    @property
    def for_left_out(self) -> float:
        """What left-out modes may err [-] by the estimate before the blow.

        Half their share: that costs a quarter more modes, but seldom needs a second run.
        """
        return 0.5 * self.half / (accuracy.LOSSY if self.lossy else 1.0) / self.margin

    def missed(self, error: Error, steps_follow: bool = True) -> bool:
        """Whether a blow errs too much, however fine its time steps; ``steps_follow`` is whether these can be finer."""
        return error.total - (error.step if steps_follow else 0.0) > self.total
