"""A headless Chromium, driven through its debugging pipe: no driver and no package besides the browser itself."""

import base64
import json
import os
import shutil
import subprocess
import tempfile
import time

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (  # software rendering, and nothing that asks the network
    "--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--hide-scrollbars", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--remote-debugging-pipe",
)  # fmt: skip


class Browser:
    """Use as a context: `open` a page, then take `picture`s of it (PNG bytes)."""

    def __init__(self, width: int = 1200, height: int = 900):
        self._size = {"width": width, "height": height}
        self._number, self._buffer = 0, b""

    def __enter__(self):
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        read_there, self._write = os.pipe()
        self._read, write_there = os.pipe()
        script = f"exec {CHROMIUM} {' '.join(FLAGS)} --user-data-dir={self._profile.name} about:blank"
        wired = f"{script} 3<&{read_there} 4>&{write_there}"  # Chromium reads from 3 and writes to 4
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._process = subprocess.Popen(["bash", "-c", wired], pass_fds=(read_there, write_there), **quiet)
        os.close(read_there)
        os.close(write_there)
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(20)
        os.close(self._read)
        os.close(self._write)
        self._profile.cleanup()

    def open(self, url: str) -> None:
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self._ask("Emulation.setDeviceMetricsOverride", **self._size, deviceScaleFactor=1, mobile=False)
        self._ask("Page.navigate", url=url)

    def picture(self, whole: bool = False) -> bytes:
        """PNG of what is in view, or of the whole page."""
        extra = {"captureBeyondViewport": True}
        if whole:
            size = self._ask("Page.getLayoutMetrics")["cssContentSize"]
            extra["clip"] = {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}
        return base64.b64decode(self._ask("Page.captureScreenshot", format="png", **(extra if whole else {}))["data"])

    def settled(self, seconds: float = 60.0, every: float = 2.0) -> bytes:
        """The picture once two in a row are the same and show more than a plain page; the last one after `seconds`."""
        end, last = time.monotonic() + seconds, b""
        while time.monotonic() < end:
            time.sleep(every)
            now = self.picture()
            if now == last and len(now) > 20_000:
                break
            last = now
        return now

    def _ask(self, method: str, **parameters) -> dict:
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if hasattr(self, "_session"):
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self._buffer:
                part = os.read(self._read, 1 << 16)
                if not part:
                    raise RuntimeError("the browser has closed")
                self._buffer += part
            answer, _, self._buffer = self._buffer.partition(b"\0")
            answer = json.loads(answer)
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
