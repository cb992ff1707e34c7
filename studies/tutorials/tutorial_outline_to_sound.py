"""Tutorial: from an SVG outline to its sound. Meshes the top of a ukulele, taps it and writes the sound.

python studies/tutorials/tutorial_outline_to_sound.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

DRAWING = shared.MESHES / "ukulele.svg"
TAP = (0.09, -0.195)  # [m] at the bridge; the origin is the upper left corner of the drawing, y points up
LISTEN = (0.09, -0.17, 0.5)  # [m] half a metre in front of the top


def main(folder: Path, tolerance: float = 1e-3) -> dict[str, fi.Response]:
    """Go from the drawing to the sound; return the blows."""
    folder.mkdir(parents=True, exist_ok=True)

    print("1. The drawing. The ids of its shapes, `rim` and `hole`, become the names of the edges.")
    mesh = fi.mesh.outline(DRAWING)
    print(f"   {1e4 * mesh.area:.0f} cm2, edges {', '.join(mesh.edges)}")

    print("2. The wood: spruce, 1.8 mm, with the grain along the strings; clamped at the sides, free around the hole.")
    spruce = fi.Material.orthotropic(E_along=11e9, E_across=0.7e9, G=0.7e9, nu=0.37, rho=420.0, angle=np.pi / 2)
    plate = fi.Plate(spruce, thickness=1.8e-3)
    system = fi.assemble(mesh, plate, supports={"rim": "clamped", "hole": "free"})
    print(f"   {1e3 * system.mass:.1f} g")

    print("3. All modes up to 8 kHz.")
    modes = fi.find_modes(system, max_frequency=8e3, damping_ratio=0.01)
    print(f"   {modes.n_modes}, the lowest at {', '.join(f'{f:.0f}' for f in modes.frequencies[:5])} Hz")
    missing = fi.pictures.mode_shapes(shared.named(folder / "ukulele_modes.png"), modes)
    print(f"   ukulele_modes.png{f' (in two dimensions; {missing})' if missing else ''}")

    print("4. Two taps at the same point and speed: with a soft, lossy fingertip and with a fingernail.")
    finger = fi.Striker.rigid(0.005)
    laws = {"fingertip": fi.Contact.power(1e7, 2.0, loss=0.2), "fingernail": fi.Contact.hertz(2e6)}
    hits = {}
    for name, law in laws.items():
        hit = fi.strike(modes, finger, law, at=TAP, speed=0.5, tolerance=tolerance)
        lost = hit.energies["target"] / (0.5 * finger.mass * hit.speed**2)
        print(f"   {name}: {hit.n_impacts} impact(s), {1e3 * hit.contact_time:.2f} ms in contact, "
              f"{hit.peak_force:.1f} N, {lost:.0%} of the energy goes into the top")  # fmt: skip
        print(f"   estimated error {hit.error.total:.0e}, tolerance {tolerance:.0e}")
        shared.save(folder / f"ukulele_{name}.png", fi.figures.force(hit))
        hits[name] = hit
    fi.pictures.wave(shared.named(folder / "ukulele_wave.png"), hits["fingernail"])

    print("5. The sound half a metre in front of the top. In both files 1.0 means 200 Pa, so you can compare them.")
    for name, hit in hits.items():
        sound = fi.export.write_wav(folder / f"ukulele_{name}.wav", hit, listener=LISTEN, duration=1.0)
        pressure = sound.full_scale * np.abs(sound.samples).max()
        print(f"   ukulele_{name}.wav: {pressure:.2f} Pa at most, {20 * np.log10(pressure / 20e-6):.0f} dB SPL")
    print(f"Everything is in {folder}.")
    return hits


if __name__ == "__main__":
    main(shared.folder())
