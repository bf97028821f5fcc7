"""Chromium, driven through a pipe by the DevTools protocol."""

import base64
import fcntl
import json
import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader, FileIO
from pathlib import Path
from typing import Any

from conftest import require

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-dev-shm-usage",
    "--allow-pre-commit-input",  # else clicks before a page's first paint are discarded
)
DRAWN = "[...document.querySelectorAll('.chart')].every((chart) => chart.firstElementChild?.shadowRoot)"
CHARTS = f"(!document.querySelector('.chart') || globalThis.Bokeh?.documents[0]?.is_idle && {DRAWN})"
READY = f"document.readyState === 'complete' && {CHARTS}"


class Browser:
    """One page without a network. Records the addresses it requests, and its errors and warnings."""

    def __init__(self, commands: FileIO, answers: BufferedReader) -> None:
        self._commands = commands
        self._answers = answers
        self._received = b""
        self._sent = 0
        self._session: str | None = None
        self.requests: list[str] = []
        self.errors: list[str] = []

    def open(self) -> None:
        self._page = self._attach(self.call("Target.createTarget", url="about:blank")["targetId"])
        self.call("Page.enable")

    def _attach(self, target: str) -> str:
        """Send commands to a page, or to a frame that has its own process."""
        self._session = None
        self._session = str(self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"])
        for domain in ("Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=0, uploadThroughput=0)
        return self._session

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command, and wait for its result."""
        self._sent += 1
        message = {"id": self._sent, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        self._commands.write(json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._sent:
                assert "error" not in answer, (method, answer["error"])
                result: dict[str, Any] = answer["result"]
                return result

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._received:
            read = self._answers.read1(1 << 20)
            assert read, "Chromium has ended"
            self._received += read
        one, _, self._received = self._received.partition(b"\0")
        message: dict[str, Any] = json.loads(one)
        self._record(message)
        return message

    def _record(self, message: dict[str, Any]) -> None:
        event = message.get("params", {})
        match message.get("method"):
            case "Network.requestWillBeSent" if not event["request"]["url"].startswith("data:"):
                self.requests.append(event["request"]["url"])
            case "Runtime.consoleAPICalled" if event["type"] in ("error", "warning", "assert"):
                self.errors.append(str(event["args"]))
            case "Runtime.exceptionThrown":
                self.errors.append(event["exceptionDetails"]["exception"]["description"])
            case "Log.entryAdded" if event["entry"]["level"] in ("error", "warning"):
                self.errors.append(str(event["entry"]))

    def visit(self, page: Path, width: int = 1280, height: int = 800) -> None:
        """Load a page, and wait until its charts are drawn."""
        self.requests.clear()
        self.errors.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=page.as_uri())
        self.wait_for(READY)

    def run(self, script: str) -> Any:
        """Run a script in the page, and return its value."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait_for(self, script: str) -> None:
        """Wait until the value of a script is true: at least 30 s, for slow machines."""
        for _ in range(600):
            if self.run(script):
                return
            time.sleep(0.05)
        raise AssertionError(f"timeout while waiting for {script}")

    def click(self, selector: str, x: float = 0.5, y: float = 0.5) -> None:
        """Click on an element with the mouse, at fractions of its width and height."""
        left, top, width, height = self.run(
            f"(() => {{ const it = document.querySelector({json.dumps(selector)});"
            "it.scrollIntoView({block: 'center'});"
            "const box = it.getBoundingClientRect(); return [box.left, box.top, box.width, box.height] })()"
        )
        at = {"x": left + x * width, "y": top + y * height, "button": "left", "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type="mousePressed", **at)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", **at)

    def show_on(self, medium: str) -> None:
        """Emulate a medium of CSS: "screen", or "print" for paper."""
        self.call("Emulation.setEmulatedMedia", media=medium)

    def picture(self, path: Path) -> None:
        """Save a picture of the whole page."""
        screenshot = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(screenshot["data"]))


@contextmanager
def chromium(folder: Path) -> Iterator[Browser]:
    """Start Chromium with its profile in a folder."""
    require("chromium", "bash")
    ends = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in (*os.pipe(), *os.pipe())]
    read_commands, commands, answers, write_answers = ends
    script = f'exec 3<&{read_commands} 4>&{write_answers}; exec chromium "$@"'
    command = ["bash", "-c", script, "chromium", *FLAGS, f"--user-data-dir={folder}", "--remote-debugging-pipe"]
    with subprocess.Popen(command, pass_fds=[read_commands, write_answers], stderr=subprocess.DEVNULL) as process:
        os.close(read_commands)
        os.close(write_answers)
        try:
            with os.fdopen(commands, "wb", buffering=0) as write, os.fdopen(answers, "rb") as read:
                browser = Browser(write, read)
                browser.open()
                yield browser
                browser.call("Browser.close")
        finally:
            process.terminate()
