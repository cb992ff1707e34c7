"""Long maps on one or many machines: each finished block of cells is saved in a Zarr store, so that runs can resume."""

import hashlib
import json
import logging
import math
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, identity
from .._base.files import new_folder

LOG = logging.getLogger(__name__)
LARGEST_BLOCK = 2**17  # [-] cells computed together at most, to limit the memory to 30 MB: half a second of work
BLOCKS = 64  # [-] fewest blocks of a large map: a killed run loses at most one block per worker
ARRAYS = ("numbers", "failures", "done")  # of a store; the last one holds the proofs and is written last
TEXT = 240  # [byte] longer error texts are cut, because every cell has room for one

Texts = dict[int, str]  # failed cell: error text
Solve = Callable[[Any, int, int], tuple[np.ndarray, Texts]]  # grid, start, stop: numbers (n_layers, n_cells), texts
Watch = Callable[[int, int], Any]
Mark = dict[str, str]  # digests, from `fingerprint`
OTHERS = {  # what is said of a store whose digests are others
    "program": "made by another version of this program or its libraries",
    "map": "other bodies, axes or tolerance",
    "functions": "other functions in layers",
}


def _zarr() -> Any:
    return check.extra("zarr", "cluster", "a store")


def finished(path: Path) -> tuple[int, int]:
    """How many blocks of a store are finished, and of how many; ValueError if it is none."""
    zarr = _zarr()
    with _intact(path):
        done = np.asarray(zarr.open_group(str(path), mode="r")["done"])
    return int(np.count_nonzero(done)), done.size


def block_size(n_cases: int) -> int:
    """Number of cells in a block."""
    return max(1, min(LARGEST_BLOCK, math.ceil(n_cases / BLOCKS)))


class Store:
    """Results of a map on disk, block by block.

    Each block has a proof: a digest of its results, its place, and all that determines them, see `fingerprint`. What
    does not match its proof, because it was lost, damaged or moved, is computed again. Its folder has the same path on
    every machine that works on the map.
    """

    def __init__(self, path: Path, mark: Mark, n_layers: int, n_cases: int) -> None:
        self.path, self.mark = path, mark
        self.n_layers, self.n_cases, self.block = n_layers, n_cases, block_size(n_cases)
        zarr = _zarr()
        with _intact(path):
            group: Any = zarr.open_group(str(path), mode="r")
            found = dict(group.attrs)
            if not set(OTHERS) <= set(found):
                raise ValueError("it does not say what it was made for")
        for name, others in OTHERS.items():
            if found[name] != mark[name]:
                raise ValueError(f"store holds another map ({others}): {path}; name a new folder")
        if mark["program"] != identity.program():
            raise ValueError("client: a worker runs another version of this program; install the same one everywhere")
        with _intact(path):
            self.arrays = {name: group[name] for name in ARRAYS}
            fresh = _made(zarr, {}, mark, n_layers, n_cases)
            for name in ARRAYS:
                if self.arrays[name].metadata.to_dict() != fresh[name].metadata.to_dict():
                    raise ValueError(f"the array {name} has another shape, type or chunk size than this program writes")

    @classmethod
    def open(cls, path: str | Path, grid: Any) -> "Store":
        """Open the store of a map, or create it; ValueError if the path holds anything else."""
        path = Path(path).resolve()
        zarr = _zarr()
        mark = fingerprint(grid)
        if not path.exists() or (path.is_dir() and not any(path.iterdir())):
            with new_folder(path) as new:
                _made(zarr, str(new), mark, len(grid.layers), grid.n_cases)
        if not (path / "zarr.json").exists():
            raise not_free(path)
        return cls(path, mark, len(grid.layers), grid.n_cases)

    def missing(self) -> list[int]:
        """Numbers of the blocks that are not in the store, or not as they were written."""
        return [block for block in range(math.ceil(self.n_cases / self.block)) if self.read(block) is None]

    def bounds(self, block: int) -> tuple[int, int]:
        """First cell of a block and the one after its last."""
        return block * self.block, min((block + 1) * self.block, self.n_cases)

    @cached_property
    def _writable(self) -> list[Any]:
        """The arrays, opened for writing."""
        group: Any = _zarr().open_group(str(self.path), mode="r+")
        return [group[name] for name in ARRAYS]

    def write(self, block: int, numbers: np.ndarray, texts: Texts) -> tuple[np.ndarray, Texts]:
        """Save a block; return it as it will be read."""
        start, stop = self.bounds(block)
        numbers = np.where(np.isnan(numbers), math.nan, numbers)  # a chunk of these is not written, and read as these
        raw = np.zeros((stop - start, TEXT), np.uint8)
        for i, text in texts.items():
            encoded = text.encode()[:TEXT]
            raw[i - start, : len(encoded)] = list(encoded)
        kept, failures, done = self._writable
        kept[:, start:stop] = numbers
        failures[start:stop] = raw
        done[block] = self._proof(block, numbers, raw)
        return numbers, _texts(raw, start)

    def read(self, block: int) -> tuple[np.ndarray, Texts] | None:
        """Numbers (n_layers, n_cells) and error texts of a block; None if they are not what was written there."""
        start, stop = self.bounds(block)
        try:
            proof = int(self.arrays["done"][block])
            numbers, raw = self.arrays["numbers"][:, start:stop], self.arrays["failures"][start:stop]
        except Exception:  # what zarr cannot read raises many kinds of error
            proof, numbers, raw = 1, np.empty(0), np.empty(0)
        if proof == self._proof(block, numbers, raw):
            return numbers, _texts(raw, start)
        if proof:
            LOG.warning("block %d of %s is damaged and is computed again", block, self.path)
        return None

    def _proof(self, block: int, numbers: np.ndarray, raw: np.ndarray) -> np.uint64:
        """Digest of a block's place, origin and content; never zero, which stands for nothing."""
        body = hashlib.sha256(
            json.dumps([self.mark, block], sort_keys=True).encode() + numbers.tobytes() + raw.tobytes()
        )
        return np.uint64(int.from_bytes(body.digest()[:8]) | 1)


