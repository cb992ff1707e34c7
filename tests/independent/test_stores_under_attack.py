"""Stores whose chunks are lost, swapped, damaged or those of other maps give the bits of an undisturbed run."""

import itertools
import shutil
import subprocess
import sys

import numpy as np
import pytest

import fem_impact as fi
from fem_impact._base import identity
from fem_impact.sweeps import store
from fem_impact.sweeps.store import Store

pytest.importorskip("zarr", reason="stores are an extra: fem-impact[cluster]")

FAST, SLOW = 3, 60  # attacks on each kind of store
PROCESSES = 3  # that open one new store at the same time
PLATE = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40)
LAW = fi.Contact.linear(1e5)


def sweep(store, over, speed=1.0, **wanted):
    place = {"at": (0.465, 0.3), "speed": speed, "over": over, "store": store}
    return fi.sweep(PLATE, fi.Striker.stick(0.1, 10e3), LAW, **place, **wanted)


def together(store, speed=1.0):
    """Blocks of many cells, the last one of fewer."""
    return sweep(store, {"mass": np.linspace(0.01, 0.2, 17), "stiffness": np.geomspace(1e4, 1e6, 19)}, speed)


def picky(hit):
    if hit.n_impacts > 1:
        raise fi.SimulationError(f"{hit.n_impacts} impacts: zu viele für é")
    return hit.peak_force


def alone(store, speed=1.0):
    """Cells struck one by one, some of which fail."""
    return sweep(store, {"mass": np.geomspace(0.01, 0.4, 12)}, speed, layers={"picky": picky})


def spread(store, speed=1.0):
    """Blows that share no grid."""
    vary = {"striker.mass": ("lognormal", 0.1, 0.2), "contact.stiffness": ("lognormal", 1e5, 0.3)}
    place = {"at": (0.465, 0.3), "speed": speed, "n": 200, "sobol": False, "store": store}
    return fi.spread(PLATE, vary, fi.Striker.rigid(0.1), LAW, **place).table


MAPS = {"together": together, "alone": alone, "spread": spread}


@pytest.fixture(scope="module", params=MAPS)
def kept(request, tmp_path_factory):
    """A map, its result without a store, its store, one of another blow and one of another version of the program."""
    folder, make = tmp_path_factory.mktemp("kept"), MAPS[request.param]
    with pytest.MonkeyPatch.context() as few:
        few.setattr(store, "BLOCKS", 8)
        make(folder / "whole")
        make(folder / "other", speed=1.1)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(identity, "program", lambda: "0" * 64)
            make(folder / "older")
        yield make, make(None), folder


def assert_same_bits(table, expected):
    assert set(table.variables) == set(expected.variables)
    for name in table.variables:
        one, two = (np.asarray(each[name]) for each in (table, expected))
        assert one.dtype == two.dtype and one.tobytes() == two.tobytes(), name


def chunks(folder, block):
    """Files of one block, by array; that of error texts need not exist."""
    names = f"numbers/c/0/{block}", f"failures/c/{block}/0", f"done/c/{block}"
    return [folder / name for name in names]


def attack(rng, folder, foreign):
    """Do one thing to one block or two; what it was."""
    blocks = sorted(path.name for path in (folder / "done" / "c").iterdir())
    one, two = rng.choice(blocks, 2, replace=False).tolist()
    some = np.flatnonzero(rng.random(3) < 0.5)
    some = some if some.size else [int(rng.integers(3))]
    kind = str(rng.choice(["lost", "swapped", "foreign", "damaged"]))
    for i in some:
        mine, others = chunks(folder, one)[i], chunks(folder, two)[i]
        if kind == "foreign":
            copied(chunks(foreign, one)[i], mine)
        elif kind == "swapped":
            copied(mine, folder.parent / "aside")
            copied(others, mine)
            copied(folder.parent / "aside", others)
        elif kind == "lost" or not mine.exists():
            mine.unlink(missing_ok=True)
        else:
            mine.write_bytes(damaged(rng, mine.read_bytes()))
    return f"{kind} {one} {two} {list(some)}"


