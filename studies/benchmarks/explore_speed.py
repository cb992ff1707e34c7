"""Measures how quickly `fem-impact explore` answers: from a slider move in a browser to the page drawn again.

    python studies/benchmarks/explore_speed.py [--no-browser] [SCENE ...]

Needs chromium, and playwright (pip install -e '.[test]').

First the CPU time that things take without a browser: opening the page, knowing a strike point, the first answers, maps
and zooms of them, with how many of the last pixels a finer tolerance counts otherwise; and answers for sliders anywhere
on their ways. Then, in a headless browser (unless --no-browser), the time until force and numbers, and until everything
that a slider moves has been drawn and the frame with it is done; then the first exact blow at a new strike point, and
zooms of the map.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import sync_playwright
from scipy import ndimage

import fem_impact as fi
from fem_impact.pages import explore_map, explore_model, explore_numbers, explore_view

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

TURNS = 30  # moves of each slider
ZOOMS = 6
ANSWERS = 300  # without a browser
FLAGS = ("--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-sync")
TURN = """async name => {
    const slider = document.getElementById(name), root = document.documentElement;
    if (!slider) return null;
    const frame = () => new Promise(done => requestAnimationFrame(() => setTimeout(done)));
    const first = String(Number(root.dataset.rested) + 1);
    const seen = attribute => new Promise(done => {
        const look = async () => {
            if (root.dataset[attribute] !== first) return;
            watch.disconnect();
            await frame();
            done(performance.now() - began);
        };
        const watch = new MutationObserver(look);
        watch.observe(root, { attributes: true });
    });
    const began = performance.now(), both = Promise.all([seen("answered"), seen("rested")]);
    slider.value = Number(slider.value) + (slider.value < slider.max / 2 ? 1 : -1) * Math.ceil(0.01 * slider.max);
    slider.dispatchEvent(new Event("input"));
    return both;
}"""
ZOOM = """async ([x0, y0, x1, y1]) => {
    const canvas = document.getElementById("map-plot"), root = document.documentElement;
    const frame = () => new Promise(done => requestAnimationFrame(() => setTimeout(done)));
    const box = canvas.getBoundingClientRect();
    const at = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, {
        clientX: box.x + x * box.width, clientY: box.y + y * box.height, pointerId: 1, bubbles: true,
    }));
    canvas.setPointerCapture = () => {};
    at("pointerdown", x0, y0);
    at("pointermove", x1, y1);
    const before = JSON.stringify(JSON.parse(root.dataset.map).slice(0, 2)), found = {};
    const began = performance.now();
    at("pointerup", x1, y1);
    return new Promise(done => {
        const watch = new MutationObserver(async () => {
            const [mass, stiffness, columns, exact] = JSON.parse(root.dataset.map);
            const stage = `${columns} points${exact ? ", each border pixel struck" : ""}`;
            if (JSON.stringify([mass, stiffness]) === before || stage in found) return;
            found[stage] = 0;
            await frame();
            found[stage] = performance.now() - began;
            if (exact) { watch.disconnect(); done(found); }
        });
        watch.observe(root, { attributes: true });
    });
}"""


def spent(work: Callable[..., Any], *arguments: Any) -> tuple[float, Any]:
    """CPU time [s] of all threads, and what the work gives."""
    begin = time.process_time()
    found = work(*arguments)
    return time.process_time() - begin, found


def opened(scene: str) -> explore_numbers.Explorer:
    """Print what it takes until the page knows its first strike point; what is compiled has been before."""
    opening, setup = spent(lambda: explore_model.Setup.of(fi.load_scene(scene)))
    explorer = explore_numbers.Explorer(setup)
    first, _ = spent(explorer.answer, setup.start)
    known, view = spent(explorer.look, setup.start.at)
    explorer.answer(setup.start), explorer.judge(setup.start)
    answer, _ = spent(explorer.answer, setup.start)
    exact, _ = spent(explorer.judge, setup.start)
    by = "modes" if view.body is None else f"{view.body.n_modes} vectors"
    print(
        f"CPU time [s]: opening {opening:.2f}, first answer {first:.3f}; strike point known by {by} {known:.2f}, "
        f"then an answer {answer:.3f}, the exact blow {exact:.3f}"
    )
    return explorer


def drawn(explorer: explore_numbers.Explorer, window: explore_map.Window) -> tuple[list[float], explore_map.Picture]:
    """CPU times [ms] until each picture of a map, and the last of them."""
    settings, times = explorer.setup.start, []
    seconds, first = spent(explorer.map, settings, explore_map.Mapper.first, window)
    times.append(seconds)
    seconds, picture = spent(explorer.map, settings, explore_map.Mapper.finer, first)
    times.append(seconds)
    seconds, _ = spent(explorer.map, settings, explore_map.Mapper.sharp, picture)
    times.append(seconds)
    seconds, picture = spent(explorer.map, settings, explore_map.Mapper.surer, picture)
    while not picture.finest:
        more, picture = spent(explorer.map, settings, explore_map.Mapper.finer, picture)
        seconds += more
    return (1e3 * np.cumsum([*times, seconds])).tolist(), picture


def otherwise(explorer: explore_numbers.Explorer, picture: explore_map.Picture, number: int = 400) -> tuple[int, int]:
    """How many pixels beside borders, of some at random, a map of a tenth of the tolerance counts otherwise."""
    count = picture.n_impacts.astype(int)
    beside = ndimage.maximum_filter(count, 3) != ndimage.minimum_filter(count, 3)
    i, j = np.random.default_rng(0).permutation(np.argwhere(beside))[:number].T
    settings, seen = explorer.setup.start, explorer.look(explorer.setup.start.at).body
    tolerance = 0.1 * explore_model.MAP_TOLERANCE
    mapper = explore_map.Mapper(explorer.setup)
    mapper._begin(settings, seen)
    fine = mapper._counts(picture.mass[j], picture.stiffness[i], tolerance)
    return int((fine != count[i, j]).sum()), len(i)


def windows(setup: explore_model.Setup) -> list[explore_map.Window]:
    """Parts of a map, in logarithms a third of each axis, anywhere."""
    rng, whole = np.random.default_rng(2), explore_map.Window.of(setup, None, None)
    found = []
    for _ in range(ZOOMS):
        parts = (rng.uniform(0.2, 0.6), 0.3), (rng.uniform(0.2, 0.6), 0.35)
        ends = [
            (low * (high / low) ** start, low * (high / low) ** (start + size))
            for (low, high), (start, size) in zip((whole.mass, whole.stiffness), parts)
        ]
        found.append(explore_map.Window.of(setup, *ends))
    return found


def maps(explorer: explore_numbers.Explorer) -> None:
    """Print the CPU time of a whole map and of zooms."""
    whole = explore_map.Window.of(explorer.setup, None, None)
    said = "25, 49, sharp borders, each border pixel struck"
    times, _ = drawn(explorer, whole)
    print(f"CPU time [ms] until a map of {said}: {', '.join(f'{t:.0f}' for t in times)}")
    found = [drawn(explorer, window) for window in windows(explorer.setup)]
    least, middle, most = (f([times for times, _ in found], axis=0) for f in (np.min, np.median, np.max))
    print(f"{ZOOMS} zooms: " + "; ".join(f"{m:.0f} ({a:.0f} to {b:.0f})" for m, a, b in zip(middle, least, most)))
    wrong, tried = np.sum([otherwise(explorer, picture) for _, picture in found], axis=0)
    print(f"pixels beside a border that a tenth of the tolerance counts otherwise: {wrong} of {tried}")


def computed(explorer: explore_numbers.Explorer) -> np.ndarray:
    """CPU times [ms] of answers in this process, each slider being moved anywhere in turn."""
    rng, found, settings = np.random.default_rng(1), [], explorer.setup.start
    ends = explore_view.ends(explorer.setup)
    names = [name for name in ends if name not in ("x", "y", "height", "rate")]
    for i in range(ANSWERS):
        name = names[i % len(names)]
        low, high, _ = ends[name]
        logarithmic = name in explore_view.LOGARITHMIC
        value = float(np.exp(rng.uniform(np.log(low), np.log(high))) if logarithmic else rng.uniform(low, high))
        settings = replace(settings, **{name: value})
        begin = time.thread_time()
        _, hit = explorer.answer(settings)
        middle = time.thread_time()
        explorer.rest_of(settings, hit)
        found.append((middle - begin, time.thread_time() - begin))
    return 1e3 * np.array(found)


def main(scene: str, browser: bool = True) -> None:
    """Measure without a browser, then serve the scene, move every slider and print the response times."""
    parts, explorer = (50.0, 90.0, 99.0, 100.0), opened(scene)
    maps(explorer)
    for what, times in zip(("force and numbers", "everything"), computed(explorer).T):
        said = ", ".join(f"{part:g} %: {value:.1f}" for part, value in zip(parts, np.percentile(times, parts)))
        print(f"CPU time until {what} [ms], {ANSWERS} moves: {said}")
    if browser:
        served(scene)


def served(scene: str) -> None:
    """Serve the scene, move every slider in a browser and print the response times."""
    command = [sys.executable, "-m", "fem_impact", "explore", scene, "--no-open"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    address = server.stdout.readline().split()[0]
    try:
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
            page = browser.new_page(viewport={"width": 1280, "height": 1000})
            begin = time.perf_counter()
            page.goto(address)
            page.wait_for_selector("html[data-judged]", timeout=600_000)
            print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
            print(f"first exact blow after {time.perf_counter() - begin:.1f} s")
            zoomed(page)  # first, because a map takes longer once the contact loses energy
            moved(page, scene)
            browser.close()
    finally:
        server.send_signal(signal.SIGINT)
        server.wait()


def moved(page: Any, scene: str) -> None:
    """Print how long each slider takes."""
    print(f"[ms] of {TURNS} moves, {Path(scene).stem}{'force and numbers':>27}{'everything':>24}")
    print(f"{'':<12}" + 2 * f"{'least':>8}{'median':>8}{'most':>8}")
    whole: list[list[float]] = []
    for name in explore_view.SLIDERS:
        times = [page.evaluate(TURN, name) for _ in range(TURNS)]
        if times[0] is None:
            continue
        whole += times
        print(f"{name:<12}" + "".join(f"{f(part):8.0f}" for part in zip(*times) for f in (min, np.median, max)))
    print(f"{'all':<12}" + "".join(f"{f(part):8.0f}" for part in zip(*whole) for f in (min, np.median, max)))


def zoomed(page: Any) -> None:
    """Print how long a new part of the map takes, by the number of its points along the mass."""
    rng, found = np.random.default_rng(2), []
    whole = "JSON.parse(document.documentElement.dataset.map ?? '[[]]')[0][0]"
    while page.evaluate(whole) is None:
        page.wait_for_timeout(100)
    least = page.evaluate(whole)
    for _ in range(ZOOMS):
        x, y = rng.uniform(0.2, 0.6), rng.uniform(0.05, 0.45)
        found.append(page.evaluate(ZOOM, [x, y, x + 0.3, y + 0.35]))
        page.click("#whole")
        while page.evaluate(whole) != least:
            page.wait_for_timeout(100)
    for stage in found[0]:
        times = [one[stage] for one in found if stage in one]
        best, median, most = (f(times) for f in (min, np.median, max))
        print(f"zoom, {stage}: least {best:.0f}, median {median:.0f}, most {most:.0f} ms")


if __name__ == "__main__":
    parser = shared.parser(__doc__)
    parser.add_argument("scenes", nargs="*", default=[str(shared.SCENES / "drumstick.toml")])
    parser.add_argument("--no-browser", action="store_true")
    wanted = parser.parse_args()
    for one in wanted.scenes:
        main(one, not wanted.no_browser)
