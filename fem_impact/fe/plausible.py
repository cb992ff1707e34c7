"""Numbers that are allowed but probably a slip of a unit: notes in plain words, from one table of real materials."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import KDTree


@dataclass(frozen=True)
class PlausibleRange:
    """What a quantity can be in the real world."""

    low: float
    softer: str  # what a number below ``low`` would mean
    high: float
    harder: str  # what a number above ``high`` would mean
    unit: str
    slip: str  # the usual slip


# Lowest and highest values of solids that can be struck.
# E, G: elastomers from about 1e6 Pa and their shear modulus, a third of that (Ashby, Materials Selection in Mechanical
# Design, 4th ed. 2011, fig. 4.3); diamond has 1.22e12 Pa and 5.7e11 Pa (McSkimin and Andreatch 1972, J. Appl. Phys. 43,
# 2944). rho: cork has 120 to 240 kg/m^3 and polymer foams 25 and more (Gibson and Ashby, Cellular Solids, 2nd ed. 1997,
# tables 1.1 and 12.1); osmium has 22 590 kg/m^3 (CRC Handbook of Chemistry and Physics, section 4). damping: the loss
# factor of the best damping polymers is about 1, but that of a structure made of them stays below 0.4, twice the ratio
# (Cremer, Heckl and Petersson, Structure-Borne Sound, 3rd ed. 2005, section 3.4).
STIFFNESS = "Pa are expected, and 210 GPa is 210e9"
RANGES = {
    "E": PlausibleRange(1e6, "softer than rubber", 1.3e12, "stiffer than diamond", "Pa", STIFFNESS),
    "E_across": PlausibleRange(1e6, "softer than rubber", 1.3e12, "stiffer than diamond", "Pa", STIFFNESS),
    "G": PlausibleRange(3e5, "softer than rubber", 6e11, "stiffer than diamond", "Pa", STIFFNESS),
    "rho": PlausibleRange(
        25.0, "lighter than cork", 2.3e4, "heavier than osmium", "kg/m^3",
        "kg/m^3 are expected, and 7.85 g/cm^3 is 7850",
    ),
    "damping_ratio": PlausibleRange(
        0.0, "", 0.2, "more than any plate or beam has", "",
        "a fraction of critical damping is expected, and 5 % is 0.05",
    ),
    "speed": PlausibleRange(
        0.0, "", 300.0, "as fast as a bullet, and no contact stays elastic", "m/s", "m/s are expected"
    ),
    "length": PlausibleRange(
        1e-3, "smaller than a grain of rice", 50.0, "larger than anything usually struck", "m",
        "m are expected, and 465 mm is 0.465",
    ),
    "tap": PlausibleRange(
        5e-3, "slower than a hammer taps", 30.0, "faster than a hammer taps", "m/s",
        "check the unit of the force and the mass of the hammer",
    ),
    "pulse": PlausibleRange(
        2e-6, "shorter than a tap", 0.1, "longer than a tap", "s", "check rate, or the unit of the times, which is s",
    ),
}  # fmt: skip
NAMES = {
    "rho": "density", "damping_ratio": "damping_ratio =", "speed": "speed", "length": "a length of",
    "tap": "a speed of", "pulse": "a pulse of",
}  # fmt: skip
# [-] shapes over those expected from the mass, beyond which a remark is made: at measured points 0.3 to 3 are
# usual, and another unit of mass gives 30
ODD = 10.0
# [-] half the mean square of a shape's differences between neighbours, over its variance: it is 1 in random order; of
# 400 sets of modes of beams, plates and disks at random points the smoothest mode had at most 0.52
ROUGH = 0.6
FEWEST = 8  # [-] points: of fewer, neighbours may be far apart
# [-] thickness over the shortest side above which a remark is made: thin theory then errs by tens of per cent
THICK = 0.3


def note_number(name: str, value: Any) -> Iterator[str]:
    """A note if a number lies outside the `PlausibleRange` of that name; none for a function of place."""
    known = RANGES[name]
    if callable(value) or value is None or known.low <= value <= known.high:
        return
    unit = f" {known.unit}" if known.unit else ""
    meaning = known.softer if value < known.low else known.harder
    yield f"{NAMES.get(name, name + ' =')} {value:g}{unit} is {meaning}; {known.slip}"


def doubted_sizes(sides: Sequence[float], section: Any) -> tuple[str, ...]:
    """Notes on a body with sides [m] in its plane, or along its line, and a section."""
    notes = list(note_number("length", max(sides)))
    if section is None:
        return tuple(notes)
    layers = getattr(section, "layers", ())
    notes += [note for made in (section, *layers) for note in made.material.notes]
    name = "thickness" if hasattr(section, "thickness") else "height"
    thickness = getattr(section, name)
    if not callable(thickness) and thickness > THICK * min(sides):
        side = "the shortest side" if len(sides) > 1 else "the length"
        notes.append(
            f"{name} {thickness:g} m is {thickness / min(sides):.3g} times {side}, {min(sides):g} m; the theory is for "
            "thin bodies, and 3 mm is 0.003"
        )
    return tuple(notes)


def notes_on_ribs(given: Sequence[Any], sides: Sequence[float]) -> Iterator[str]:
    """Notes on ribs of a plate with sides [m]: sizes that are probably a slip of a unit, and a rib that comes twice."""
    for i, rib in enumerate(given):
        for name, size in (("width", rib.section.width), ("height", rib.section.height), ("offset", rib.offset or 0.0)):
            if not callable(size) and abs(size) > THICK * min(sides):
                yield (
                    f"{name} {size:g} m of ribs[{i}] is {abs(size) / min(sides):.3g} times the shortest side, "
                    f"{min(sides):g} m; m are expected, and 8 mm is 0.008"
                )
        for j, other in enumerate(given[:i]):
            if np.array_equal(rib.path, other.path) and rib.offset == other.offset:
                yield f"ribs[{i}] lies where ribs[{j}] does, and both count"


def notes_on_damping(ratios: np.ndarray, omega: np.ndarray | None = None) -> tuple[str, ...]:
    """Notes on damping ratios (n_modes,) [-], but for those of rigid motions, where omega (n_modes,) is zero."""
    ratios = ratios if omega is None else ratios[omega > 0.0]
    return tuple(note_number("damping_ratio", float(np.median(ratios)))) if len(ratios) else ()


def imported_notes(nodes: np.ndarray, shapes: np.ndarray, mass: float, frequencies: np.ndarray) -> tuple[str, ...]:
    """Notes on nodes (n_nodes, 1 to 3) [m] and mass-normalised shapes (n_nodes, same or 1, n_modes) of another program.

    Over the mass, the mean of their squares is one over the mass. Frequencies (n_modes,) [Hz] ascend.
    """
    notes = list(note_number("length", float(np.ptp(nodes, axis=0).max(initial=0.0))))
    if shapes.size and shapes.any():
        ratio = float(np.sqrt(mass * np.median((shapes**2).sum(axis=1).mean(axis=0))))
        if not 1.0 / ODD < ratio < ODD:
            notes.append(
                f"shapes are {ratio:.2g} times as large as those of a body of {mass:g} kg are on average; they are "
                "expected mass-normalised, and 1 t**-0.5 is 0.0316 kg**-0.5"
            )
        moved, way = shapes.reshape(-1, len(frequencies)), np.linalg.norm(shapes, axis=1)
        norms = {"longest deflection": way.max(axis=0), "length": np.linalg.norm(moved, axis=0)}
        for name, norm in ({"largest deflection": np.abs(moved).max(axis=0)} | norms).items():
            if len(norm) > 1 and np.abs(norm - 1.0).max() < 2e-5:  # files keep six digits
                notes.append(f"shapes are all normalised to a {name} of 1; they are expected mass-normalised")
                break
        some = slice(None, None, 1 + len(nodes) // 1000)
        notes += _told_again(nodes[some], shapes[some].reshape(-1, len(frequencies)), frequencies)
    return tuple(notes)


def _told_again(nodes: np.ndarray, moved: np.ndarray, frequencies: np.ndarray) -> Iterator[str]:
    """A note on pairs of modes (n, n_modes) that may be one that was found twice; on a line two may look alike."""
    spread = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)
    if len(nodes) < 4 or (nodes.shape[1] > 1 and spread[1] <= 1e-6 * spread[0]):
        return
    ends, size = np.searchsorted(frequencies, 1.01 * frequencies, side="right"), np.linalg.norm(moved, axis=0)
    near = [(i, j) for i in range(len(ends)) for j in range(i + 1, ends[i]) if frequencies[i] > 0.0]
    apart = [min(np.linalg.norm(moved[:, i] - way * moved[:, j]) for way in (1.0, -1.0)) / size[i] for i, j in near]
    alike = [pair for pair, distance in zip(near, apart) if distance < 0.1]
    if alike:
        first, second = frequencies[list(alike[0])]
        yield (
            f"{len(alike)} pairs of modes move all points alike, as those at {first:.5g} and {second:.5g} Hz; if they "
            "are one mode that was found twice, leave one of them out"
        )


def moved_along(squares: np.ndarray) -> np.ndarray:
    """Which modes (n_modes,) move along the direction of these mean squares: others move across it."""
    return squares > 0.01 * squares.max(initial=0.0)


def notes_on_mass(squares: np.ndarray, mass: float) -> tuple[str, ...]:
    """A note on mean squares (n_modes,) [1/kg] of elastic shapes over a body that all say the same other mass [kg]."""
    squares = squares[moved_along(squares)]
    if len(squares) < 3 or np.log(squares).std() > 0.15:
        return ()
    other = float(1.0 / np.median(squares))
    if 0.5 * mass < other < 2.0 * mass:
        return ()
    return (
        f"shapes are those of a uniform body of {other:.3g} kg, but the mass is {mass:.4g} kg; check it, and that "
        "shapes are mass-normalised",
    )


def notes_on_rigid(shapes: np.ndarray, mass: float, span: int) -> tuple[str, ...]:
    """Notes on rigid motions (n_points, n) [kg**-0.5] of points that span a line (1), a plane (2) or neither (0).

    They tell of a shift of another mass, by more than a hundredth, and of turns that are missing beside a shift. Of
    several that move the points alike the one that moves least counts: a true one moves no more than the mass. A single
    motion may be a turn, of points at one distance from a hinge.
    """
    if not shapes.size:
        return ()
    shift, _, rank, _ = np.linalg.lstsq(shapes, np.ones(len(shapes)), rcond=1e-6)
    moved, notes = float(shift @ shift), []
    if np.abs(shapes @ shift - 1.0).max() > 0.01:
        return ()
    if shapes.shape[1] <= span < 3:
        notes.append(
            f"the rigid motions given are {shapes.shape[1]} of the {span + 1} of a body that nothing holds; give the "
            "others, which turn it, as modes of 0 Hz, or free = False"
        )
    if rank > 1 and (moved > 1.01 * mass or (rank == shapes.shape[1] and moved < 0.99 * mass)):
        notes.append(
            f"the rigid motions shift {moved:.4g} kg by their shapes, but the mass is {mass:.4g} kg; check it, and "
            "that shapes are mass-normalised"
        )
    return tuple(notes)


def disordered(nodes: np.ndarray, shapes: np.ndarray) -> tuple[str, ...]:
    """A note on nodes (n_nodes, 1 to 3) [m] next to which no shape (n_nodes, n_modes) is as at the nodes themselves."""
    moves = shapes[:, np.ptp(shapes, axis=0) > 0.0]
    if len(nodes) < FEWEST or not moves.size:
        return ()
    nearest = KDTree(nodes).query(nodes, k=2)[1][:, 1]
    if (0.5 * ((moves - moves[nearest]) ** 2).mean(axis=0) < ROUGH * moves.var(axis=0)).any():
        return ()
    return ("shapes are as different at neighbouring points as at any two; they are expected in their order",)


def together(*several: Sequence[str]) -> tuple[str, ...]:
    """All notes, each once, in order."""
    return tuple(dict.fromkeys(note for notes in several for note in notes))
