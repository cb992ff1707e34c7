"""Maps in a store and on a cluster: resumed after any end, nothing lost, nothing computed twice."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import xarray
from scenes import SHIPPED

import fem_impact as fi
from fem_impact._base import identity
from fem_impact.sweeps import cases, cells, store
from fem_impact.sweeps.store import Store

pytest.importorskip("zarr", reason="the cluster extra is not installed")
distributed = pytest.importorskip("distributed", reason="the cluster extra is not installed")

AT = (0.465, 0.3)
OVER = {"mass": np.linspace(0.01, 0.2, 16), "stiffness": np.geomspace(1e4, 1e6, 20)}


def sweep(**wanted):
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40)
    bodies, how = (plate, fi.Striker.stick(0.1, 10e3), fi.Contact.linear(1e5)), {"at": AT, "speed": 1.0, "over": OVER}
    return fi.sweep(*bodies, **how | wanted)


def assert_same(table, expected, rtol=0.0):
    """Equal bit by bit; cells struck alone on a cluster, on bodies sampled at the strike point, differ by rounding."""
    assert table.attrs == expected.attrs
    for name in ("n_impacts", "failure"):
        np.testing.assert_array_equal(table[name], expected[name])
    for name in ("contact_time", "restitution", "impulse", "peak_force"):
        np.testing.assert_allclose(table[name], expected[name], rtol=rtol)


@pytest.fixture(scope="module")
def undisturbed():
    return sweep()


def test_a_store_of_another_map_or_version_is_refused(tmp_path, monkeypatch):
    sweep(over={"mass": [0.1]}, store=tmp_path / "map")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(ValueError, match="store must be a new folder"):
        sweep(store=tmp_path / "mine")
    mark = json.loads((tmp_path / "map" / "zarr.json").read_text())["attributes"]
    assert Store(tmp_path / "map", mark, 8, 1).read(0) is not None
    monkeypatch.setattr(identity, "program", lambda: "other")
    with pytest.raises(ValueError, match=r"store holds another map \(made by another version of this program"):
        sweep(over={"mass": [0.1]}, store=tmp_path / "map")
    told = "client: a worker runs another version of this program; install the same one everywhere"
    with pytest.raises(ValueError, match=told):
        Store(tmp_path / "map", mark, 8, 1)


def test_maps_whose_axes_come_in_another_order_have_stores_of_their_own():
    """Their cells, numbered along the axes, are others; both have as many."""
    axes = {"mass": np.array([0.1, 0.2]), "speed": np.array([0.5, 1.0])}
    body = fi.analytic.beam(1.0, ends=("hinged", "hinged"), mass=1.0, first_frequency=50.0, n_modes=3)
    case = cells.Case(body, fi.Striker.rigid(0.1), fi.Contact.linear(1e5), np.array([0.3]), 1.0)
    orders = axes, dict(reversed(axes.items())), axes
    one, other, again = (store.fingerprint(cases.Cases(case, each, 1e-3))["map"] for each in orders)
    assert one == again != other


def test_bodies_that_differ_at_another_strike_point_have_maps_of_their_own():
    places, marks = np.array([[0.0], [1.0]]), []
    for at_its_end, yields in product((1.0, 2.0, 1.0), (3e-4, 4e-4)):
        known = {"points": places, "mass": 1.0, "compliance": np.diag([3e-5, yields])}
        body = fi.Modes.from_arrays([50.0], np.array([[1.0], [at_its_end]]), **known)
        case = cells.Case(body, fi.Striker.rigid(0.1), fi.Contact.linear(1e5), places[0], 1.0)
        marks.append(store.fingerprint(cases.Cases(case, {"at": places}, 1e-3))["map"])
    assert len(set(marks)) == 4 and marks[:2] == marks[4:]


def test_a_store_keeps_the_results_of_its_functions_only(tmp_path):
    def made(value):
        return {"over": {"mass": [0.1]}, "layers": {"q": lambda hit: value}, "store": tmp_path / "map"}

    assert sweep(**made(1.0)).q == sweep(**made(1.0)).q == 1.0  # another function, but the same
    with pytest.raises(ValueError, match=r"store holds another map \(other functions in layers\)"):
        sweep(**made(2.0))
    lines, wanted = (line for line in "ab"), {"over": {"mass": [0.1]}}
    told = r"layers: 'q' cannot be distinguished from other functions \(it uses an object of type builtins.generator\)"
    with pytest.raises(ValueError, match=told):
        sweep(layers={"q": lambda hit: len(next(lines))}, store=tmp_path / "other", **wanted)
    assert not (tmp_path / "other").exists()
    assert sweep(layers={"q": lambda hit: len(next(lines))}, **wanted).q == 1.0  # either advice helps
    assert sweep(layers={"q": lambda hit: len("a")}, store=tmp_path / "other", **wanted).q == 1.0


def test_of_two_that_create_a_store_at_once_the_second_goes_on_with_that_of_the_first(
    tmp_path, monkeypatch, undisturbed
):
    made, kept = store._made, []

    def slow(*arguments):
        """Makes a store while another process makes the same one, and fills it."""
        monkeypatch.setattr(store, "_made", made)
        assert_same(sweep(store=tmp_path / "map"), undisturbed)
        kept.append(_times(tmp_path / "map"))
        return made(*arguments)

    monkeypatch.setattr(store, "_made", slow)
    assert_same(sweep(store=tmp_path / "map"), undisturbed)
    assert [each.name for each in tmp_path.iterdir()] == ["map"]
    assert len(kept[0]) == 64 and _times(tmp_path / "map") == kept[0]  # nothing was wiped or computed again


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_local_cluster_gives_the_same_maps_and_spreads(tmp_path, undisturbed):
    settings = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0", "host": "127.0.0.1"}
    ranges = {"mass": {"from": 0.02, "to": 0.1}, "stiffness": {"from": 1e4, "to": 3e5, "scale": "log"}}
    fine = {"over": ranges, "cells": 40, "refine": True, "borders": True}
    few = {"over": {"mass": np.linspace(0.01, 0.2, 8)}}
    refined, expected = sweep(**fine), sweep(**few)
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40)
    vary = {"striker.mass": ("lognormal", 0.05, 0.2), "target.damping_ratio": ("uniform", 0.0, 0.02)}
    bodies, blow = (fi.Striker.rigid(0.05), fi.Contact.hertz(1e6)), {"at": AT, "speed": 1.0, "n": 64, "sobol": False}
    with distributed.LocalCluster(**settings) as cluster, distributed.Client(cluster) as client:
        assert_same(sweep(client=client), undisturbed)
        assert_same(sweep(client=client, store=tmp_path / "map"), undisturbed)
        far = sweep(client=cluster.scheduler_address, **fine)
        assert "interpolated" in far and np.array_equal(far.n_impacts, refined.n_impacts)
        for one, two in zip(fi.read_borders(far), fi.read_borders(refined), strict=True):
            np.testing.assert_allclose(one.points, two.points, rtol=1e-9)
        spread, near = fi.spread(plate, vary, *bodies, client=client, **blow), fi.spread(plate, vary, *bodies, **blow)
        np.testing.assert_allclose(spread.values("restitution"), near.values("restitution"), rtol=1e-9)
        for _ in range(10):  # at once again, while the scheduler forgets the last: data under one key failed in 4 of 10
            assert_same(sweep(client=client, **few), expected)
        sent, submit = [], client.submit
        client.submit = lambda *work, **how: sent.append(submit(*work, **how)) or sent[-1]
        with pytest.raises(OSError, match=r"client: the cluster dropped the map \(.*\); run it again"):
            sweep(client=client, layers={"slow": slowly}, watch=lambda *_: client.cancel(sent, force=True))


def slowly(hit):
    """A layer that takes long enough for a run to be stopped in the middle."""
    time.sleep(0.02)
    return hit.restitution


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def cluster(tmp_path):
    """A scheduler and two workers started as a user would, and their processes."""
    address = f"tcp://127.0.0.1:{free_port()}"
    dask = [sys.executable, "-m", "dask"]
    options = ["--no-dashboard", "--host", "127.0.0.1", "--port", address.rsplit(":", 1)[1]]
    running = {"scheduler": _start([*dask, "scheduler", *options], tmp_path)}
    for name in ("one", "two"):
        worker = [*dask, "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--name", name]
        running[name] = _start([*worker, "--local-directory", str(tmp_path / name)], tmp_path)
    try:
        with distributed.Client(address, timeout=300) as client:
            client.wait_for_workers(2, timeout=300)
        yield address, running
    finally:
        for process in running.values():
            process.kill()
            process.wait()


def _start(command, folder):
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _times(store):
    """When each finished block was written; a worker killed before its flag leaves numbers to be written again."""
    done = sorted(path.name for path in (store / "done" / "c").iterdir())
    return {path: path.stat().st_mtime_ns for path in (store / "numbers" / "c" / "0" / block for block in done)}


def _wait_for_blocks(store, count, patience=600.0):
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if (store / "zarr.json").exists():
            done = len([name for name in (store / "done" / "c").rglob("*") if name.is_file()])
            if done >= count:
                return
        time.sleep(0.05)
    pytest.fail(f"the run kept fewer than {count} blocks in {patience:g} s")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"codecs": [', '"codecs": [{"name": "zstd"},'),  # would unpack to any size
        ('"shape": [\n    8,\n    1\n', '"shape": [\n    8,\n    1000000000000\n'),
    ],
)
def test_damaged_store_is_told_not_trusted(tmp_path, old, new):
    sweep(over={"mass": [0.1]}, store=tmp_path / "map")
    meta = tmp_path / "map" / "numbers" / "zarr.json"
    assert old in meta.read_text()
    meta.write_text(meta.read_text().replace(old, new))
    with pytest.raises(ValueError, match=r"store .*map is damaged"):
        sweep(over={"mass": [0.1]}, store=tmp_path / "map")


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_map_at_the_prompt_survives_its_own_end(tmp_path, cluster):
    """As a user would: scheduler and workers in their own processes, the run killed in the middle, then once more."""
    address, running = cluster
    text = (SHIPPED / "drumstick_map.toml").read_text().replace("count = 20", "count = 12")
    text = text.replace('kind = "linear"', 'kind = "power"')
    # below exponent 1 every cell is a single blow
    (tmp_path / "map.toml").write_text(text.replace("88.6e3", "88.6e3\nexponent = 0.95"))
    command = [sys.executable, "-m", "fem_impact.cli", "map", "map.toml", "--out", "out", "--store", "kept"]
    run = _start([*command, "--cluster", address], tmp_path)
    _wait_for_blocks(tmp_path / "kept", 6)
    os.kill(running["one"].pid, signal.SIGKILL)
    _wait_for_blocks(tmp_path / "kept", 12)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    kept: dict[Path, int] = {}
    while not kept or kept != _times(tmp_path / "kept"):  # the other worker finishes what it has begun
        kept = _times(tmp_path / "kept")
        time.sleep(3.0)
    assert 12 <= len(kept) < 48
    again = subprocess.run([*command, "--cluster", address], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr
    assert "144 blows over stiffness (12), mass (12)" in again.stdout
    assert {path: path.stat().st_mtime_ns for path in kept} == kept  # nothing twice
    alone = [*command[:6], "whole"]
    subprocess.run(alone, cwd=tmp_path, capture_output=True, check=True)
    one, two = (xarray.load_dataset(tmp_path / name / "map.nc") for name in ("out", "whole"))
    assert_same(one, two, rtol=1e-9)
