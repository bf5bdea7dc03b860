"""Stock Firefox, driven by the protocol that it speaks itself (WebDriver BiDi): pages, real key events, screenshots."""

import base64
import json
import re
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

from websockets.sync.client import connect

from benchmarks.support.play_server import PATIENCE

FIREFOX = next(
    (path for path in (Path("/usr/bin/firefox"), Path("/usr/bin/firefox-esr")) if path.is_file()), None
)
KEYS = {"Enter": "\ue007", "Escape": "\ue00c", "ArrowLeft": "\ue012", "ArrowRight": "\ue014"}  # of WebDriver


class Firefox:
    """One window of Firefox without a screen, from entering the context until leaving it.

    Args:
        profile: An empty folder for its profile.
    """

    def __init__(self, profile: Path) -> None:
        self._profile = profile
        self._open = ExitStack()
        self._count = 0

    def goto(self, url: str) -> None:
        """Open a page and wait until it is loaded."""
        self._ask("browsingContext.navigate", context=self._context, url=url, wait="complete")

    def evaluate(self, expression: str) -> Any:
        """Value of a JavaScript expression: a text, number, truth value or null."""
        target = {"context": self._context}
        answer = self._ask("script.evaluate", expression=expression, target=target, awaitPromise=True)
        if answer["type"] != "success":
            raise ValueError(answer["exceptionDetails"]["text"])
        return answer["result"].get("value")

    def wait_for(self, expression: str) -> None:
        """Wait until a JavaScript expression holds.

        Raises:
            TimeoutError: It does not.
        """
        until = time.monotonic() + PATIENCE
        while not self.evaluate(f"Boolean({expression})"):
            if time.monotonic() > until:
                raise TimeoutError(f"{expression} does not hold: {self.evaluate('document.body.innerText')}")
            time.sleep(0.1)

    def hold(self, key: str, seconds: float = 0.05) -> None:
        """Press a key and let it go after so many seconds."""
        value = KEYS.get(key, key)
        actions = [
            {"type": "keyDown", "value": value},
            {"type": "pause", "duration": round(1000 * seconds)},
            {"type": "keyUp", "value": value},
        ]
        self._ask(
            "input.performActions",
            context=self._context,
            actions=[{"type": "key", "id": "keys", "actions": actions}],
        )

    def screenshot(self, path: Path) -> None:
        """Write a PNG of what the window shows."""
        answer = self._ask("browsingContext.captureScreenshot", context=self._context)
        path.write_bytes(base64.b64decode(answer["data"]))

    def _ask(self, method: str, **params: Any) -> Any:
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": params}))
        while True:
            answer = json.loads(self._socket.recv(timeout=PATIENCE))
            if answer.get("id") == self._count:
                break
        if answer["type"] == "error":
            raise ValueError(f"{method}: {answer['message']}")
        return answer["result"]

    def __enter__(self) -> "Firefox":
        command = [str(FIREFOX), "--headless", "--no-remote", "--remote-debugging-port", "0"]
        said = self._profile / "said.txt"
        with said.open("wb") as output:
            self._process = subprocess.Popen(
                [*command, "--profile", str(self._profile)], stdout=output, stderr=subprocess.STDOUT
            )
        until = time.monotonic() + PATIENCE
        while not (address := re.search(r"BiDi listening on (ws://\S+)", said.read_text())):
            if self._process.poll() is not None or time.monotonic() > until:
                raise ChildProcessError(f"Firefox did not start: {said.read_text()}")
            time.sleep(0.1)
        self._socket = self._open.enter_context(connect(f"{address[1]}/session", max_size=None))
        self._ask("session.new", capabilities={})
        tab = self._ask("browsingContext.create", type="tab")  # the first one never has the focus
        self._context = tab["context"]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        self._process.wait(PATIENCE)
        self._open.close()
