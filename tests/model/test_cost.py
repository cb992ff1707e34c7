"""Predicted cost grows with the size of a model, fits this machine, and never depends on a file."""

import json
import time
from dataclasses import replace

import pytest
from numpy.testing import assert_allclose
from scenes import SHIPPED

import fem_impact as fi
from fem_impact.impact import engine
from fem_impact.impact.compiled import build
from fem_impact.model import cost, planner
from fem_impact.model.target import Target

SLOW = cost.Machine(*(2.0 * value for value in (cost.REFERENCE.sparse, cost.REFERENCE.dense, cost.REFERENCE.steps)))
MUCH = cost.Work(sparse=10.0, dense=1.0, steps=1.0)


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """A file of its own for every test; what the process has read is forgotten before and after."""
    path = tmp_path / "kernels" / "speed.json"
    monkeypatch.setattr(cost, "machine_file", lambda: path)
    cost.this_machine.cache_clear()
    yield path
    cost.this_machine.cache_clear()


@pytest.fixture
def benchmarks(monkeypatch):
    """Counts the benchmarks, which say SLOW."""
    made = []
    monkeypatch.setattr(cost, "benchmark", lambda: made.append(1) or SLOW)
    return made


@pytest.mark.parametrize(
    ("work", "sizes"),
    [
        (cost.strikes, ((100.0, 50), (200.0, 50), (200.0, 100))),
        (cost.by_modes, ((3e3, 20), (6e3, 20), (6e3, 40))),
        (lambda n, _: cost.compliance(n), ((4e3, 0), (8e3, 0), (9e3, 0))),
        (lambda n, k: cost.by_vectors([n, 3e3], k), ((4e3, 80), (8e3, 80), (8e3, 160))),
        (
            lambda n, lasts: cost.by_vectors([n, 3e3], cost.grown_number(80, lasts)),
            ((4e3, 1.0), (8e3, 1.0), (8e3, 20.0)),
        ),
    ],
)
def test_more_of_anything_costs_more_time_and_no_less_memory(work, sizes):
    found = [work(*size) for size in sizes]
    times, memories = [each.on(cost.REFERENCE) for each in found], [each.memory for each in found]
    assert times == sorted(set(times)) and memories == sorted(memories)


def test_the_time_of_a_finer_mesh_grows_faster_than_its_unknowns():
    one, four = (cost.by_modes(n, 50).on(cost.REFERENCE) for n in (1e4, 4e4))
    assert 4.0 < four / one < 8.0  # between a solution per unknown and a factorisation, n**1.5
    assert MUCH.on(SLOW) == pytest.approx(2.0 * MUCH.on(cost.REFERENCE))
    assert replace(MUCH, steps=5.0).on(replace(cost.REFERENCE, steps=SLOW.steps)) == pytest.approx(10.0 + 1.0 + 10.0)


def test_many_first_vectors_become_more_and_each_costs_more():
    """The plate of `frontier.py` at 1e-6 begins with 302 vectors, ends with 592 and takes four times as long."""
    meshes = [6676, 4591]
    few, many = (cost.by_vectors(meshes, cost.grown_number(n, 1.0)).on(cost.REFERENCE) for n in (120, 302))
    assert many > 2.5 * few  # 302 vectors that do not grow would cost 2.1 times as much as 120
    assert (
        cost.by_vectors(meshes, cost.grown_number(60, 1.0)).on(cost.REFERENCE) > 0.5 * few
    )  # those that are enough stay


@pytest.fixture
def counted(monkeypatch):
    """The unknowns and vectors of which plans count the cost."""
    told, cost_of = [], cost.by_vectors
    monkeypatch.setattr(cost, "by_vectors", lambda *these: told.append(these) or cost_of(*these))
    return told


