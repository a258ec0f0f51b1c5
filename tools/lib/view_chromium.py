"""Opens a page of `swell view` in Chromium as a person would, and holds what is seen against the pictures that were given.

Speaks Chromium's DevTools protocol over pipes: the standard library is all that it takes.

    python view_chromium.py CHROMIUM PAGE PICTURES [PICTURES] [--wrong] [--screenshot FILE]

Exit codes: 0 what is seen is what it should be, 1 it is not. With --wrong each picture is held against its neighbour's, which has to be
noticed: 1 is the right end then.
"""

import base64
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time
import zlib


class Chromium:
    """A headless browser with one page; it ends with the `with` block."""

    def __init__(self, program, size):
        self.room = tempfile.TemporaryDirectory()
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()

        def pipes():
            # Chromium reads from 3 and writes to 4, which may be in use here: first both go where nothing is.
            os.dup2(theirs_in, 103), os.dup2(theirs_out, 104)
            os.dup2(103, 3), os.dup2(104, 4)

        arguments = [
            program, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", f"--user-data-dir={self.room.name}",
            "--force-color-profile=srgb", "--force-device-scale-factor=1", "--hide-scrollbars", f"--window-size={size[0]},{size[1]}",
            "--no-first-run", "--disable-dev-shm-usage", "about:blank",
        ]
        self.process = subprocess.Popen(
            arguments, preexec_fn=pipes, close_fds=False, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(theirs_in), os.close(theirs_out)
        self.reader, self.writer = os.fdopen(ours_in, "rb"), os.fdopen(ours_out, "wb")
        self.count, self.buffer, self.session, self.asked, self.told = 0, b"", None, [], []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.reader.close(), self.writer.close()
        time.sleep(0.2)
        try:
            self.room.cleanup()
        except OSError:
            pass

    def call(self, method, **parameters):
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.writer.write(json.dumps(message).encode() + b"\0")
        self.writer.flush()
        while True:
            answer = self.next()
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise SystemExit(f"{method}: {answer['error']}")
                return answer["result"]

    def next(self):
        while b"\0" not in self.buffer:
            more = os.read(self.reader.fileno(), 1 << 16)
            if not more:
                raise SystemExit("Chromium has ended")
            self.buffer += more
        line, self.buffer = self.buffer.split(b"\0", 1)
        answer = json.loads(line)
        method, parameters = answer.get("method"), answer.get("params", {})
        if method == "Network.requestWillBeSent":
            self.asked.append(parameters["request"]["url"][:200])
        if method == "Runtime.exceptionThrown":
            self.told.append(parameters["exceptionDetails"].get("exception", {}).get("description", "an exception"))
        if method == "Log.entryAdded":
            self.told.append(parameters["entry"]["text"])
        return answer

    def js(self, text):
        found = self.call("Runtime.evaluate", expression=text, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise SystemExit(f"{text}: {found['exceptionDetails']}")
        return found["result"].get("value")

    def until(self, text, what):
        for _ in range(200):
            if self.js(text):
                return
            time.sleep(0.05)
        raise SystemExit(f"{what}: not within 10 s ({text} is {self.js(text)})")

    def box(self, name):
        return self.js(f"(() => {{ const b = document.getElementById('{name}').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; }})()")

    def mouse(self, kind, x, y, buttons=0):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left" if buttons or kind == "mouseReleased" else "none", buttons=buttons, clickCount=1)

    def drag(self, *places):
        self.mouse("mousePressed", *places[0], buttons=1)
        for place in places[1:]:
            self.mouse("mouseMoved", *place, buttons=1)
        self.mouse("mouseReleased", *places[-1])

    def click(self, name):
        left, top, width, height = self.box(name)
        self.drag((left + width / 2, top + height / 2))

    def key(self, key):
        text = key if len(key) == 1 else None
        extra = {"text": text} if text else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, **extra)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)

    def screenshot(self, clip=None):
        extra = {"clip": dict(zip(("x", "y", "width", "height"), clip), scale=1)} if clip else {}
        return base64.b64decode(self.call("Page.captureScreenshot", format="png", **extra)["data"])


