"""Measures how quickly `fem-impact explore` answers: from a slider move in a browser to the new spectrum.

python studies/explore_speed.py [SCENE]; needs chromium, and playwright (pip install -e '.[test]')

First the CPU time that an answer takes without a browser, for sliders anywhere on their ways.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

import fem_impact as fi
from fem_impact.pages import explore_model, explore_view

TURNS = 30  # moves of each slider
ANSWERS = 300  # without a browser
FLAGS = ("--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-sync")
TURN = """name => new Promise(done => {
    const page = Bokeh.documents[0], slider = page.get_model_by_name(name);
    if (!slider) { done(null); return; }
    const signal = page.get_model_by_name('spectrum-data').properties.data.change;
    const said = page.get_model_by_name('said');
    const began = performance.now(), before = JSON.stringify(said.data.text);
    const then = () => {  // ignore the late answer to an earlier move
        if (JSON.stringify(said.data.text) === before) return;
        signal.disconnect(then);
        done(performance.now() - began);
    };
    signal.connect(then);
    slider.value += 0.005 * (slider.end - slider.start);
})"""


def computed(scene: str) -> np.ndarray:
    """CPU times [ms] of answers in this process, each slider being moved anywhere in turn."""
    from bokeh.document import Document

    bench = explore_model.Bench.of(fi.load_scene(scene))
    seen, rest = bench.seen(bench.start.at), bench.residual(bench.start)
    page, rng, found = explore_view.Page(Document(), bench), np.random.default_rng(1), []
    page.show()
    page.refined, page.seen, page.rest = bench.start.at, seen, rest
    names = [name for name in explore_view.LABELS if name in page.sliders]
    for i in range(ANSWERS):
        slider = page.sliders[names[i % len(names)]]
        page.sliders[names[i % len(names)]].value = float(rng.uniform(slider.start, slider.end))
        begin = time.thread_time()
        page.update()
        found.append(1e3 * (time.thread_time() - begin))
    page.pool.shutdown()
    return np.array(found)


def main(scene: str) -> None:
    """Serve the scene, move every slider and print the response times."""
    parts = (50.0, 90.0, 99.0, 100.0)
    taken = np.percentile(computed(scene), parts)
    said = ", ".join(f"{part:g} %: {value:.1f}" for part, value in zip(parts, taken))
    print(f"CPU time of an answer [ms], {ANSWERS} moves: {said}")
    command = [sys.executable, "-m", "fem_impact", "explore", scene, "--no-open"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    address = server.stdout.readline().split()[0]
    try:
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
            page = browser.new_page()
            page.goto(address)
            page.wait_for_selector("html[data-ready]")
            page.wait_for_timeout(2000)  # wait for the map
            print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
            print(f"{'slider':<12}{'least':>8}{'median':>8}{'most':>8}   [ms] of {TURNS} moves, {Path(scene).stem}")
            for name in ("mass", "stiffness", "exponent", "speed", "bending", "x", "y"):
                times = [page.evaluate(TURN, name) for _ in range(TURNS)]
                if times[0] is not None:
                    print(f"{name:<12}{min(times):8.0f}{np.median(times):8.0f}{max(times):8.0f}")
            browser.close()
    finally:
        server.send_signal(signal.SIGINT)
        server.wait()


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else str(Path(__file__).parent / "scenes" / "drumstick.toml"))
