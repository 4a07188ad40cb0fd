"""A page in a headless Chromium that a test drives through the protocol of its developer tools, over two pipes."""

import base64
import fcntl
import itertools
import json
import os
import select
import subprocess
import sys
import time

CHROMIUMS = ("/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome")


def chromium():
    """The program; None if there is none."""
    return next((path for path in CHROMIUMS if os.access(path, os.X_OK)), None)


class Browser:
    """One page. It ends with the `with` block; `folder` gets its profile, Chromium `more` options."""

    def __init__(self, folder, *more):
        from_us, self._to = os.pipe()
        self._from, to_us = os.pipe()
        high = [fcntl.fcntl(fd, fcntl.F_DUPFD, 20) for fd in (from_us, to_us)]
        for fd in (from_us, to_us):
            os.close(fd)

        def as_chromium_wants():
            os.dup2(high[0], 3)
            os.dup2(high[1], 4)

        self._log = open(f"{folder}/chromium.txt", "w", encoding="utf-8")
        self._process = subprocess.Popen(
            [chromium(), "--headless", "--no-sandbox", "--disable-gpu-sandbox", "--use-gl=angle",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking",
             "--disable-component-update", "--disable-sync", "--no-first-run", "--remote-debugging-pipe",
             f"--user-data-dir={folder}/profile", *more, "about:blank"],
            preexec_fn=as_chromium_wants, pass_fds=(3, 4), stdout=self._log, stderr=self._log)
        for fd in high:
            os.close(fd)
        self._rest = b""
        self._numbers = itertools.count(1)
        self._session = None
        self.said = []  # by the page: its console, its errors, what its policy forbids
        target = next(one for one in self._call("Target.getTargets")["targetInfos"] if one["type"] == "page")
        self._session = self._call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self._call(f"{domain}.enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self._to)
        self._process.kill()
        self._process.wait()
        os.close(self._from)
        self._log.close()

    def _next(self):
        """The next message."""
        end = time.monotonic() + 120.0
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._from], [], [], max(0.0, end - time.monotonic()))
            piece = os.read(self._from, 1 << 20) if ready else b""
            if not piece:
                sys.exit("FAILED: Chromium does not answer")
            self._rest += piece
        message, self._rest = self._rest.split(b"\0", 1)
        return json.loads(message)

    def _call(self, method, **params):
        number = next(self._numbers)
        command = {"id": number, "method": method, "params": params}
        if self._session:
            command["sessionId"] = self._session
        os.write(self._to, json.dumps(command).encode() + b"\0")
        while True:
            message = self._next()
            if message.get("id") == number:
                if "error" in message:
                    sys.exit(f"FAILED: {method}: {message['error']['message']}")
                return message["result"]
            if message.get("method") in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"):
                self.said.append(json.dumps(message["params"]))

    def show(self, width, height, dark=False, scale=1):
        """The size of the window, and what the system wants."""
        self._call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale,
                   mobile=False)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._call("Emulation.setEmulatedMedia", features=[scheme])

    def open(self, url):
        """Whether a page is there. It is none if nobody answers."""
        self._call("Page.navigate", url=url)
        return self.wait_for(f"location.href === '{url}' && document.readyState === 'complete'", 60.0)

    def value(self, script):
        """What an expression is in the page."""
        result = self._call("Runtime.evaluate", expression=script, returnByValue=True)
        if "exceptionDetails" in result:
            sys.exit(f"FAILED: {script}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def text(self, name):
        """What an element says, by its id."""
        return self.value(f"document.getElementById('{name}').textContent")

    def wait_for(self, script, seconds=120.0):
        """Whether an expression becomes true in the page."""
        end = time.monotonic() + seconds
        while not self.value(script):
            if time.monotonic() > end:
                return False
            time.sleep(0.05)
        return True

    def drag(self, begin, end):
        """With the mouse, from one pixel of the window to another."""
        def mouse(kind, x, y, buttons):
            self._call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

        mouse("mousePressed", *begin, 1)
        for step in range(1, 5):
            mouse("mouseMoved", *(b + (e - b) * step / 4 for b, e in zip(begin, end)), 1)
        mouse("mouseReleased", *end, 0)

    def picture(self, path):
        """Writes what is seen, as PNG."""
        data = self._call("Page.captureScreenshot", format="png")["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))