def copied(source, place):
    """Copy a file, or that there is none."""
    place.parent.mkdir(parents=True, exist_ok=True)
    place.unlink(missing_ok=True)
    if source.exists():
        shutil.copy(source, place)


def damaged(rng, content):
    place = int(rng.integers(len(content)))
    flipped = bytes([content[place] ^ 1 << int(rng.integers(8))])
    return [
        content[:place] + flipped + content[place + 1 :], content[:place], b"", content + b"x", rng.bytes(len(content)),
    ][int(rng.integers(5))]  # fmt: skip


def attacked(kept, folder, seeds):
    make, expected, stores = kept
    for seed in seeds:
        rng, mine = np.random.default_rng(seed), folder / "map"
        shutil.copytree(stores / "whole", mine)
        what = [attack(rng, mine, stores / str(rng.choice(["other", "older"]))) for _ in range(rng.integers(1, 4))]
        try:
            assert_same_bits(make(mine), expected)
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(Store, "write", None)  # healed: nothing is computed again
                assert_same_bits(make(mine), expected)
        except Exception as error:
            raise AssertionError(f"seed {seed}: {what}") from error
        shutil.rmtree(mine)


def test_attacked_stores_give_the_bits_of_an_undisturbed_run(kept, tmp_path):
    attacked(kept, tmp_path, range(FAST))


@pytest.mark.slow
def test_more_attacked_stores_give_the_bits_of_an_undisturbed_run(kept, tmp_path):
    attacked(kept, tmp_path, range(FAST, FAST + SLOW))


def test_whole_stores_of_others_are_refused(kept, tmp_path):
    make, _, stores = kept
    for foreign, told in (("other", "other bodies, axes or tolerance"), ("older", "another version of this program")):
        shutil.copytree(stores / foreign, tmp_path / foreign)
        with pytest.raises(ValueError, match=rf"store holds another map \(.*{told}"):
            make(tmp_path / foreign)


@pytest.mark.slow
def test_a_run_stopped_anywhere_goes_on_with_the_same_bits(kept, tmp_path):
    make, expected, _ = kept
    rng, write = np.random.default_rng(0), Store.write

    def until(steps):
        left = itertools.count(steps, -1)

        def stopped(self, *block):
            if next(left) == 0:
                raise KeyboardInterrupt
            return write(self, *block)

        return stopped

    for _ in range(8):
        with pytest.MonkeyPatch.context() as patch:
            for _ in range(3):
                patch.setattr(Store, "write", until(int(rng.integers(3))))
                with pytest.raises(KeyboardInterrupt):
                    make(tmp_path / "map")
        assert_same_bits(make(tmp_path / "map"), expected)
        shutil.rmtree(tmp_path / "map")


SCRIPT = """
import sys
sys.path[:0] = {path!r}
import test_stores_under_attack as attack
print("ready", flush=True)
for line in sys.stdin:
    attack.MAPS[{name!r}](line.strip()).to_netcdf(line.strip() + {end!r}, engine="scipy")
    print("done", flush=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["together", "alone"])
def test_processes_that_open_one_new_store_together_all_finish_it(name, tmp_path):
    import xarray

    path, expected, running = [p for p in sys.path if p], MAPS[name](None), []
    for i in range(PROCESSES):
        code = SCRIPT.format(path=path, name=name, end=f"-{i}.nc")
        command = [sys.executable, "-c", code]
        running.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
    try:
        assert [process.stdout.readline() for process in running] == ["ready\n"] * PROCESSES
        for turn in range(6):
            for process in running:
                process.stdin.write(f"{tmp_path / str(turn)}\n")
                process.stdin.flush()
            assert [process.stdout.readline() for process in running] == ["done\n"] * PROCESSES
            for i in range(PROCESSES):
                with xarray.open_dataset(tmp_path / f"{turn}-{i}.nc") as table:
                    assert_same_numbers(table, expected)
        assert sorted(each.name for each in tmp_path.iterdir() if each.is_dir()) == list("012345")  # nothing left over
    finally:
        for process in running:
            process.kill()
            process.communicate()


def assert_same_numbers(table, expected):
    for name in ("n_impacts", "contact_time", "restitution", "impulse", "peak_force", "error"):
        np.testing.assert_array_equal(table[name], expected[name])