@pytest.mark.parametrize(("name", "meshes", "vectors"), [
    ("guitar_fingernail", (32750, 29191), 84),  # a mesh file, domed, with bars
    ("cymbal_ride_20_oak", (34989, 21724), 118),  # three impacts, which of a curved plate nobody foresees
    ("drumstick", (1898, 1423), 116),
    # the stick stays for fourteen undisturbed contacts
    pytest.param("cymbal_splash_10_maple", (25813, 16503), 165, marks=pytest.mark.slow),
    pytest.param("hammer_car_bonnet", (39445, 36264), 84, marks=pytest.mark.slow),
])  # fmt: skip
def test_the_plan_counts_the_unknowns_and_vectors_that_its_run_has(name, meshes, vectors, counted):
    """Those of the runs are written down, as counted there; a longer blow may need two steps of 1.4 more, or none."""
    fi.load_scene(next(SHIPPED.rglob(f"{name}.toml"))).plan()
    unknowns, most = counted[0]
    assert_allclose(unknowns, meshes, rtol=0.02)  # 1 %, and what splitting at ribs adds
    assert vectors / 2.0 <= most <= 1.7 * vectors  # two steps of growth, rounded


def test_a_plan_of_bodies_pressed_together_counts_the_steps_that_they_may_take(monkeypatch):
    plate = fi.analytic.rectangle(0.4, 0.3, mass=3.24, first_frequency=411.0, n_modes=20, damping_ratio=0.03)
    how = {"at": (0.13, 0.1), "speed": 0.3, "tolerance": 1e-2, "striker_force": 1.0, "duration": 1.0}
    plan = fi.plan(plate, fi.Striker.rigid(0.038), fi.Contact.hertz(6e8), **how)
    steps, run = [], engine.run_system
    monkeypatch.setattr(engine, "run_system", lambda *args, **how: steps.append(run(*args, **how)) or steps[-1])
    plan.run()
    taken = cost.strikes(sum(len(each.steps) for each in steps) / 20.0, 20).seconds
    assert taken < plan.seconds < 10.0 * taken  # steps that agree at once
    assert plan.but(striker_force=0.0).seconds < 0.3 * taken


def sheet(length, width, at, speed, thickness=0.6e-3, radius=4.955e-3):
    """The plan for a ball, of 4 g, on a free sheet of steel, 0.6 mm thick, which stops it until echoes come back."""
    steel = fi.Material(E=210e9, nu=0.3, rho=7850.0)
    body = fi.assemble(fi.mesh.rectangle(length, width), fi.Plate(steel, thickness), {"boundary": "free"})
    ball = fi.Striker.sphere(steel, radius)
    return fi.plan(body, ball, fi.Contact.between(ball, steel), at=at, speed=speed, tolerance=1e-2)


@pytest.mark.parametrize(("size", "at", "speed", "vectors", "n_meshes"), [
    ((0.15, 0.1), (0.0555, 0.041), 1.0, 508, 3), ((0.2, 0.15), (0.074, 0.0615), 0.2, 1240, 3),
    ((0.2, 0.15), (0.02, 0.075), 0.2, 165, 2),  # the echo finds the ball still pressing
])  # fmt: skip
def test_a_ball_that_a_sheet_stops_needs_vectors_until_the_echo_has_gone(size, at, speed, vectors, n_meshes, counted):
    plan = sheet(*size, at, speed)
    unknowns, most = counted[0]
    assert plan.target == "vectors" and len(unknowns) == n_meshes
    assert vectors / 2.0 <= most <= 1.7 * vectors  # those of the runs are written down
    assert 84 <= plan.n_modes <= 0.7 * most  # begins with fewer, but not with an echo that only they make


@pytest.mark.parametrize(
    ("at", "vectors"),
    [
        ((0.0, 0.0), 1240),
        ((0.0, 0.13), 834),
        ((0.13, 0.1), 231),
        ((0.0, 0.03), 452),
    ],
)
def test_a_ball_that_only_the_edge_of_a_plate_stops_needs_vectors_for_the_echoes_of_the_others(at, vectors, counted):
    sheet(0.4, 0.3, at, 1.0, 3e-3, 0.01)
    unknowns, most = counted[0]
    assert len(unknowns) == (3 if 0.0 in at else 2)
    assert vectors / 3.5 <= most <= 1.7 * vectors  # those of the runs are written down


