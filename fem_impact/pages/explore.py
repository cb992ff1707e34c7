"""Serves a page, on this machine only, whose sliders and clicks change the blow."""

import gc
import logging
import tempfile
from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from pathlib import Path

from .._base import check
from ..model.planner import Watch
from ..scenes.scene import Scene
from .explore_bench import first_scene, scene_of_order
from .explore_model import Setup
from .explore_numbers import Explorer
from .explore_worker import Worker


@check.typed
def serve(
    scene: Scene | str | Path | None = None,
    *,
    port: int = 0,
    ready: Callable[[str], None] | None = None,
    watch: Watch | None = None,
) -> None:
    """Serve the page until interrupted.

    Parameters
    ----------
    scene : Scene, or path of a scene, a drawing or a mesh file, optional
        A drawing becomes the plate of ``fem-impact new --from``; without any, the page begins with a wooden plate.
        Others can be dropped on the page, and materials and mallets of the catalogue be picked there.
    port : int
        0 chooses any free port.
    ready : callable, optional
        Called with the address as soon as the page can be opened.
    watch : callable, optional
        Called with the name of each stage before that; returns a context manager that is active during the stage.

    Raises
    ------
    ValueError
        If the extra ``web`` is not installed, the port number is invalid, or the file is wrong.
    OSError
        If the port is in use.
    """
    for module in ("tornado", "jinja2"):
        check.extra(module, "web", "exploring")
    from tornado.ioloop import IOLoop

    from .explore_server import open_server

    if not 0 <= port < 65536:
        raise ValueError(f"port must lie between 0 and 65535, got {port}")
    logging.getLogger("tornado.access").setLevel(logging.CRITICAL)  # do not report refused requests on the terminal
    workers: list[Worker] = []
    first, order = first_scene(scene)
    with ExitStack() as ended, tempfile.TemporaryDirectory(prefix="fem_impact_") as folder:
        ended.callback(gc.unfreeze)
        with (watch or nullcontext)("modes"):
            explorer = Explorer(Setup.of(scene_of_order(first, order)), first, order)
            for _ in range(2):  # one judges blows while the other draws a map or a sound
                workers.append(Worker(explorer))
                ended.callback(workers[-1].stop)
            explorer.answer(explorer.setup.start)  # compile the kernels before the page opens
        gc.collect()
        gc.freeze()  # the modes outlive every answer, and looking through them takes longer than one
        server, address = open_server(explorer, workers, port, Path(folder))
        if ready is not None:
            ready(address)
        try:
            IOLoop.current().start()
        finally:
            server.stop()
