#!/usr/bin/env python3
"""The page that `vantage live` serves, in a headless Chromium: it shows a robot that is localized, and sets its pose.

A simulated robot is played. The page must draw the map and the scan, show the state and a
pose near the truth, and give the localizer the pose that is dragged in it. The localizer is stopped and started again.
The page asks for nothing but itself and its messages, and its policy holds.

usage: page.py BUILD_DIR SOURCE_DIR [--pictures FOLDER]    (absolute paths)
"""

import math
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../support"))
from browser import Browser, chromium  # noqa: E402
from running import Live, make_small_campus  # noqa: E402

RIGHT = 0.3  # m
SKIPPED = 4  # exit code

MORE = """
[live]
domain = {domain}
motion_wait = 60.0
[live.topics]
imu = "/imu"
odometry = "/odom"
[live.foxglove]
port = {port}
"""


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def make_world(build, source, folder, port):
    """The truth: rows of stamp, x, y, z."""
    make_small_campus(build, source, folder, 0.1, MORE.format(domain=100 + os.getpid() % 100, port=port))
    rows = [line.split() for line in open(f"{folder}/world/reference.tum", encoding="ascii") if line[0] != "#"]
    return [[float(word) for word in row[:4]] for row in rows]


def play(build, folder, *more, config="world.toml"):
    return subprocess.Popen(
        [f"{build}/bin/vantage-play", config, "--scans", "world/scans", "--imu", "world/imu.csv", "--odometry",
         "world/odometry.tum", "-q", *more], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def main(build, source, pictures=None):
    if chromium() is None:
        print("SKIPPED: no Chromium to open the page in")
        return SKIPPED
    failures = []

    def expect(condition, text):
        if not condition:
            failures.append(text)

    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        truth = make_world(build, source, folder, port)
        live = Live(build, folder)
        robot = None
        try:
            with Browser(folder) as page:
                look(page, pictures, expect, live, port)
                robot = play_misfit(build, folder)
                misfit(page, expect)
                robot.kill()
                robot.wait()
                robot = play(build, folder, "--duration", "20")
                tracked(page, expect, truth)
                set_pose(page, pictures, expect, live)
                robot.wait()
                expect(page.wait_for("document.body.dataset.state === 'waits'"), "it does not tell that no scan comes")
                expect(page.wait_for("byId('reason').textContent.startsWith('no scan has come on /points for')"),
                       f"reason: {page.text('reason')}")
                page.value("byId('set').click()")
                expect(live.end(signal.SIGTERM)[0] == 0, "the localizer ended badly")
                expect(page.wait_for("document.body.dataset.state === 'offline'"), "it does not tell that all is gone")
                expect("while a pose was set" in page.text("notices"), f"notices: {page.text('notices')}")
                expect(page.value("byId('set').disabled"), "a pose can be set that nobody hears")
                live = Live(build, folder)
                live.wait_for("client is there")
                robot = play(build, folder, "--duration", "3", "--start", "5")
                expect(page.wait_for("document.body.dataset.state === 'tracked'"), "it does not come back")
                expect(not page.value("byId('set').disabled"), "no pose can be set after it came back")
                robot.wait()
                # That nobody listened for a while is all that the browser complained about.
                said = [one for one in page.said if "ERR_CONNECTION_REFUSED" not in one]
                expect(not said, f"the page said {said}")
                page.value("document.body.append(Object.assign(document.createElement('script'), {textContent: 'x'}))")
                page.value("fetch('http://127.0.0.1:1/').catch(() => { window.refused = true; })")
                expect(page.wait_for("window.refused"), "a foreign request is not refused")
                for kind in ("script", "connect"):
                    forbidden = f"Content Security Policy directive.*{kind}-src"
                    expect(any(re.search(forbidden, one) for one in page.said), f"a foreign {kind} is not forbidden")
            without_webgl(folder, expect, port)
        finally:
            for process in filter(None, (live.process, robot)):
                process.kill()
                process.wait()
    for text in failures:
        print("FAILED:", text)
    return 1 if failures else 0


def look(page, pictures, expect, live, port):
    """Opens the page before there is a robot."""
    page.show(1280, 800)
    for _ in range(3):  # a busy machine may give a page no WebGL because its renderer did not start in time
        expect(page.open(f"http://127.0.0.1:{port}/"), "there is no page")
        live.wait_for("client is there")
        if page.value("Boolean(view.gl)"):
            expect(page.wait_for("byId('reason').textContent === 'no scan has come on /points yet'"), page.text("reason"))
            return
    expect(False, f"no WebGL: {page.text('notices')}")


def play_misfit(build, folder):
    """A robot that sends something else than scans on the scans' topic."""
    text = open(f"{folder}/world.toml", encoding="utf-8").read()
    with open(f"{folder}/misfit.toml", "w", encoding="utf-8") as out:
        out.write(text.replace('imu = "/imu"', 'imu = "/points"\npoints = "/elsewhere"'))
    return play(build, folder, config="misfit.toml")


def misfit(page, expect):
    """The page says why no scan comes."""
    why = ("no scan has come on /points yet; a publisher of /points sends sensor_msgs/Imu, expected "
           "sensor_msgs/PointCloud2: none of its messages is received")
    expect(page.wait_for(f"byId('reason').textContent === '{why}'"), f"reason: {page.text('reason')}")
    expect("other type /points: 1" in page.text("left_out"), f"left out: {page.text('left_out')}")


def without_webgl(folder, expect, port):
    """A page that comes after the last scan, to a browser that cannot draw points."""
    other = f"{folder}/other"
    os.mkdir(other)
    with Browser(other, "--disable-3d-apis") as page:
        expect(page.open(f"http://127.0.0.1:{port}/"), "there is no second page")
        expect(page.wait_for("robot !== null && view.clouds.has('map')"), "the last pose and map do not come")
        expect("shows no WebGL" in page.text("notices"), f"notices: {page.text('notices')}")
        expect(page.text("position") != "–", "it has a pose and shows none")
        expect(page.text("state") == "waits", f"state: {page.text('state')}")
        expect(page.wait_for("path.length > 1"), "the path does not come")
        expect(page.wait_for(f"{pixels_of('--c0', LINES)} > 20", 20.0), "the path is not drawn")
        said = [one for one in page.said if "WebGL" not in one and "webgl" not in one]
        expect(not said, f"the page said {said}")


def tracked(page, expect, truth):
    """What a robot that is tracked looks like."""
    expect(page.wait_for("document.body.dataset.state === 'tracked'"), f"not tracked, but {page.text('state')}")
    drawn = "document.getElementById('drawn').dataset"
    expect(page.wait_for(f"{drawn}.map > 0 && {drawn}.scan > 0 && path.length > 1"), "no map, scan or path is drawn")
    # WebGL is in software here, so that 80,000 points of a map are drawn at most.
    points, count, words = page.value(f"[view.clouds.get('map').total, {drawn}.map, byId('drawn').textContent]")
    expect(points > 80000 and count == "80000", f"{count} of {points} points are drawn")
    expect(re.fullmatch(rf"map 80,000 of {points:,} points, scan [\d,]+ points", words), f"drawn: {words}")
    stamp, x, y, z = page.value("[robot.stamp, ...robot.pose.t]")
    nearest = min(truth, key=lambda row: abs(row[0] - stamp))
    expect(abs(nearest[0] - stamp) < 0.06 and math.dist(nearest[1:], (x, y, z)) < RIGHT,
           f"the robot is shown at {x}, {y}, {z} at {stamp} s, and was at {nearest}")
    shown = [float(word) for word in re.findall(r"-?\d+\.\d+", page.text("position"))]
    expect(len(shown) == 3 and math.dist(shown, (x, y, z)) < 5.0, f"position: {page.text('position')}")
    expect(0.0 <= float(page.text("risk")) <= 0.01, f"risk: {page.text('risk')}")
    expect(page.text("region") != "–", "no region")
    expect(re.fullmatch(r"[\d.]+ × [\d.]+ cm, [\d.]+°", page.text("within")), f"ellipse: {page.text('within')}")
    for name in ("delay", "computing"):
        expect(re.fullmatch(r"\d+\.\d ms", page.text(name)), f"{name}: {page.text(name)}")
    # The scan lies in the map: most points of it have one of the map, which is thinned, near them.
    fit = page.value(FIT)
    expect(fit > 0.9, f"{fit} of the scan is in the map")
    pixels = page.value(pixels_of("--c1", POINTS))
    expect(pixels > 500, f"{pixels} pixels have the scan's colour")


FIT = """(() => {
  const map = view.clouds.get('map'), scan = view.clouds.get('scan'), cells = new Set();
  const key = p => p.map(Math.floor).join();
  const at = (cloud, i) => [0, 1, 2].map(c => cloud.xyz[i + c] + cloud.origin[c]);
  for (let i = 0; i < map.xyz.length; i += 3) {
    const p = at(map, i);
    for (let corner = 0; corner < 8; ++corner) cells.add(key(p.map((x, c) => x + (corner >> c & 1) - 0.5)));
  }
  let found = 0, all = 0;
  for (let i = 0; i < scan.xyz.length; i += 3, ++all) {
    const p = rotate(scan.pose.q, at(scan, i)).map((x, c) => x + scan.pose.t[c]);
    found += cells.has(key(p));
  }
  return found / all;
})()"""

# What is drawn, as bytes of red, green, blue and opacity.
LINES = "view.pen.getImageData(0, 0, view.lines.width, view.lines.height).data"
POINTS = """(gl => {
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], pixels = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return pixels;
})(view.gl)"""


def pixels_of(colour, drawn):
    """An expression: how many pixels have a colour of the page."""
    return f"""(() => {{
  view.draw();
  const pixels = {drawn}, colour = css('{colour}').match(/\\w\\w/g).map(two => parseInt(two, 16));
  let count = 0;
  for (let i = 0; i < pixels.length; i += 4) {{
    count += pixels[i + 3] > 0 && colour.every((c, k) => Math.abs(c - pixels[i + k]) < 3);
  }}
  return count;
}})()"""


def set_pose(page, pictures, expect, live):
    """Drags a pose in the middle of the view, where the robot is while it is followed."""
    for name, (width, height, dark) in {"light": (1280, 800, False), "dark": (1280, 800, True),
                                        "narrow": (400, 850, False)}.items():
        page.show(width, height, dark)
        expect(page.value("document.documentElement.scrollWidth <= innerWidth"), f"{name}: wider than the window")
        if pictures:
            time.sleep(1.0)
            page.picture(f"{pictures}/page_{name}.png")
    page.show(1280, 800)
    page.value("document.getElementById('above').click()")
    page.value("document.getElementById('set').click()")
    place = page.value("(r => [r.left, r.top, r.width, r.height])(view.place.getBoundingClientRect())")
    x, y = place[0] + place[2] / 2, place[1] + place[3] / 2
    page.drag((x, y), (x, y))  # says no direction
    expect("Drag further" in page.text("hint"), f"hint: {page.text('hint')}")
    expect("a pose is given" not in live.text(), "a click without a direction gave a pose")
    page.drag((x, y), (x, y - 60))
    given = page.value("[...given.t, given.yaw]")
    expect(abs(given[3] - math.pi / 2) < 0.05, f"up the screen is {given[3]} rad")
    expect(page.value("document.getElementById('hint').hidden"), "it still sets a pose")
    live.wait_for("a pose is given")
    told = re.search(r"looks for the sensor at x (-?[\d.]+), y (-?[\d.]+)", live.text())
    expect(math.dist([float(one) for one in told.groups()], given[:2]) < 0.1, f"{told[0]}, given at {given}")
    expect(page.value("Math.hypot(given.t[0] - robot.pose.t[0], given.t[1] - robot.pose.t[1])") < 20.0,
           "the middle of the view is not where the robot is")


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3], *sys.argv[4:5]))
