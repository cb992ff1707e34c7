"""Long maps on one or many machines: each finished block of cells is saved in a Zarr store, so that runs can resume."""

import hashlib
import json
import math
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check

LARGEST_BLOCK = 2**17  # [-] cells computed together at most, to limit the memory to 30 MB: half a second of work
BLOCKS = 64  # [-] fewest blocks of a large map: a killed run loses at most one block per worker
TEXT = 240  # [byte] longer error texts are cut, because every cell has room for one
EXTRA = "pip install 'fem-impact[cluster]'"

Texts = dict[int, str]  # failed cell: error text
Solve = Callable[[Any, int, int], tuple[np.ndarray, Texts]]  # grid, start, stop: numbers (n_layers, n_cells), texts
Watch = Callable[[int, int], Any]


def block_size(n_cases: int) -> int:
    """Number of cells in a block."""
    return max(1, min(LARGEST_BLOCK, math.ceil(n_cases / BLOCKS)))


class Store:
    """Results of a map on disk, block by block; a block counts as done once its flag is set, which is written last.

    Parameters
    ----------
    path : folder, under the same path on every machine that works on the map
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with _needed("a store"):
            import zarr
        with _intact(path):
            self.group: Any = zarr.open_group(str(path), mode="r")
            attributes: Any = self.group.attrs
            self.n_cases: int = int(attributes["n_cases"])
            self.block: int = int(attributes["block"])
            fresh = _made(zarr, {}, self.n_layers, self.n_cases, self.block)
            for name in fresh:
                if self.group[name].metadata.to_dict() != fresh[name].metadata.to_dict():
                    raise ValueError(f"the array {name} has another shape, type or chunk size than this program writes")

    @property
    def n_layers(self) -> int:
        """Number of layers of each cell."""
        return int(self.group["numbers"].shape[0])

    @classmethod
    def open(cls, path: str | Path, grid: Any) -> "Store":
        """Open the store of a map, or create it; ValueError if the path holds anything else."""
        path = Path(path).resolve()
        with _needed("a store"):
            import zarr
        mark = fingerprint(grid)
        if path.exists() and any(path.iterdir()):
            if not (path / "zarr.json").exists():
                raise not_free(path)
            store = cls(path)
            if store.group.attrs.get("fingerprint") != mark:
                raise ValueError(
                    f"store holds another map (other bodies, axes or tolerance): {path}; name a new folder"
                )
            if (store.n_layers, store.n_cases) != (len(grid.layers), grid.n_cases):
                raise _damaged(path, "its size does not match this map")
            return store
        group = _made(zarr, str(path), len(grid.layers), grid.n_cases, block_size(grid.n_cases))
        group.attrs.update({"n_cases": grid.n_cases, "block": block_size(grid.n_cases), "fingerprint": mark})
        return cls(path)

    def missing(self) -> list[int]:
        """Blocks that are not done yet."""
        with _intact(self.path):
            return np.flatnonzero(self.group["done"][:] == 0).tolist()

    def bounds(self, block: int) -> tuple[int, int]:
        """First cell of a block and the one after its last."""
        return block * self.block, min((block + 1) * self.block, self.n_cases)

    def write(self, block: int, numbers: np.ndarray, texts: Texts) -> None:
        """Save a block."""
        import zarr

        group: Any = zarr.open_group(str(self.path), mode="r+")
        start, stop = self.bounds(block)
        group["numbers"][:, start:stop] = numbers
        if texts:
            raw = np.zeros((stop - start, TEXT), np.uint8)
            for i, text in texts.items():
                encoded = text.encode()[:TEXT]
                raw[i - start, : len(encoded)] = list(encoded)
            group["failures"][start:stop] = raw
        group["done"][block] = 1

    def read(self) -> tuple[np.ndarray, Texts]:
        """Numbers (n_layers, n_cases) and error texts of all cells."""
        found: Texts = {}
        with _intact(self.path):
            for block in range(math.ceil(self.n_cases / self.block)):
                start, stop = self.bounds(block)
                raw = self.group["failures"][start:stop]
                for i in np.flatnonzero(raw.any(axis=1)):
                    found[start + int(i)] = bytes(raw[i]).rstrip(b"\0").decode("utf-8", "ignore")
            return self.group["numbers"][:], found


def _made(zarr: Any, place: Any, n_layers: int, n_cases: int, block: int) -> Any:
    """Empty arrays of a store, with checksums; uncompressed, so that a bad chunk cannot expand and fill the memory."""
    group = zarr.open_group(place, mode="w")
    for name, shape, chunks, kind, empty in (
        ("numbers", (n_layers, n_cases), (n_layers, block), "f8", math.nan),
        ("failures", (n_cases, TEXT), (block, TEXT), "u1", 0),
        ("done", (math.ceil(n_cases / block),), (1,), "u1", 0),
    ):
        group.create_array(
            name, shape=shape, chunks=chunks, dtype=kind, fill_value=empty, compressors=zarr.codecs.Crc32cCodec()
        )
    return group


def fingerprint(grid: Any) -> str:
    """Hash of everything that determines the results of a map."""
    body = hashlib.sha256(json.dumps(grid.scene(), sort_keys=True).encode())
    for name, values in grid.axes.items():
        body.update(name.encode() + np.ascontiguousarray(values, float).tobytes())
    body.update(repr((grid.tolerance, grid.residual, grid.band, grid.layers)).encode())
    return body.hexdigest()


def by_store(grid: Any, path: str | Path, solve: Solve, watch: Watch | None) -> tuple[np.ndarray, Texts]:
    """Compute the blocks missing from a store in this process; return the whole map."""
    store = Store.open(path, grid)
    missing = store.missing()
    done = grid.n_cases - sum(np.diff(store.bounds(block))[0] for block in missing)
    for block in missing:
        start, stop = store.bounds(block)
        store.write(block, *solve(grid, start, stop))
        done += stop - start
        if watch is not None:
            watch(int(done), grid.n_cases)
    return store.read()


def by_cluster(
    grid: Any, client: Any, path: str | Path | None, solve: Solve, watch: Watch | None
) -> tuple[np.ndarray, Texts]:
    """Compute a map on a Dask cluster; if there is a store, the workers write finished blocks to it themselves.

    Parameters
    ----------
    client : dask.distributed.Client or the address of a scheduler
    """
    with _needed("client"):
        from distributed import Client, as_completed
    if not isinstance(client, (str, Client)):
        raise ValueError(f"client must be a dask.distributed.Client or an address, got {check.shown(client)}")
    with _connected(Client, client) as connected:
        store = None if path is None else Store.open(path, grid)
        block = block_size(grid.n_cases)
        todo = store.missing() if store is not None else list(range(math.ceil(grid.n_cases / block)))
        # New keys for data (not its hash) and tasks: the scheduler may still be about to forget those of the last run
        shared = connected.scatter(grid.sampled(), broadcast=True, hash=False)
        name = f"map-{uuid.uuid4().hex[:12]}"
        futures = {
            connected.submit(_work, shared, i, block, solve, None if store is None else str(store.path),
                             key=f"{name}-{i}", pure=False): i
            for i in todo
        }  # fmt: skip
        numbers = np.empty((len(grid.layers), grid.n_cases)) if store is None else np.empty((0, 0))
        texts: Texts = {}
        done = grid.n_cases - sum(min(block, grid.n_cases - i * block) for i in todo)
        for future, result in as_completed(futures, with_results=True):
            if future.cancelled():
                raise OSError(f"client: the cluster dropped the map ({check.line(str(result))}); run it again")
            start = futures[future] * block
            stop = min(start + block, grid.n_cases)
            if result is not None:
                numbers[:, start:stop], new = result
                texts |= new
            done += stop - start
            if watch is not None:
                watch(done, grid.n_cases)
            future.release()
        return (numbers, texts) if store is None else Store(store.path).read()


def _work(grid: Any, block: int, size: int, solve: Solve, path: str | None) -> tuple[np.ndarray, Texts] | None:
    """Compute one block on a worker; return None if it is, or goes, in a store."""
    if path is None:
        return solve(grid, block * size, min((block + 1) * size, grid.n_cases))
    store = Store(check.path("store", path))
    if block not in store.missing():  # another worker saved it and died before it could report
        return None
    store.write(block, *solve(grid, *store.bounds(block)))
    return None


@contextmanager
def _connected(make: Any, client: Any) -> Iterator[Any]:
    """The given client, or a new one for an address, which is closed afterwards."""
    if not isinstance(client, str):
        yield client
        return
    try:
        made = make(client, timeout=10)
    except (OSError, TypeError) as error:  # TypeError: TLS without a certificate
        raise OSError(
            f"client: no cluster answers at {client} ({check.line(str(error))}); start one or correct the address"
        ) from None
    with made:
        yield made


@contextmanager
def _needed(name: str) -> Iterator[None]:
    """Turn a missing package into an error that says how to install it."""
    try:
        yield
    except ImportError as error:
        raise ValueError(f"{name} needs {error.name}: {EXTRA}") from None


@contextmanager
def _intact(path: Path) -> Iterator[None]:
    """Report any error while reading a store as a damaged store."""
    try:
        yield
    except Exception as error:  # zarr and its codecs raise many kinds of error
        raise _damaged(path, str(error)) from None


def not_free(path: Path) -> ValueError:
    """Error about a store that holds something else."""
    return ValueError(f"store must be a new folder or the store of this map, got {path}; name a new folder")


def _damaged(path: Path, reason: str) -> ValueError:
    return ValueError(f"store {path} is damaged ({check.line(reason)}); name a new folder, or delete this one")
