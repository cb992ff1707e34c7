"""Serves a page, on this machine only, whose sliders and clicks change the blow."""

import logging
import socket
import sys
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

from .._base import check
from ..model.planner import Watch
from ..scenes.scene import Scene
from .explore_model import Bench, blow, quick
from .explore_view import Page

SWITCH = 1e-3  # [s] for which a map or a sound computed beside the page may keep it waiting; Python's own is 5e-3
LOCAL = "127.0.0.1"
LARGEST_REQUEST = 64 * 1024  # [byte] of a request or a message: a slider's value takes a few hundred
LARGEST_HEADER = 16 * 1024  # [byte] of a request: browsers send one or two thousand


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
    for module in ("bokeh.server.tornado", "jinja2"):
        check.extra(module, "web", "exploring")
    from tornado.ioloop import IOLoop

    if not 0 <= port < 65536:
        raise ValueError(f"port must lie between 0 and 65535, got {port}")
    for name in ("tornado.access", "bokeh.server.views.ws"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # do not report refused requests on the terminal
    with (watch or nullcontext)("modes"):
        bench = Bench.of(scene)
        blow(bench.case(bench.start))  # compile the kernels before the page opens
        quick(bench.case(bench.start))
    sys.setswitchinterval(SWITCH)
    server, address = _server(bench, port)
    server.start()
    if ready is not None:
        ready(address)
    try:
        IOLoop.current().start()
    finally:
        server.stop(wait=False)


def _server(bench: Bench, port: int) -> tuple[Any, str]:
    """A Bokeh server on the loopback address that refuses requests for any other host name."""
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
        """Refuses other host names: with one of its own, a foreign site could make the browser read this page."""

        def prepare(self) -> None:
            self.set_status(403)
            self.finish("This page is served to 127.0.0.1 and localhost only.\n")

    class Guard(Router):
        def find_handler(self, request: Any, **kwargs: Any) -> Any:
            if request.headers.get("Host", "").lower() in hosts:
                return tornado.find_handler(request, **kwargs)
            return tornado.get_handler_delegate(request, Refused)

    http = HTTPServer(Guard(), max_body_size=LARGEST_REQUEST, max_header_size=LARGEST_HEADER)
    http.add_socket(listening)
    return BaseServer(IOLoop.current(), tornado, http), f"http://{LOCAL}:{port}/"
