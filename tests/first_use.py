"""What a fresh installation must do; run by `test_packaging` with the Python of an environment of its own.

    python tests/first_use.py FOLDER

Uses nothing but the package and what it depends on, and compares with closed forms.
"""

import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import fem_impact as fi

SCENE = "plate.toml"


def modes_of_elements_agree_with_closed_forms() -> fi.Modes:
    """The modes of a hinged plate, in Hz those of Navier's formula."""
    wood = fi.Material(E=10e9, nu=0.3, rho=450.0)
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), fi.Plate(wood, thickness=3e-3), supports={"boundary": "hinged"})
    modes = fi.find_modes(system, n_modes=10)
    rigidity = 10e9 * 3e-3**3 / (12 * (1 - 0.3**2)) / (450.0 * 3e-3)
    known = sorted(
        np.pi / 2 * np.sqrt(rigidity) * ((i / 0.465) ** 2 + (j / 0.3) ** 2) for i in range(1, 9) for j in range(1, 9)
    )
    np.testing.assert_allclose(modes.frequencies, known[:10], rtol=1e-4)
    return modes


def a_picture_shows_every_mode(modes: fi.Modes, folder: Path) -> None:
    """Of four panels none is black, as three are with VTK 9.6.1."""
    fi.pictures.mode_shapes(folder / "modes.png", modes, count=4, columns=2)
    ink = plt.imread(folder / "modes.png")[..., :3]
    rows, columns = (n // 2 for n in ink.shape[:2])
    panels = [ink[i : i + rows, j : j + columns] for i in (0, rows) for j in (0, columns)]
    assert all(0.5 < panel.mean() < 1.0 for panel in panels)


def a_half_sine_on_a_wall_is_told_right() -> None:
    hit = fi.strike(fi.Modes.rigid(1e6), fi.Striker.rigid(0.01), fi.Contact.linear(1e6), at=None, speed=1.0)
    np.testing.assert_allclose(hit.contact_time, np.pi * np.sqrt(0.01 / 1e6), rtol=1e-3)
    np.testing.assert_allclose(hit.impulse, 0.02, rtol=1e-3)


def a_map_counts_impacts() -> None:
    body = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=100)
    table = fi.sweep(
        body, fi.Striker.stick(0.1, 10e3), fi.Contact.hertz(695e3), at=(0.465, 0.3), speed=1.0, tolerance=1e-2,
        over={"striker.mass": [0.02, 0.1], "contact.stiffness": [1e5, 1e6, 1e7]},
    )  # fmt: skip
    assert table.n_impacts.shape == (2, 3) and (table.n_impacts.values >= 1).all() and bool(table.tolerance_met.all())


def commands_write_their_files(folder: Path) -> None:
    def run(*words: str) -> None:
        subprocess.run([sys.executable, "-P", "-m", "fem_impact", *words], cwd=folder, check=True, timeout=600)

    run("new", "plate", "--out", SCENE)
    run("strike", SCENE, "--out", "out")
    run("modes", SCENE, "--count", "4", "--vtk", "out/modes.pvd")
    assert {"response.json", "force.csv", "force.png", "strike.wav"} <= {
        path.name for path in (folder / "out").iterdir()
    }


if __name__ == "__main__":
    a_picture_shows_every_mode(modes_of_elements_agree_with_closed_forms(), Path(sys.argv[1]))
    a_half_sine_on_a_wall_is_told_right()
    a_map_counts_impacts()
    commands_write_their_files(Path(sys.argv[1]))
    print(f"fem_impact {fi.__version__} works")
