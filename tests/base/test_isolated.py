"""A mesh file is read apart: what never ends, fills the memory or dies becomes one sentence."""

import os
import signal
import subprocess
import sys
import time

import h5py
import meshio
import numpy as np
import pytest

from fem_impact import mesh
from fem_impact._base import child, isolated

PLATE = mesh.rectangle(1.0, 1.0, size=0.5)


def written(path, **options):
    points = np.column_stack([PLATE.points, np.zeros(len(PLATE.points))])
    meshio.Mesh(points, [("triangle", PLATE.cells)]).write(path, **options)
    return path


def test_reader_that_never_ends_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(isolated, "PATIENCE", 1.0)
    path = tmp_path / "plate.mdpa"  # meshio looks for the end of a block beyond the end of the file
    path.write_text("Begin Nodes\n 1 0 0 0\n")
    said = r"plate\.mdpa cannot be read as a mesh \(reading took longer than 1 s; export it again"
    with pytest.raises(ValueError, match=said):
        mesh.load(path)
    monkeypatch.undo()
    assert len(mesh.load(written(tmp_path / "again.vtu")).cells) == len(PLATE.cells)  # exported again, another format


def test_reader_that_only_waits_is_stopped_by_the_clock(tmp_path, monkeypatch):
    monkeypatch.setattr(isolated, "WAITING", 1e-3)  # 8 ms, in which no process starts
    with pytest.raises(ValueError, match=r"plate\.vtu cannot be read as a mesh \(reading took longer"):
        mesh.load(written(tmp_path / "plate.vtu"))


@pytest.mark.slow
def test_reader_that_a_busy_machine_delays_ends(tmp_path, monkeypatch):
    """It is stopped for longer than its limit, as a process that gets no turn, and still reads the file."""

    def delayed(target, *words, timeout, **variables):
        command, environment = child.python(target, *words, **variables)
        process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        process.send_signal(signal.SIGSTOP)
        time.sleep(1.1 * isolated.PATIENCE)
        process.send_signal(signal.SIGCONT)
        out, said = process.communicate(timeout=timeout)
        return subprocess.CompletedProcess(command, process.returncode, out, said)

    monkeypatch.setattr(child, "run_function", delayed)
    monkeypatch.setattr(isolated, "PATIENCE", 4.0)
    assert len(mesh.load(written(tmp_path / "plate.vtu")).cells) == len(PLATE.cells)


PLY = (
    "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\nproperty double x\nproperty double y\n"
    "property double z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
)


@pytest.mark.parametrize(("name", "text", "said"), [
    ("plate.ply", PLY, "cannot be read as a mesh"),  # claims more than the memory
    ("plate.xyz", "1", r".*its ending is '\.xyz', but meshio reads .*\.vtu"),
])  # fmt: skip
def test_text_that_is_no_mesh_is_refused(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=f"{name.replace('.', '[.]')} {said}"):
        mesh.load(tmp_path / name)


@pytest.mark.parametrize("status", [2, -6])
def test_reader_that_dies_or_fills_the_memory_is_a_sentence(tmp_path, monkeypatch, status):
    monkeypatch.setattr(isolated, "run_reader", lambda path, reader, arguments, patience: (status, b"", b""))
    (tmp_path / "plate.msh").write_text("any")
    with pytest.raises(ValueError, match=r"plate\.msh cannot be read as a mesh \(.* crashed or exceeded 2 GB\)"):
        mesh.load(tmp_path / "plate.msh")


@pytest.mark.parametrize(("name", "size"), [("plate.msh", 0), ("plate.vtu", 2**31), ("plate.svg", 2**31)])
def test_holes_are_not_parsed(tmp_path, name, size):
    with (tmp_path / name).open("wb") as file:
        file.truncate(size)
    with pytest.raises(ValueError, match=rf"{name.replace('.', '[.]')} .*(begins with zeros only|empty)"):
        isolated.read_apart(tmp_path / name, "a mesh", "mesh.meshio_reader:read")


@pytest.mark.parametrize("reader", ["mesh.meshio_reader:arrays", "mesh.drawings:svg_arrays"])
def test_the_process_that_reads_loads_no_mesher_and_no_solver(reader):
    module = reader.split(":")[0]  # each new process would take three times as long
    code = f"import sys, fem_impact._base.isolated, fem_impact.{module}\nprint(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"scipy", "netgen", "skfem", "numba", "fem_impact.mesh.meshes"} & set(loaded)


def test_file_that_unpacks_to_more_than_the_memory_is_refused(tmp_path):
    path = written(tmp_path / "plate.med")
    with h5py.File(path, "r+") as file:
        nodes = next(group for name, group in file["ENS_MAA/mesh"].items())["NOE"]
        del nodes["COO"]
        coordinates = nodes.create_dataset("COO", (3 * 10**9,), "f8", chunks=(2**20,), compression="gzip")
        coordinates.attrs["NBR"] = 10**9
    assert path.stat().st_size < 100_000
    with pytest.raises(ValueError, match=r"plate\.med cannot be read as a mesh \(.* crashed or exceeded 2 GB\)"):
        mesh.load(path)


def test_a_mesh_may_include_what_lies_beside_it_and_a_link_to_a_mesh_elsewhere_is_followed(tmp_path, read_here):
    written(tmp_path / "part.inp")
    (tmp_path / "whole.inp").write_text("*INCLUDE, INPUT=part.inp\n")
    assert mesh.load(tmp_path / "whole.inp").area == pytest.approx(1.0)
    (tmp_path / "in").mkdir()
    written(tmp_path / "plate.vtu")
    os.symlink(tmp_path / "plate.vtu", tmp_path / "in" / "link.vtu")
    assert mesh.load(tmp_path / "in" / "link.vtu").area == pytest.approx(1.0)


@pytest.mark.parametrize("how", ["link", "raw", "xdmf"])
def test_hdf5_that_looks_into_other_files_is_refused(tmp_path, how):
    (tmp_path / "in").mkdir()
    path = written(tmp_path / "in" / "plate.med")
    (tmp_path / "secret.bin").write_bytes(np.arange(27.0).tobytes())
    if how == "xdmf":
        path = written(tmp_path / "in" / "plate.xdmf")
        os.rename(tmp_path / "in" / "plate.h5", tmp_path / "plate.h5")
        path.write_text(path.read_text().replace("plate.h5:", "../plate.h5:"))
    else:
        with h5py.File(path, "r+") as file:
            if how == "link":
                file["stray"] = h5py.ExternalLink(str(tmp_path / "secret.h5"), "/x")
            else:
                file.create_dataset("stray", (27,), "f8", external=[(str(tmp_path / "secret.bin"), 0, 216)])
    with pytest.raises(ValueError, match=r"refers to a file outside its folder|links to another|stores its data in"):
        mesh.load(path)


def test_every_format_that_hdf5_holds_is_read(tmp_path, read_here):
    known = h5py.File
    for path in [written(tmp_path / name) for name in ("plate.med", "plate.h5m", "plate.xdmf")]:
        assert mesh.load(path).area == pytest.approx(1.0)
        assert h5py.File is known


@pytest.mark.parametrize("kind", ["pipe", "loop"])
def test_what_is_no_file_is_told_at_once(tmp_path, kind):
    path = tmp_path / "plate.msh"
    os.mkfifo(path) if kind == "pipe" else os.symlink(path, path)
    with pytest.raises(ValueError, match=r"plate\.msh"):
        mesh.load(path)
