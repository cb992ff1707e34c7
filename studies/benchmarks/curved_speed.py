"""What curvature and ribs cost: modes of a guitar top and blows on a cymbal, as built and flat, in processor time.

    python studies/benchmarks/curved_speed.py [--modes 200] [--tolerance 1e-3] [--repeats 1]

Finds modes of the spruce top of `scenes/everyday/guitar_fingertip.toml`, domed and with its bars, and of the same one
without; strikes the cymbal of 16 inches of `cymbal_crash_16_hickory.toml` at 1e-2, with and without bow and cup.
Processor times of this process, after a first blow that loads the compiled kernels; with OMP_NUM_THREADS=1 they are
those of one core.
"""

import sys
import tempfile
import warnings
from pathlib import Path

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
sys.path.append(str(Path(__file__).parents[1] / "verification"))  # of `flatness`
import flatness
import shared

TOP, CYMBAL = "guitar_fingertip", "cymbal_crash_16_hickory"


def bodies(name: str, folder: Path) -> dict[str, Path]:
    """The scene of a flat body, and that of the body as built."""
    plain = folder / f"{name}.toml"
    plain.write_text(flatness.flat(name), encoding="utf-8")
    return {"flat": plain, "as built": flatness.EVERYDAY / f"{name}.toml"}


def modes(path: Path, n_modes: int, tolerance: float, repeats: int) -> tuple[float, int, float]:
    """Processor time [s] of modes, their unknowns, and the largest estimated error of a frequency [-]."""
    target = fi.load_scene(path).built.target
    seconds, found = shared.timed(lambda: target.find(n_modes, tolerance=tolerance), repeats)
    return seconds, found.shapes.system.n_dofs, float(found.frequency_error.max())


def blow(path: Path, repeats: int) -> tuple[float, fi.Response]:
    """Processor time [s] of a blow from the scene on, without its audit."""
    return shared.timed(lambda: fi.load_scene(path).strike(), repeats)


def main() -> None:
    """Run the benchmark from the command line."""
    parser = shared.parser(__doc__)
    parser.add_argument("--modes", type=int, default=200)
    parser.add_argument("--tolerance", type=float, default=1e-3, help="of the frequencies")
    parser.add_argument("--repeats", type=int, default=1, help="the fastest counts")
    options = parser.parse_args()
    warnings.simplefilter("ignore", fi.ToleranceWarning)
    fi.load_scene(flatness.EVERYDAY / "marimba_yarn.toml").strike()  # loads the kernels
    times: dict[str, list[float]] = {TOP: [], CYMBAL: []}
    with tempfile.TemporaryDirectory() as folder:
        print(f"{options.modes} modes of a guitar top at {options.tolerance:g}")
        for body, path in bodies(TOP, Path(folder)).items():
            seconds, unknowns, error = modes(path, options.modes, options.tolerance, options.repeats)
            times[TOP].append(seconds)
            print(f"  {body:>8}: {seconds:6.1f} s, {unknowns} unknowns, error up to {error:.1e}", flush=True)
        print("a blow on a cymbal of 16 inches at 1e-2")
        for body, path in bodies(CYMBAL, Path(folder)).items():
            seconds, hit = blow(path, options.repeats)
            times[CYMBAL].append(seconds)
            print(
                f"  {body:>8}: {seconds:6.1f} s, restitution {hit.restitution:.4f} to {hit.error.total:.1e}", flush=True
            )
    for name, (plain, built) in times.items():
        print(f"{name}: as built over flat {built / plain:.2f}")


if __name__ == "__main__":
    main()