RECTANGLE, DISK = (fi.mesh.rectangle(0.465, 0.3), "boundary"), (fi.mesh.disk(0.2), "outer")


@pytest.mark.parametrize(("body", "mass", "contact", "at", "speed", "tolerance", "vectors", "unknowns"), [
    (RECTANGLE, 0.168, fi.Contact.linear(5.775e5), (0.119, 0.163), 6.7, 1.09e-4, 1180, 41022),
    (RECTANGLE, 0.159, fi.Contact.linear(5.943e5), (0.049, 0.084), 4.85, 1.38e-4, 589, 18807),
    (RECTANGLE, 0.0214, fi.Contact.hertz(3.298e7), (0.389, 0.197), 9.36, 2.13e-4, 538, 12696),
    (DISK, 0.145, fi.Contact.linear(1.656e5), (0.023, -0.059), 0.102, 4.6e-6, 1077, 42931),
])  # fmt: skip
def test_a_striker_that_the_edges_throw_off_needs_vectors_for_all_modes_while_it_rattles(
    body, mass, contact, at, speed, tolerance, vectors, unknowns, counted
):  # fmt: skip
    """Begun with some 200 vectors and 5 000 unknowns, the runs end with those written down."""
    (mesh, edge), wood = body, fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), 3e-3)
    target = Target(mesh, wood, {edge: "hinged"}, scale={"mass": 0.2, "first_frequency": 100.0}, source="fe")
    blow = {"at": at, "speed": speed, "tolerance": tolerance}
    planner.Blow(target, fi.Striker.rigid(mass), contact, blow).plan()
    found, most = counted[0]
    assert vectors / 1.5 <= most <= 1.5 * vectors and unknowns / 1.5 <= found[0] <= 1.5 * unknowns


@pytest.mark.parametrize(("loss", "vectors"), [(1.0, 85), (1e2, 1210), (1e4, 606)])
def test_a_striker_that_a_lossy_contact_holds_needs_vectors_while_it_rattles(loss, vectors, counted):
    """Of 30 g at 1 m/s; the vectors of the runs are written down, which begin with 85."""
    wood = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), 3e-3)
    body = fi.assemble(fi.mesh.rectangle(0.465, 0.3), wood, {"boundary": "hinged"})
    contact = fi.Contact.hertz(1e6, loss=loss)
    fi.plan(body, fi.Striker.rigid(0.03), contact, at=(0.2, 0.11), speed=1.0, tolerance=1e-3)
    assert vectors / 3.0 <= counted[0][1] <= 1.5 * vectors


def test_a_plan_of_both_ways_counts_all_frequencies_that_echoes_may_ask_for(counted):
    plan = sheet(0.2, 0.15, (0.074, 0.0615), 1.0)
    assert plan.target == "mixed"
    assert [count for _, count in counted[:3]] == [255, 480, 929]  # as its run has; it refuses the fourth
    assert plan.seconds > sum(cost.by_vectors(*told).seconds for told in counted[:3])


def test_what_doctor_kept_of_this_machine_serves_every_later_process(place, benchmarks):
    assert (
        MUCH.seconds == pytest.approx(12.0) and "typical" in cost.machine_in_words()
    )  # without a file nothing is measured
    assert not benchmarks and not place.exists()
    cost.this_machine.cache_clear()
    assert cost.calibrate() and len(benchmarks) == 1
    assert MUCH.seconds == pytest.approx(24.0) and cost.machine_in_words() == "this machine" and len(benchmarks) == 1


