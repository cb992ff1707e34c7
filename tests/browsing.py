"""A page in a real browser."""

import time


class Page:
    """A page in the browser, and what it complained about or asked for."""

    def __init__(self, browser, *, width=1280, height=900, **options):
        self.context = browser.new_context(viewport={"width": width, "height": height}, **options)
        self.context.set_default_timeout(300e3)  # [ms] a busy machine may take its time
        self.tab = self.context.new_page()
        self.errors, self.requests = [], []
        self.tab.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.tab.on("pageerror", lambda error: self.errors.append(str(error)))
        self.tab.on("request", lambda request: self.requests.append(request.url))
        self.tab.on("websocket", lambda socket: self.requests.append(socket.url))

    def until(self, expression, seconds=120.0):
        """Wait until a JavaScript expression holds; Playwright's own way needs eval, which pages may forbid."""
        end = time.monotonic() + seconds
        while not self.tab.evaluate(expression):
            assert time.monotonic() < end, f"not within {seconds} s: {expression}"
            self.tab.wait_for_timeout(20)

    def box(self, plot):
        """Place and size of a picture that is scrolled into view."""
        canvas = self.tab.locator(f"#{plot}-plot")
        canvas.scroll_into_view_if_needed()
        return canvas.bounding_box()

    def assert_fits(self, width):
        """Nothing is wider than the page, and no text is cut off."""
        assert self.tab.evaluate("document.documentElement.scrollWidth") == width
        wide = "e => e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0"
        cut = f"[...document.querySelectorAll('main *')].filter({wide}).map(e => e.outerHTML.slice(0, 80))"
        assert self.tab.evaluate(cut) == []

    def tabbed_to(self, most=200):
        """Press Tab until the focus comes round; what it stopped at, and whether each could be seen to have it."""
        stops = []
        self.tab.bring_to_front()
        for _ in range(most):
            self.tab.keyboard.press("Tab")
            stop = self.tab.evaluate(
                """() => {
                    let e = document.activeElement;
                    while (e.shadowRoot?.activeElement) e = e.shadowRoot.activeElement;
                    const style = getComputedStyle(e);
                    const shown = style.outlineStyle !== 'none' || style.boxShadow !== 'none' || e.tagName === 'AUDIO';
                    const name = e.id || e.getAttribute('aria-label') || e.textContent.trim().slice(0, 30);
                    return [e.tagName, name, shown];
                }"""
            )
            if stops and (stop[0] == "BODY" or stop == stops[0]):
                break
            if stop[0] != "BODY":  # a page that has just come may not have the focus yet
                stops.append(stop)
        return stops
