"""A kettledrum's head without its kettle: the ratios of its frequencies, which the air around it sets."""

import numpy as np
from reality.record import Experiment, Measured, Predicted

import fem_impact as fi

RADIUS, THICKNESS = 0.325, 0.19e-3  # [m]
HEADS = ((2500.0, 0.262), (4500.0, 0.262), (3500.0, 0.24), (3500.0, 0.29))  # [N/m] tension and [kg/m^2] weight
FIRST = (1, 3, 6, 10, 15)  # where the modes with 1 to 5 nodal diameters and no circle but the rim stand
RATIOS = (1.48, 1.92, 2.36, 2.78)  # [-] over the one with 1 diameter
UNEVEN = 0.01  # [-] assumed: one deviation of a frequency because no head is tuned evenly
DRAWS = 2000  # [-] of each head


def frequencies(tension: float, weight: float) -> tuple[np.ndarray, np.ndarray]:
    """Those modes of a head [Hz], without air and in a wall."""
    film = fi.Plate(fi.Material(E=4e9, nu=0.35, rho=weight / THICKNESS), thickness=THICKNESS, tension=tension)
    system = fi.assemble(fi.mesh.disk(RADIUS), film, {"outer": "hinged"})
    modes = fi.find_modes(system, n_modes=18, tolerance=5e-3)
    return modes.frequencies[list(FIRST)], fi.in_air(modes).frequencies[list(FIRST)]


def predict() -> Predicted:
    """Ratios with any share of the air that would move in a wall: `fi.in_air` states no more of a head without one."""
    rng = np.random.default_rng(2)
    rows = []
    for head in HEADS:
        alone, walled = frequencies(*head)
        share = rng.uniform(0.0, 1.0, (DRAWS, 1))
        found = alone / np.sqrt(1.0 + share * ((alone / walled) ** 2 - 1.0))
        found = found * (1.0 + UNEVEN * rng.standard_normal(found.shape))
        rows.append(found[:, 1:] / found[:, :1])
    return Predicted(np.concatenate(rows), computation=5e-3)


EXPERIMENTS = (
    Experiment(
        key="kettledrum",
        title="Kettledrum's head without its kettle",
        source="T. D. Rossing, Percussionist 19 (1982), 18-31, quoted at wtt.pauken.org/chapter-3/timpani-bowl, second "
        "paragraph",
        licence="page of an author; numbers only",
        rig="drum of 26 inches (65 cm), head without its bowl, in air",
        known={
            "tension": "2.5 to 4.5 kN/m", "weight of the head": "0.24 to 0.29 kg/m²",
            "air that moves": "any share of that in a wall", "evenness": f"{100 * UNEVEN:g} % of a frequency, assumed",
        },
        left_open="the head, its tension, its rim, what surrounded it",
        measured=tuple(
            Measured(f"mode {i + 2}1 over 11", ratio, 0.01, "") for i, ratio in enumerate(RATIOS)
        ),
        predict=predict,
        found="With all the air that would move in a wall the ratios are 1.47, 1.92, 2.37 and 2.80: the open head "
        "carries nearly as much. `fi.in_air` without a wall takes half of it and says that it may err by 10 to 25 %.",
    ),
)  # fmt: skip