DAMAGED = {
    "empty": b"", "no text": b"\xff\xfe", "list": b"[1]", "null": b"null", "short": b'{"sparse": 1}',
    "no number": b'{"sparse": [], "dense": 1, "steps": 1}', "deep": b"[" * 99999, "other kernels": {"stamp": "other"},
    **{f"dense of {value}": {"dense": value} for value in (1e9, 0.0, float("nan"))},
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_file_other_kernels_and_impossible_numbers_do_not_count_and_are_replaced(place, benchmarks, damage):
    assert cost.keep_machine(SLOW) and cost.read_machine() == SLOW
    place.write_bytes(
        damage if isinstance(damage, bytes) else json.dumps(json.loads(place.read_text()) | damage).encode()
    )
    assert cost.read_machine() is None
    assert cost.calibrate() and cost.read_machine() == SLOW


def test_doctor_says_where_nothing_can_be_kept(place, benchmarks, monkeypatch):
    place.parent.write_text("a file where the folder should be")
    assert not cost.calibrate()
    del benchmarks[:]
    monkeypatch.setattr(cost, "machine_file", lambda: None)  # without compiled kernels nothing is measured either
    assert pytest.approx(12.0) == MUCH.seconds and cost.calibrate()
    assert cost.read_machine() is None and not cost.keep_machine(SLOW) and not benchmarks


def test_a_disturbed_benchmark_is_not_believed(place, monkeypatch):
    monkeypatch.setattr(cost, "benchmark", lambda: replace(SLOW, steps=0.0))
    assert not cost.calibrate() and not place.exists()


@pytest.mark.slow
def test_a_thick_plate_is_counted_on_the_second_meshes_that_tell_its_errors():
    """Of its modes and of its compliance; a plan that has found all it needs counts nothing of either again."""
    steel = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 0.005)
    body = fi.assemble(fi.mesh.rectangle(0.3, 0.2), steel, {"boundary": "hinged"}, theory="mindlin")
    blow = {"at": (0.12, 0.09), "speed": 1.0, "tolerance": 1e-2}
    hard, soft = (fi.plan(body, fi.Striker.rigid(0.02), fi.Contact.hertz(k), **blow) for k in (3e8, 1e5))
    assert hard.n_modes > 20 and soft.n_modes == 20
    modes = cost.by_modes(hard.n_dofs, hard.n_modes) + cost.compliance(hard.n_dofs)
    assert 2.5 * modes.seconds < hard.seconds < 6.0 * modes.seconds  # 2.25 times finer for compliance, and the blow
    assert soft.seconds < 0.1


def test_the_result_lies_beside_the_kernels(monkeypatch):
    monkeypatch.undo()
    if not build.COMPILED:
        assert cost.machine_file() is None
        return
    assert cost.machine_file().parent == build.folder(cost.follow)


@pytest.mark.skipif(not build.COMPILED, reason="the benchmark is for compiled kernels")
def test_the_benchmark_finds_a_machine_that_people_use():
    assert cost.benchmark().credible  # within a factor of twenty of REFERENCE


@pytest.mark.skipif(not build.COMPILED, reason="the benchmark is for compiled kernels")
@pytest.mark.parametrize("name", ["marked_linear", "drumstick"])
@pytest.mark.slow
def test_predicted_time_is_of_the_right_size(name):
    """On this machine, within four, not two as in `cost_predictions.py`: others double even the processor time."""
    assert cost.calibrate()
    cost.this_machine.cache_clear()
    scene = fi.load_scene(SHIPPED / f"{name}.toml")
    plan = scene.plan(tolerance=1e-2)
    start = time.process_time()
    run = plan.run()
    if plan.blow.moving:  # the modes that ring on are predicted, too, but found when asked for
        assert run.response.target.n_modes
    taken = time.process_time() - start
    assert taken / 4.0 < plan.seconds < 4.0 * taken


def test_the_memory_of_this_machine_is_no_more_than_the_limit_of_this_process(monkeypatch):
    if cost.resource is None:
        pytest.skip("Windows tells neither")
    free = cost.memory_installed()
    monkeypatch.setattr(cost.resource, "getrlimit", lambda _: (2**30, 2**30))
    assert cost.memory_installed() == 2**30 < free
