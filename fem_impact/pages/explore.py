"""Serves a page, on this machine only, whose sliders and clicks change the blow."""

import gc
import json
import logging
import socket
from collections.abc import Callable
from contextlib import nullcontext, suppress
from typing import Any

from .._base import check
from ..model.planner import Watch
from ..scenes.scene import Scene
from . import report
from .explore_model import Setup
from .explore_numbers import Explorer
from .explore_session import Session
from .explore_view import page, parsed
from .explore_worker import Worker

LOG = logging.getLogger(__name__)
LOCAL = "127.0.0.1"
LARGEST_REQUEST = 64 * 1024  # [byte] of a request or a message: a slider's value takes a few hundred
LARGEST_HEADER = 16 * 1024  # [byte] of a request: browsers send one or two thousand
POLICY = {  # what the page may load and where it may send: nothing but its own parts, pictures and sounds made here
    "default-src": "'none'", "script-src": "'self'", "style-src": "'self'", "connect-src": "'self'",
    "img-src": "data:", "media-src": "data:", "base-uri": "'none'", "form-action": "'none'",
    "frame-ancestors": "'none'",
}  # fmt: skip


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
        server, address = _server(explorer, workers, port)
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


def _server(explorer: Explorer, workers: list[Worker], port: int) -> tuple[Any, str]:
    """A server on the loopback address that refuses requests for any other host name."""
    from tornado.httpserver import HTTPServer
    from tornado.routing import Router
    from tornado.web import Application, RequestHandler
    from tornado.websocket import WebSocketClosedError, WebSocketHandler

    listening = socket.create_server((LOCAL, port))
    listening.setblocking(False)
    port = listening.getsockname()[1]
    hosts = {f"{name}:{port}" for name in (LOCAL, "localhost")}
    kinds = {"/": "text/html", "/explore.css": "text/css", "/explore.js": "text/javascript"}
    texts = {path: (report.WEB / path[1:]).read_text(encoding="utf-8") for path in list(kinds)[1:]}
    texts["/"] = page(explorer.setup)

    class Text(RequestHandler):
        """One of the three files of the page."""

        def get(self) -> None:
            self.set_header("Content-Type", f"{kinds[self.request.path]}; charset=utf-8")
            self.set_header("Content-Security-Policy", "; ".join(map(" ".join, POLICY.items())))
            self.set_header("Cache-Control", "no-store")
            self.finish(texts[self.request.path])

    class Talk(WebSocketHandler):
        """The connection that an open page keeps."""

        def check_origin(self, origin: str) -> bool:
            return origin.lower() in {f"http://{host}" for host in hosts}

        def open(self, *_: str, **__: str) -> None:
            self.set_nodelay(True)
            self.session = Session(explorer, workers[0], workers[1], self._say)

        def on_message(self, message: str | bytes) -> None:
            if self.session.closed:
                return
            try:
                self.session.take(parsed(message))
            except ValueError as error:  # no page of ours sends this
                LOG.warning("a page is refused: %s", check.line(str(error)))
                self.session.close()
                self.close(1003, str(error)[:120])

        def on_close(self) -> None:
            if not self.session.closed:
                LOG.info("a page has gone")
            self.session.close()

        def _say(self, message: dict[str, Any]) -> None:
            with suppress(WebSocketClosedError):
                sent: Any = self.write_message(json.dumps(message))
                sent.add_done_callback(lambda sent: sent.cancelled() or sent.exception())  # it may go before it listens

    class Refused(RequestHandler):
        """Refuses other host names: with one of its own, a foreign site could make the browser read this page."""

        def prepare(self) -> None:
            self.set_status(403)
            self.finish("This page is served to 127.0.0.1 and localhost only.\n")

    application = Application(
        [*((path, Text) for path in kinds), ("/talk", Talk)], websocket_max_message_size=LARGEST_REQUEST
    )

    class Guard(Router):
        def find_handler(self, request: Any, **kwargs: Any) -> Any:
            if request.headers.get("Host", "").lower() in hosts:
                return application.find_handler(request, **kwargs)
            return application.get_handler_delegate(request, Refused)

    http = HTTPServer(Guard(), max_body_size=LARGEST_REQUEST, max_header_size=LARGEST_HEADER)
    http.add_socket(listening)
    return http, f"http://{LOCAL}:{port}/"