def _texts(raw: np.ndarray, start: int) -> Texts:
    """Error texts of the failed cells of a block that begins with a cell."""
    return {
        start + int(i): bytes(raw[i]).rstrip(b"\0").decode("utf-8", "ignore") for i in np.flatnonzero(raw.any(axis=1))
    }


def _made(zarr: Any, place: Any, mark: Mark, n_layers: int, n_cases: int) -> Any:
    """Empty arrays of a store; uncompressed, so that a bad chunk cannot expand and fill the memory."""
    group, block = zarr.open_group(place, mode="w", attributes=mark), block_size(n_cases)
    for name, (shape, chunks, kind, empty) in zip(ARRAYS, (
        ((n_layers, n_cases), (n_layers, block), "f8", math.nan),
        ((n_cases, TEXT), (block, TEXT), "u1", 0),
        ((math.ceil(n_cases / block),), (1,), "u8", 0),
    )):  # fmt: skip
        group.create_array(name, shape=shape, chunks=chunks, dtype=kind, fill_value=empty, compressors=None)
    return group


def fingerprint(grid: Any) -> Mark:
    """Digests of everything that determines the results of a map: the blow, the functions and the program."""
    striker, views = grid.base.striker, grid.base.views
    bodies = [(modes, np.array([place])) for place, modes in views.items()]
    blow = [
        grid.scene(), list(grid.axes.items()), grid.chosen, grid.tolerance, grid.residual, grid.band, grid.layers,
        striker.hand, striker.motion, grid.base.first,
    ]  # fmt: skip
    for modes, places in bodies or [(grid.base.modes, grid.axes.get("at", grid.base.at[None]))]:
        for each in modes.descriptions().values():
            yields = [float(each.shapes.compliance(place[None])[0, 0]) for place in places]
            blow += [each.stretches, each.thick, each.air, each.unstated, yields]
            blow += [each.omega, each.shape_at(places), each.shapes.spread(places)]
    functions = {}
    for name, function in grid.extra.items():
        try:
            functions[name] = identity.identify(function)
        except ValueError as error:
            raise ValueError(
                f"layers: {name!r} cannot be distinguished from other functions ({error}), so a store may mix "
                "them up; leave out store, or pass a function that does not use it"
            ) from None
    return {"map": identity.identify(blow), "functions": identity.identify(functions), "program": identity.program()}


