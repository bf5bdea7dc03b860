"""Take screenshots of web pages with Chromium, using the DevTools protocol."""

import asyncio
import base64
import html
import itertools
import os
import shutil
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
from websockets.asyncio.client import ClientConnection, connect

from mjsim.support.files import write_text_atomically

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
SIZES = {"desk": (1280, 800), "phone": (390, 844)}  # window sizes, in pixels
MAX_HEIGHT = 6000  # maximum height of a screenshot, in pixels
SETTLE = 1.5  # delay that lets the scripts of a page run before a screenshot, in seconds
LOADING = 120.0  # timeout for loading a trial, in seconds
LOADED = "!document.querySelector('#play') || !!document.querySelector('#panel-actions button')"
HELP, OPEN_HELP = "help", "document.querySelector('#help-button').click()"
START = 120.0  # timeout for the start of the browser, in seconds


def browser() -> str | None:
    """Return the path of the Chromium executable, or None if Chromium is not installed."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)


class Camera:
    """A browser that takes screenshots of pages and saves them in a folder."""

    def __init__(self, socket: ClientConnection, folder: Path) -> None:
        self._socket, self._folder = socket, folder
        self._numbers = itertools.count(1)
        self._session = ""
        self.taken: list[str] = []

    async def open(self) -> None:
        tab = await self._ask("Target.createTarget", url="about:blank")
        attached = await self._ask("Target.attachToTarget", targetId=tab["targetId"], flatten=True)
        self._session = attached["sessionId"]

    async def photograph(self, name: str, url: str, content: str = "") -> None:
        """Take a screenshot of a whole page at each window size.

        Args:
            content: HTML to show instead of the page's own, such as the answer to a form.
        """
        self.taken.append(f"{len(self.taken) + 1:02d}-{name.replace(':', '-')}")
        for size, (width, height) in SIZES.items():
            screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": size == "phone"}
            await self._ask("Emulation.setDeviceMetricsOverride", **screen)
            await self._ask("Emulation.setTouchEmulationEnabled", enabled=size == "phone")
            await self._ask("Page.navigate", url=url)
            await self._settle()
            if content:
                tree = await self._ask("Page.getFrameTree")
                await self._ask(
                    "Page.setDocumentContent", frameId=tree["frameTree"]["frame"]["id"], html=content
                )
                await asyncio.sleep(SETTLE)
            if name == HELP:
                await self._ask("Runtime.evaluate", expression=OPEN_HELP)
            size_of_page = (await self._ask("Page.getLayoutMetrics"))["cssContentSize"]
            clip = {"x": 0, "y": 0, "width": width, "scale": 1}
            clip["height"] = min(max(height, size_of_page["height"]), MAX_HEIGHT)
            shot = await self._ask("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
            (self._folder / f"{self.taken[-1]}-{size}.png").write_bytes(base64.b64decode(shot["data"]))
        await self._ask("Page.navigate", url="about:blank")  # leaving the page ends the session of a trial

    async def _settle(self) -> None:
        loop = asyncio.get_running_loop()
        until = loop.time() + LOADING
        await asyncio.sleep(SETTLE)
        while loop.time() < until:
            found = await self._ask("Runtime.evaluate", expression=LOADED)
            if found["result"].get("value"):
                return
            await asyncio.sleep(0.2)

    async def _ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = next(self._numbers)
        asked = {"id": number, "method": method, "params": parameters}
        if self._session:
            asked["sessionId"] = self._session
        await self._socket.send(msgspec.json.encode(asked).decode())
        while True:
            said = msgspec.json.decode(await self._socket.recv())
            if said.get("id") == number:
                if "error" in said:
                    raise OSError(f"the browser cannot do {method}: {said['error'].get('message')}")
                result: dict[str, Any] = said["result"]
                return result


@asynccontextmanager
async def camera(program: str, folder: Path) -> AsyncIterator[Camera]:
    """Start a browser that saves screenshots in a folder. Raises OSError if it does not start."""
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = ["--headless", "--remote-debugging-port=0", f"--user-data-dir={profile}"]
        options += ["--hide-scrollbars", "--no-first-run", "--enable-unsafe-swiftshader"]
        if os.geteuid() == 0:  # Chromium's sandbox does not work for root
            options.append("--no-sandbox")
        quiet = asyncio.subprocess.DEVNULL
        process = await asyncio.create_subprocess_exec(program, *options, stdout=quiet, stderr=quiet)
        try:
            async with connect(await _address(Path(profile)), max_size=None) as socket:
                taking = Camera(socket, folder)
                await taking.open()
                yield taking
        finally:
            with suppress(ProcessLookupError):
                process.terminate()
            await process.wait()


async def _address(profile: Path) -> str:
    file, loop = profile / "DevToolsActivePort", asyncio.get_running_loop()
    until = loop.time() + START
    while loop.time() < until:
        with suppress(FileNotFoundError):
            if len(lines := file.read_text().split()) == 2:
                return f"ws://127.0.0.1:{lines[0]}{lines[1]}"
        await asyncio.sleep(0.05)
    raise OSError("the browser did not start")


def write_contact_sheet(folder: Path, names: Sequence[str], title: str) -> Path:
    """Write an HTML page that shows all screenshots, and return its path."""
    rows = "\n".join(
        f"<h2>{html.escape(name)}</h2><p>"
        + " ".join(
            f'<img src="{html.escape(name)}-{size}.png" alt="{html.escape(name)}, {size}">' for size in SIZES
        )
        for name in names
    )
    style = "body{font-family:sans-serif}img{max-height:40rem;max-width:60%;border:1px solid #999;vertical-align:top}"
    head = f"<title>{html.escape(title)}</title><style>{style}</style>"
    write_text_atomically(folder / "index.html", f"<!doctype html>\n<html><meta charset=utf-8>{head}{rows}\n")
    return folder / "index.html"
