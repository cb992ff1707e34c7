"""Serves a page, on this machine only, whose sliders and clicks change the blow."""

import gc
import logging
from collections.abc import Callable
from contextlib import nullcontext

from .._base import check
from ..model.planner import Watch
from ..scenes.scene import Scene
from .explore_model import Setup
from .explore_numbers import Explorer
from .explore_worker import Worker


@check.typed
def serve(
    scene: Scene, *, port: int = 0, ready: Callable[[str], None] | None = None, watch: Watch | None = None
) -> None:
    """Serve the page until interrupted.

    Parameters
    ----------
    scene : Scene
    port : int
        0 chooses any free port.
    ready : callable, optional
        Called with the address as soon as the page can be opened.
    watch : callable, optional
        Called with the name of each stage before that; returns a context manager that is active during the stage.

    Raises
    ------
    ValueError
        If the extra ``web`` is not installed, or the port number is invalid.
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
    try:
        with (watch or nullcontext)("modes"):
            explorer = Explorer(Setup.of(scene))
            workers += [Worker(explorer), Worker(explorer)]  # one judges blows while the other draws a map or a sound
            explorer.answer(explorer.setup.start)  # compile the kernels before the page opens
        gc.collect()
        gc.freeze()  # the modes outlive every answer, and looking through them takes longer than one
        server, address = open_server(explorer, workers, port)
        if ready is not None:
            ready(address)
        try:
            IOLoop.current().start()
        finally:
            server.stop()
    finally:
        gc.unfreeze()
        for worker in workers:
            worker.stop()
