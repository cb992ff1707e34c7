"""Follows one open page: answers its hand at once, and computes the rest when the hand rests."""

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from .._base import check
from .._base.check import SimulationError
from ..scenes.sentences import place, si
from .explore_bench import Order, order_of, pickable
from .explore_map import Mapper, Picture, Window
from .explore_model import Settings, Setup
from .explore_numbers import Explorer, Message, Point, View, drawn_map
from .explore_view import RATES, check_sliders, ends, laid_out, pair
from .explore_worker import Worker

LETTERS = "ABCDEFGH"  # of kept blows: more curves in one picture are a tangle
REST = 0.15  # [s] without a change before the blow is judged and the map drawn again


class _Superseded(Exception):
    """The page no longer asks for what was computed."""


class Session:
    """The settings of one open page, and what of it is still being computed.

    Everything runs on the event loop; ``judge`` and ``mapper`` are processes that hold a `Explorer` each. What a page
    asks for waits until all other pages had their turn, and then only the last of it is computed. All pages show the
    body that one of them put on the bench last.
    """

    def __init__(
        self, explorer: Explorer, judge: Worker, mapper: Worker, send: Callable[[Message], Any],
        pages: set["Session"] | None = None, folder: Path | None = None,
    ) -> None:  # fmt: skip
        self.explorer, self.judge, self.mapper, self.send = explorer, judge, mapper, send
        self.pages: set[Session] = set() if pages is None else pages  # all that are open
        self.pages.add(self)
        self.folder = folder  # of dropped files
        self.height, self.rate = 0.0, RATES[2]
        self.order: Order | None = None  # what the page wants on the bench
        self.tasks: dict[str, asyncio.Task[None]] = {}  # opening, judging, mapping, listening
        # letters and shares of the speed; of a longer queue the oldest are too late to be played
        self.hits: deque[tuple[str, float]] = deque(maxlen=8)
        self.roll: bool | None = None  # whether to play a roll or a blow next
        self.closed = False
        self._begin()

    def _begin(self) -> None:
        """Start with the scene's own blow on the body on the bench."""
        self.setup: Setup = self.explorer.setup
        self.settings: Settings = self.setup.start
        self.ends = ends(self.setup)
        self.listener: Point = tuple(float(x) for x in self.setup.scene.points[0])
        self.window = Window.of(self.setup, None, None)
        self.number = self.last = 0  # of the last request that was answered, and of the last one
        self.turned: dict[str, float] = {}  # sliders moved since the last answer
        self.ear: tuple[float, float] | None = None  # where the page wants to listen since then
        self.asked: asyncio.Handle | None = None  # the answer to come
        self.resting: asyncio.TimerHandle | None = None
        self.judged: Any = None  # what the numbers on the page are exact for
        self.mapped: Any = None  # what the map on the page was drawn for

    def show(self) -> None:
        """Send the page what lies on the bench."""
        explorer = self.explorer
        picks = pickable(explorer.first, explorer.order, self.setup.scene)
        points = {"at": self.settings.at, "ear": self.listener}
        self.send({"kind": "setup", **laid_out(self.setup), "picks": picks, **points})
        for kept in explorer.kept.values():
            self.send(kept.shown)

    def _restart(self) -> None:
        """Show another body, or another mallet; what was computed for the one before is not wanted any more."""
        self._cancel(*(task for name, task in self.tasks.items() if name != "open"))
        listener = self.listener
        self._begin()
        if self.explorer.order.at is not None:
            self.listener = self.setup.place(*listener) or self.listener
        self.show()

    def close(self) -> None:
        """The page is gone."""
        self.closed = True
        self.pages.discard(self)
        self._cancel(*self.tasks.values())

    def _cancel(self, *tasks: "asyncio.Task[None]") -> None:
        for handle in (self.asked, self.resting, *tasks):
            if handle is not None:
                handle.cancel()

    def obey(self, message: Any) -> None:
        """Do what the page asks for; ValueError if that makes no sense."""
        if not isinstance(message, dict):
            raise ValueError("a message must be a table")
        turned = check_sliders(self.ends, message.get("turn", {}))
        if "play" in message:
            self.roll = bool(message["play"] == "roll")
            self.send({"kind": "sound", "uri": "", "note": "Computing the sound …"})
            self._start("listen", self._play)
        elif "keep" in message:
            self._start("keep", self._keep)
        elif "forget" in message:
            letter = message["forget"]
            if isinstance(letter, str) and letter in self.explorer.kept:  # or another page was faster
                self.explorer.forget(letter)
                self.mapper.ask(Explorer.forget, letter)
                for page in self.pages:
                    page.send({"kind": "forgotten", "letter": letter})
        elif "hit" in message:
            wanted = message["hit"]
            if not isinstance(wanted, dict) or not isinstance(wanted.get("letter"), str):
                raise ValueError("hit must be a table of letter and share")
            share = min(max(check.number("share", wanted.get("share")), 0.1), 10.0)  # of the speed
            self.hits.append((wanted["letter"][:1], share))
            self._start("hit", self._hit)
        elif "open" in message:
            try:
                self.order = order_of(message["open"], self.folder, self.order or self.explorer.order, self.settings.at)
            except ValueError as error:
                self.send({"kind": "bench", "failed": str(error)})
            else:
                self._start("open", self._open)
        elif "view" in message:
            view = message["view"]
            if view is not None and not isinstance(view, dict):
                raise ValueError("view must be a table of mass and stiffness")
            window = [None, None] if view is None else [pair("view", view.get(name)) for name in ("mass", "stiffness")]
            self.window = Window.of(self.setup, *window)
            self._start("map", self._map)
        else:
            if "ear" in message:
                self.ear = pair("ear", message["ear"])
            self.turned |= turned
            number = message.get("number", 0)
            self.last = number if isinstance(number, int) else 0
            if self.asked is None:
                self.asked = asyncio.get_running_loop().call_soon(self._answer)

    def _turn(self) -> tuple[bool, list[str]]:
        """Take over what the hand did; whether the blow changes, and what is to be said of it."""
        before, turned, notes = self.settings, self.turned, []
        self.turned = {}
        if self.ear is not None:
            listener = self.setup.place(*self.ear)
            if listener is None:
                notes.append(f"{place(self.ear[: len(before.at)])} is beside the body: the listening point stays.")
            self.listener, self.ear = listener or self.listener, None
        self.height = turned.pop("height", self.height)
        self.rate = turned.pop("rate", self.rate)
        at = [turned.pop(letter, None) for letter in "xy"]
        if any(value is not None for value in at):
            point = [old if new is None else new for old, new in zip(before.at, at)]
            turned_at = self.setup.place(*point)
            if turned_at is None:
                notes.append(f"{place(point)} is beside the body: the strike point stays.")
            elif self.setup.at_rest(turned_at):
                notes.append(f"The body does not move at {place(turned_at)}: it is held there.")
            self.settings = replace(self.settings, at=turned_at or before.at)
        changes: dict[str, Any] = dict(turned)
        self.settings = replace(self.settings, **changes)
        return self.settings != before or not self.number, notes

    def _answer(self) -> None:
        """What the hand looks at first: force and numbers; spectrum, threshold and scene follow at once."""
        self.asked = None
        again, notes = self._turn()
        self.number = number = self.last
        explorer, settings = self.explorer, self.settings
        said = explorer.describe_sliders(settings, self.height, self.rate)
        about = {"number": number, "said": said, "at": settings.at, "ear": self.listener, "note": " ".join(notes)}
        about |= {"mass": settings.mass, "stiffness": settings.stiffness}
        if not again:
            self.send({"kind": "blow", **about})
            self.send({"kind": "rest", "number": number})
            return
        self.judged = None
        try:
            message, hit = explorer.answer(settings)
            self.send({"kind": "blow", **about, **message})
            self.send({"kind": "rest", "number": number, **explorer.rest_of(settings, hit)})
        except (SimulationError, ValueError) as error:
            self.send({"kind": "blow", **about, "failed": str(error)})
            self.send({"kind": "rest", "number": number})
        if self.resting is not None:
            self.resting.cancel()
        self.resting = asyncio.get_running_loop().call_later(REST, self._rested)

    def _rested(self) -> None:
        self.resting = None
        self._start("judge", self._judge)
        self._start("map", self._map)

    def _start(self, name: str, work: Callable[[], Any]) -> None:
        """Begin a piece of work unless it is under way: then it looks itself whether there is more to do."""
        task = self.tasks.get(name)
        if task is None or task.done():
            self.tasks[name] = asyncio.get_running_loop().create_task(self._guarded(work))

    async def _guarded(self, work: Callable[[], Any]) -> None:
        try:
            await work()
        except (SimulationError, ValueError) as error:
            self.send({"kind": "note", "text": f"{error}."})

    async def _ask(self, worker: Worker, function: Callable[..., Any], *arguments: Any) -> Any:
        """The answer of a process; the page is informed if that had to be replaced."""
        ended = worker.ended
        answer = await asyncio.wrap_future(worker.ask(function, *arguments))
        if worker.ended > ended:
            note = "A process beside this page had ended; another one has taken its place."
            self.send({"kind": "note", "text": note})
        return answer

    async def _judge(self) -> None:
        """The exact blow, until it is the one on the page; finds out about a new strike point first."""
        while self.judged != self.settings and self.resting is None:
            settings = self.settings
            if settings.at not in self.explorer.views:
                view: View = await self._ask(self.judge, Explorer.look, settings.at)
                self.explorer.learn(settings.at, view)
                self.mapper.ask(Explorer.learn, settings.at, view)
                self._start("map", self._map)
            message = await self._ask(self.judge, Explorer.judge, settings)
            if settings == self.settings:
                self.judged = settings
                self.send({"kind": "blow", "number": self.number, "exact": True, **message})

    def _about_map(self) -> tuple[Any, ...]:
        """What the map depends on."""
        settings = replace(self.settings, mass=self.setup.start.mass, stiffness=1.0)
        return settings, self.window, self.settings.at in self.explorer.views

    async def _map(self) -> None:
        """The map in view, more and more finely, until nothing is left to refine."""
        while self.mapped != self._about_map() and self.resting is None:
            about = self._about_map()
            settings, window, _ = about
            self.mapped = None  # the page may soon show something else
            self.send({"kind": "map", "computing": True})
            try:
                await self._drawn(about, settings, window)
            except _Superseded:
                continue
            except (SimulationError, ValueError) as error:
                self.send({"kind": "map", "computing": False, "failed": str(error)})
            if about == self._about_map():
                self.mapped = about

    async def _drawn(self, about: tuple[Any, ...], settings: Settings, window: Window) -> None:
        """One map by a rough tolerance: coarse, finer, and with sharp borders; then these are struck pixel by pixel."""

        async def made(step: Callable[..., Picture], start: Window | Picture) -> Picture:
            found: Picture = await self._ask(self.mapper, Explorer.map, settings, step, start)
            if about != self._about_map():
                raise _Superseded
            return found

        def sent(picture: Picture, exact: bool = False) -> Picture:
            self.send({"kind": "map", "computing": not exact, "exact": exact, **drawn_map(picture)})
            return picture

        picture = sent(await made(Mapper.finer, sent(await made(Mapper.first, window))))
        sent(await made(Mapper.sharp, picture))
        picture = await made(Mapper.surer, picture)
        while not picture.finest:
            picture = await made(Mapper.finer, picture)
        sent(picture, exact=True)

    async def _keep(self) -> None:
        """Keep the present blow, judged and with its sound, under the first letter that is free."""
        explorer, settings, where, height = self.explorer, self.settings, self.listener, self.height
        found = await self._ask(self.judge, Explorer.judge, settings)
        sound = await self._ask(self.mapper, Explorer.listen, settings, where, height, None)
        letter = next((each for each in LETTERS if each not in explorer.kept), None)
        if "failed" in found or letter is None:
            many = f"{len(LETTERS)} blows are kept: forget one first."
            self.send({"kind": "note", "text": f"{found['failed']}." if "failed" in found else many})
            return
        order = explorer.order
        shown = {
            "kind": "kept", "letter": letter, "heading": self.setup.scene.title or self.setup.scene.path.stem,
            "words": f"{si(settings.mass, 'kg', 3)} with {si(settings.speed, 'm/s', 3)} at {place(settings.at)}",
            # the same for bodies whose points can be shown in one picture
            "body": f"{order.drawing.name if order.drawing else ''} {order.unit or ''}",
            "at": settings.at, "sound": sound, **found,
        }  # fmt: skip
        explorer.keep(letter, settings, where, height, shown)
        self.mapper.ask(Explorer.keep, letter, settings, where, height, {})
        for page in self.pages:
            page.send(shown)

    async def _hit(self) -> None:
        """The sounds of keys, one after another."""
        while self.hits:
            letter, share = self.hits.popleft()
            about = self.settings, self.listener, self.height, None, letter, share
            sound = await self._ask(self.mapper, Explorer.listen, *about)
            self.send({"kind": "hit", "letter": letter, "share": share, "number": self.number, **sound})

    async def _open(self) -> None:
        """What was ordered last."""
        while self.order is not None:
            order, self.order = self.order, None
            self.send({"kind": "bench"})
            try:
                setup: Setup = await self._ask(self.mapper, Explorer.open, order)  # a map waits for less
            except (SimulationError, ValueError) as error:
                self.send({"kind": "bench", "failed": str(error)})
                continue
            self.explorer.become(setup, order)
            self.judge.ask(Explorer.become, setup, order)
            for page in list(self.pages):
                page._restart()

    async def _play(self) -> None:
        """The sound that was asked for last."""
        while self.roll is not None:
            rate, self.roll = self.rate if self.roll else None, None
            try:
                sound = await self._ask(self.mapper, Explorer.listen, self.settings, self.listener, self.height, rate)
            except SimulationError as error:
                sound = {"uri": "", "note": f"{error}."}
            if self.roll is None:
                self.send({"kind": "sound", **sound})