def by_blocks(
    grid: Any, solve: Solve, watch: Watch | None, size: int, path: str | Path | None = None
) -> tuple[np.ndarray, Texts]:
    """Compute a map in this process, in blocks of a size, or those of a store: what is not there is written to it."""
    store = None if path is None else Store.open(path, grid)
    size = size if store is None else store.block
    numbers = np.empty((len(grid.layers), grid.n_cases))
    texts: Texts = {}
    for start in range(0, grid.n_cases, size):
        stop, block = min(start + size, grid.n_cases), start // size
        found = None if store is None else store.read(block)  # only now: another process may be at work on the same map
        if found is None:
            found = solve(grid, start, stop)
            found = found if store is None else store.write(block, *found)
        numbers[:, start:stop], new = found
        texts |= new
        if watch is not None:
            watch(stop, grid.n_cases)
    return numbers, texts


def by_cluster(
    grid: Any, client: Any, path: str | Path | None, solve: Solve, watch: Watch | None
) -> tuple[np.ndarray, Texts]:
    """Compute a map on a Dask cluster; if there is a store, the workers write finished blocks to it themselves.

    ``client`` is a dask.distributed.Client or the address of a scheduler.
    """
    dask = check.extra("distributed", "cluster", "client")
    if not isinstance(client, (str, dask.Client)):
        raise ValueError(f"client must be a dask.distributed.Client or an address, got {check.shown(client)}")
    try:
        ours = dask.Client(client, timeout=10) if isinstance(client, str) else nullcontext(client)
    except (OSError, TypeError) as error:  # TypeError: TLS without a certificate
        raise OSError(
            f"client: no cluster answers at {client} ({check.line(str(error))}); start one or correct the address"
        ) from None
    with ours as connected:
        store = None if path is None else Store.open(path, grid)
        block = block_size(grid.n_cases)
        todo = store.missing() if store is not None else list(range(math.ceil(grid.n_cases / block)))
        at = None if store is None else (str(store.path), store.mark)
        # New keys for data (not its hash) and tasks: the scheduler may still be about to forget those of the last run
        shared = connected.scatter(grid.sampled(), broadcast=True, hash=False)
        name = f"map-{uuid.uuid4().hex[:12]}"
        futures = {connected.submit(_work, shared, i, block, solve, at, key=f"{name}-{i}", pure=False): i for i in todo}
        numbers = np.empty((len(grid.layers), grid.n_cases)) if store is None else np.empty((0, 0))
        texts: Texts = {}
        done = grid.n_cases - sum(min(block, grid.n_cases - i * block) for i in todo)
        for future, result in dask.as_completed(futures, with_results=True):
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
        return (numbers, texts) if path is None else by_blocks(grid, solve, None, block, path)


def _work(
    grid: Any, block: int, size: int, solve: Solve, at: tuple[str, Mark] | None
) -> tuple[np.ndarray, Texts] | None:
    """Compute one block on a worker; return None if it is, or goes, in a store, of which path and mark are given."""
    if at is None:
        return solve(grid, block * size, min((block + 1) * size, grid.n_cases))
    store = Store(check.path("store", at[0]), at[1], len(grid.layers), grid.n_cases)
    if store.read(block) is None:  # otherwise another worker saved it and died before it could report
        store.write(block, *solve(grid, *store.bounds(block)))
    return None


@contextmanager
def _intact(path: Path) -> Iterator[None]:
    """Report any error while reading a store as a damaged store."""
    try:
        yield
    except Exception as error:  # zarr and its codecs raise many kinds of error
        why = check.line(str(error))
        raise ValueError(f"store {path} is damaged ({why}); name a new folder, or delete this one") from None


def not_free(path: Path) -> ValueError:
    """Error about a store that holds something else."""
    return ValueError(f"store must be a new folder or the store of this map, got {path}; name a new folder")
