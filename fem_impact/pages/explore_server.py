"""Serves the live page on this machine only, by tornado, which is loaded where a page is served."""

import json
import logging
import socket
from contextlib import suppress
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from .._base import check
from .explore_bench import LARGEST_DRAWING, safe_name
from .explore_numbers import Explorer
from .explore_session import Session
from .explore_view import page
from .explore_worker import Worker
from .html_page import web_text

LOG = logging.getLogger(__name__)
LOCAL = "127.0.0.1"
LARGEST_REQUEST = 64 * 1024  # [byte] of a message: a slider's value takes a few hundred; headers take 2 000
POLICY = {  # what the page may load and where it may send: nothing but its own parts, pictures and sounds made here
    "default-src": "'none'", "script-src": "'self'", "style-src": "'self'", "connect-src": "'self'",
    "img-src": "data:", "media-src": "data:", "base-uri": "'none'", "form-action": "'none'",
    "frame-ancestors": "'none'",
}  # fmt: skip


class Text(RequestHandler):
    """One of the files of the page."""

    def get(self, name: str | None) -> None:
        kind, text = self.settings["parts"][name or ""]
        self.set_header("Content-Type", f"text/{kind}; charset=utf-8")
        self.set_header("Content-Security-Policy", "; ".join(map(" ".join, POLICY.items())))
        self.set_header("Cache-Control", "no-store")
        self.finish(text)


class Drop(RequestHandler):
    """Takes a file that was dropped on the page, under a name without folders, into the server's own folder."""

    def post(self) -> None:
        if self.request.headers.get("Origin", "").lower() not in self.settings["origins"]:
            self.set_status(403)
            return
        try:
            name = safe_name(self.get_query_argument("name", ""))
        except ValueError as error:
            self.set_status(400)
            self.finish(str(error))
            return
        (self.settings["folder"] / name).write_bytes(self.request.body)
        self.finish(name)


class Talk(WebSocketHandler):
    """The connection that an open page keeps."""

    def check_origin(self, origin: str) -> bool:
        return origin.lower() in self.settings["origins"]

    def open(self, *_: str, **__: str) -> None:
        self.set_nodelay(True)
        explorer, workers, pages, folder = (self.settings[name] for name in ("explorer", "workers", "pages", "folder"))
        self.session = Session(explorer, workers[0], workers[1], self._say, pages, folder)
        self.session.show()

    def on_message(self, message: str | bytes) -> None:
        if self.session.closed:
            return
        try:
            self.session.obey(json.loads(message))
        except (ValueError, RecursionError) as error:  # no page of ours sends this
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


class Guarded(Application):
    """Leads to the page those who ask for this machine by its name."""

    def find_handler(self, request: Any, **kwargs: Any) -> Any:
        if request.headers.get("Host", "").lower() in self.settings["hosts"]:
            return super().find_handler(request, **kwargs)
        return self.get_handler_delegate(request, Refused)


def open_server(explorer: Explorer, workers: list[Worker], port: int, folder: Path) -> tuple[HTTPServer, str]:
    """A server on the loopback address, and its address; port 0 is any free one, dropped files go to the folder."""
    listening = socket.create_server((LOCAL, port))
    listening.setblocking(False)
    port = listening.getsockname()[1]
    hosts = {f"{name}:{port}" for name in (LOCAL, "localhost")}
    parts = {"": ("html", page())}
    for name, kind in (("explore.css", "css"), ("plots.js", "javascript"), ("explore.js", "javascript")):
        parts[name] = kind, web_text(name)
    application = Guarded(
        [(f"/({'|'.join(filter(None, parts))})?", Text), ("/drop", Drop), ("/talk", Talk)],
        websocket_max_message_size=LARGEST_REQUEST, origins={f"http://{host}" for host in hosts}, hosts=hosts,
        parts=parts, explorer=explorer, workers=workers, folder=folder, pages=set(),
    )  # fmt: skip
    http = HTTPServer(application, max_body_size=LARGEST_DRAWING, max_header_size=LARGEST_REQUEST // 4)
    http.add_socket(listening)
    return http, f"http://{LOCAL}:{port}/"