def pixels(png):
    """Width, height and rows of RGB of an 8-bit PNG that is not interlaced."""
    at, data, width, height, kind = 8, b"", 0, 0, 0
    while at < len(png):
        length, name = struct.unpack(">I4s", png[at : at + 8])
        body = png[at + 8 : at + 8 + length]
        if name == b"IHDR":
            width, height, depth, kind, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            assert depth == 8 and kind in (2, 6) and not interlaced
        if name == b"IDAT":
            data += body
        at += 12 + length
    channels = {2: 3, 6: 4}[kind]
    raw, stride, rows, before = zlib.decompress(data), width * channels, [], bytes(width * channels)
    for row in range(height):
        filtered, line = raw[row * (stride + 1)], bytearray(raw[row * (stride + 1) + 1 : (row + 1) * (stride + 1)])
        for k in range(stride):
            left = line[k - channels] if k >= channels else 0
            up, corner = before[k], before[k - channels] if k >= channels else 0
            if filtered == 1:
                line[k] = (line[k] + left) & 255
            elif filtered == 2:
                line[k] = (line[k] + up) & 255
            elif filtered == 3:
                line[k] = (line[k] + (left + up) // 2) & 255
            elif filtered == 4:
                guess = left + up - corner
                a, b, c = abs(guess - left), abs(guess - up), abs(guess - corner)
                line[k] = (line[k] + (left if a <= b and a <= c else up if b <= c else corner)) & 255
        before = bytes(line)
        rows.append(before if channels == 3 else bytes(x for k, x in enumerate(before) if k % 4 != 3))
    return width, height, rows


def columns(rows, begin, end):
    return [row[3 * begin : 3 * end] for row in rows]


class Checks:
    def __init__(self):
        self.faults = 0

    def holds(self, is_so, what):
        print(f"{'ok' if is_so else 'FAILED'}: {what}")
        self.faults += not is_so


def main():
    words = sys.argv[1:]
    wrong = "--wrong" in words
    words = [word for word in words if word != "--wrong"]
    shot = words.pop(words.index("--screenshot") + 1) if "--screenshot" in words else None
    words = [word for word in words if word != "--screenshot"]
    program, page, *folders = words
    checks = Checks()
    with Chromium(program, (1400, 1000)) as web:
        web.call("Page.navigate", url=pathlib.Path(page).resolve().as_uri())
        web.until("document.readyState === 'complete' && document.body.dataset.shown !== undefined", "the first picture")
        labels = web.js("data.labels")
        name = sorted(pathlib.Path(folders[0]).glob("*.png"))[0].name.split(".")[0]

        def wanted(folder, label):
            if wrong:
                label = labels[(labels.index(label) + 1) % len(labels)]
            return pixels((pathlib.Path(folder) / f"{name}.{int(label):04}.png").read_bytes())

        def seen():
            """The picture as it stands on the screen, a pixel of it a pixel there."""
            left, top, width, height = web.box("picture")
            assert (left, top) == (int(left), int(top)), (left, top)
            return pixels(web.screenshot((left, top, width, height)))

        def is_at(k, how):
            web.until(f"document.body.dataset.shown === data.labels[{k}] && document.getElementById('scrub').value == {k}", how)
            found = seen()
            sets = [wanted(folder, labels[k]) for folder in folders]
            rows = [b"".join(row) for row in zip(*(one[2] for one in sets))]
            checks.holds(found[2] == rows, f"{how}: what is seen is {labels[k]}, pixel by pixel")

        # A pixel of the picture is one of the screen.
        web.key("z")
        # Text above it and the middle of its stage are not at whole pixels.
        web.js("picture.style.margin = '0'; { const top = stage.getBoundingClientRect().top; stage.style.top = Math.ceil(top) - top + 'px'; }")
        is_at(0, "opened")
        left, top, width, height = web.box("scrub")
        # A range's thumb is 16 pixels wide, and its middle goes from 8 to width - 8.
        place = lambda k: (left + 8 + (width - 16) * k / (len(labels) - 1), top + height / 2)
        last = len(labels) - 1
        middle = last // 2
        web.drag(place(0), place(1), place(middle))
        is_at(middle, "scrubber dragged to the middle")
        web.drag(place(last))
        is_at(last, "scrubber clicked at the end")
        web.key("Home")
        is_at(0, "Home")
        web.key("ArrowRight"), web.key("ArrowRight"), web.key("ArrowLeft")
        is_at(1, "right, right, left")
        web.key("End")
        is_at(last, "End")
        web.js(f"location.hash = '#{labels[2]}'")
        is_at(2, "an address with a frame's number")
        for _ in range(2):
            web.click("on")
        is_at(4, "the button +1, twice")
        # Playing: every frame is drawn in turn, at about the rate that is asked for.
        web.js("window.had = []; { const old = draw; draw = (k) => { old(k); had.push([k, performance.now()]); }; }")
        web.key("Home")
        web.until("document.body.dataset.shown === data.labels[0]", "Home")
        web.js("document.getElementById('rate').value = 20; document.getElementById('loop').checked = false; had.length = 0")
        web.key(" ")
        web.until("!playing && had.length > 0", "played to its end")
        had = web.js("had")
        checks.holds([k for k, _ in had][-last:] == list(range(1, last + 1)), f"played: {len(had)} frames, each once, in turn")
        rate = 1000 * (len(had) - 2) / (had[-1][1] - had[1][1])
        checks.holds(10 < rate < 21, f"played at {rate:.1f} of 20 frames a second")
        is_at(last, "played to its end")
        curves = web.js("document.querySelectorAll('#curves figure').length")
        if curves:
            for k in (0, middle, last):
                web.js(f"show({k})")
                time_of = web.js(f"data.times[{k}]")
                at = web.js("(() => { const f = document.querySelector('#curves figure'), b = f.getBoundingClientRect(), c = f.querySelector('i').getBoundingClientRect(); return (c.left + c.width / 2 - b.left) / b.width; })()")
                # Against the curve's own axis: where the SVG has the same instant.
                (first, end), (begin, stop) = json.loads(web.js("document.querySelector('#curves figure').dataset.across"))
                hold = begin + (time_of - first) / (end - first) * (stop - begin)
                checks.holds(abs(at - hold) < 2e-3, f"{curves} curves: the cursor stands at {time_of:.3f} s")
            web.js("document.querySelector('#curves figure').scrollIntoView()")
            b = web.js("(() => { const b = document.querySelector('#curves figure').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()")
            instant = web.js(f"data.times[{middle}]")
            x = b[0] + b[2] * (begin + (instant - first) / (end - first) * (stop - begin))
            web.drag((x, b[1] + b[3] / 2))
            web.js("scrollTo(0, 0)")
            is_at(middle, "a click on a curve")
        if len(folders) == 2:
            two(web, checks, seen, wanted, folders, labels[middle], middle)
        checks.holds(all(url.startswith(("file:", "data:")) for url in web.asked) and web.asked, f"{len(web.asked)} requests, none to a network")
        checks.holds(not web.told, f"the console is empty{': ' + '; '.join(web.told) if web.told else ''}")
        if shot:
            web.js("picture.style.margin = stage.style.top = ''")
            web.key("z")
            web.js(f"show({middle})")
            time.sleep(0.5)
            pathlib.Path(shot).write_bytes(web.screenshot())
    print(f"{checks.faults} faults")
    return 1 if checks.faults else 0


def two(web, checks, seen, wanted, folders, label, k):
    """One of both alone, wipe and difference."""
    web.js(f"show({k})")
    a, b = (wanted(folder, label) for folder in folders)
    shown = f"document.body.dataset.shown === data.labels[{k}]"
    for key, one in (("1", a), ("2", b)):
        web.key(key)
        web.until(f"mode === '{'ab'[int(key) - 1]}' && canvas.width === {a[0]} && {shown}", key)
        time.sleep(0.2)
        checks.holds(seen()[2] == one[2], f"key {key}: one of both alone")
    web.key("w")
    web.until(f"mode === 'wipe' && {shown}", "wipe")
    left, top, width, height = web.box("picture")
    edge = a[0] // 4
    web.drag((left + width / 2, top + 50), (left + width / 3, top + 60), (left + edge, top + 60))
    time.sleep(0.2)
    found = seen()[2]
    is_left = columns(found, 0, edge - 1) == columns(a[2], 0, edge - 1)
    is_right = columns(found, edge + 1, a[0]) == columns(b[2], edge + 1, a[0])
    checks.holds(is_left and is_right, f"wipe dragged to column {edge}: one to its left, the other to its right")
    web.key("d")
    web.until(f"mode === 'difference' && {shown}", "difference")
    time.sleep(0.2)
    hold = [bytes(abs(x - y) for x, y in zip(r, s)) for r, s in zip(a[2], b[2])]
    checks.holds(seen()[2] == hold, "difference: |a - b| at each pixel")
    web.key("s")
    web.until(f"mode === 'side' && {shown}", "side by side")


if __name__ == "__main__":
    sys.exit(main())
