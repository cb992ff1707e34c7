"""A page served on this machine only, on which sliders and clicks change the blow."""

import logging
import socket
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

from . import _check
from .bench import Bench, blow
from .desk import Page
from .planner import Watch
from .scene import Scene

LOCAL = "127.0.0.1"
LARGEST_REQUEST = 64 * 1024  # [byte] of a request and of a message: a slider's value takes some hundred
LARGEST_HEADER = 16 * 1024  # [byte]


@_check.typed
def serve(
    scene: Scene, *, port: int = 0, ready: Callable[[str], None] | None = None, watch: Watch | None = None
) -> None:
    """Serve the page until interrupted.

    Parameters
    ----------
    scene : Scene
    port : int, 0 for any that is free
    ready : callable, optional
        Called with the address once the page can be opened.
    watch : callable, optional
        Called with the name of the stage before that; returns a context manager that is held while the stage lasts.

    Raises
    ------
    ValueError
        Where the extra ``web`` is not installed, or the port cannot be.
    OSError
        Where the port is taken.
    """
    for module in ("bokeh.server.tornado", "jinja2"):
        _check.extra(module, "web", "exploring")
    from tornado.ioloop import IOLoop

    if not 0 <= port < 65536:
        raise ValueError(f"port must lie between 0 and 65535, got {port}")
    for name in ("tornado.access", "bokeh.server.views.ws"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # who was refused is no news for the terminal
    with (watch or nullcontext)("modes"):
        bench = Bench.of(scene)
        blow(bench.case(bench.start))  # compiles the kernels before anyone waits for them
    server, address = _server(bench, port)
    server.start()
    if ready is not None:
        ready(address)
    try:
        IOLoop.current().start()
    finally:
        server.stop(wait=False)


def _server(bench: Bench, port: int) -> tuple[Any, str]:
    """A Bokeh server on this machine's own address that answers to this machine's own names only."""
    from bokeh.application import Application
    from bokeh.application.handlers.function import FunctionHandler
    from bokeh.server.server import BaseServer
    from bokeh.server.tornado import BokehTornado
    from tornado.httpserver import HTTPServer
    from tornado.ioloop import IOLoop
    from tornado.routing import Router
    from tornado.web import RequestHandler

    listening = socket.create_server((LOCAL, port))
    listening.setblocking(False)
    port = listening.getsockname()[1]
    hosts = {f"{name}:{port}" for name in (LOCAL, "localhost")}
    application = Application(FunctionHandler(lambda document: Page(document, bench).show()))
    tornado = BokehTornado(
        {"/": application},
        extra_websocket_origins=sorted(hosts),
        websocket_max_message_size_bytes=LARGEST_REQUEST,
    )

    class Refused(RequestHandler):
        """A page elsewhere that calls this machine by another name, so that a browser would let it read the answer."""

        def prepare(self) -> None:
            self.set_status(403)
            self.finish("This page answers to 127.0.0.1 and localhost only.\n")

    class Guard(Router):
        def find_handler(self, request: Any, **kwargs: Any) -> Any:
            if request.headers.get("Host", "").lower() in hosts:
                return tornado.find_handler(request, **kwargs)
            return tornado.get_handler_delegate(request, Refused)

    http = HTTPServer(Guard(), max_body_size=LARGEST_REQUEST, max_header_size=LARGEST_HEADER)
    http.add_socket(listening)
    return BaseServer(IOLoop.current(), tornado, http), f"http://{LOCAL}:{port}/"
