"""`fem-impact play`: a scene as a player, its strokes from where the command line says, its sound to where it says."""

import argparse
import signal
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager

from .._base.files import signalled
from ..modes.modal import Modes
from ..scenes.scene import Scene
from .controllers import KEYS, Hands, Source, keys, of_note, port, spread_points
from .devices import Clock, Device, Speaker
from .player import PlayedStroke, Player, Score

N_POINTS = len(KEYS[0])  # points to strike, one for each column of keys


def player_of(scene: Scene, modes: Modes, options: argparse.Namespace) -> Player:
    """The scene as something to play, with the volume set by one stroke at full speed."""
    blow = scene.blow.values
    # the speed of the scene is a stroke of half strength
    fastest = options.fastest if options.fastest is not None else 2.0 * blow["speed"]
    points = options.at or list(spread_points(modes, blow["at"], N_POINTS))
    player = Player(
        modes, scene.make_striker(), scene.make_contact(), points=points, fastest=fastest, listen=scene.points[0],
        block=options.block,
    )  # fmt: skip
    peak = max(abs(player.play([PlayedStroke(0, 0, player.fastest)], 0.1).samples).max(), 1e-30)
    player.gain /= player.sticks * float(peak)  # a stroke by every stick at once does not clip
    player.struck.reset()
    return player


@contextmanager
def source_of(
    options: argparse.Namespace, player: Player, notes: Sequence[tuple[float, int, int]]
) -> Iterator[tuple[Source, str]]:
    """Where the strokes come from, with the ``notes`` of a file by `read_midi`, and that in words."""
    if notes:
        strokes = [
            PlayedStroke(round(time * player.rate), *of_note(note, velocity, len(player.points), player.fastest))
            for time, note, velocity in notes
        ]
        yield Score(strokes), f"{len(strokes)} notes of {options.midi}"
        return
    hands = Hands()
    with ExitStack() as open_now:
        open_now.enter_context(signalled(lambda *_: hands.stop(), signal.SIGINT))  # ends the playing, not the program
        if options.midi_port is not None:
            name = open_now.enter_context(port(options.midi_port, hands, len(player.points), player.fastest))
            yield hands, f"MIDI port {name}; Ctrl-C ends"
        else:
            open_now.enter_context(keys(hands, len(player.points), player.fastest))
            yield hands, f"keys {KEYS[0]} to {KEYS[-1]}: a column for each point, louder from row to row; Esc ends"


def device_of(options: argparse.Namespace, live: bool) -> tuple[Device | None, str]:
    """What plays, and why not the loudspeaker."""
    if options.silent:
        return (Clock() if live else None), ""
    try:
        return Speaker(), ""
    except ValueError as error:
        return (Clock() if live else None), str(error)
