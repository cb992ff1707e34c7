"""Measures how quickly `fem-impact explore` answers: from a slider move in a browser to the new spectrum.

python studies/explore_speed.py [SCENE]; needs chromium, and playwright (pip install -e '.[test]')
"""

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

TURNS = 30  # moves of each slider
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


def main(scene: str) -> None:
    """Serve the scene, move every slider and print the response times."""
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
