#!/usr/bin/env python3
"""How long `vantage live` takes from a scan to its pose, and what it needs, with robots that speak DDS.

A robot by Cyclone DDS drives to and fro; `vantage live` records it. `vantage localize` on the recording must give the
same poses. Then `vantage play` is the robot, by Fast DDS, with the same recording.

street: the recorded street, 10 scans of 40,000 points a second (twice its speed). campus: a simulated HDL-64E, 10
scans of 128,000 points a second, with an IMU (200 Hz) and odometry (20 Hz). At last, the localizer is killed and started
again while the robot drives: how long until it has a pose, beginning from the one that was kept.

usage: live.py BUILD_DIR SOURCE_DIR [--seconds N] [--only street|campus] [--keep FOLDER]
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../support"))
from running import IMU_OF_MOTION, config_for, output_of, resident  # noqa: E402

DOMAIN = "87"


class Live:
    """`vantage live`, and its resident memory over time."""

    def __init__(self, programs, config, *more):
        self.process = subprocess.Popen([f"{programs}/vantage-live", config, "--json", *more], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        self.said = []
        for line in self.process.stderr:
            self.said.append(line)
            if "ready in domain" in line:
                break
        else:
            sys.exit("error: " + "".join(self.said))
        self.begin = time.monotonic()
        self.resident = []  # s, MiB
        for work in (self._listen, self._watch):
            threading.Thread(target=work, daemon=True).start()

    def _listen(self):
        for line in self.process.stderr:
            self.said.append(line)

    def _watch(self):
        while self.process.poll() is None:
            size = resident(self.process.pid)
            if size is not None:
                self.resident.append((time.monotonic() - self.begin, size))
            time.sleep(1.0)

    def end(self):
        """What it printed."""
        time.sleep(1.0)
        self.process.send_signal(signal.SIGTERM)
        out = self.process.stdout.read()
        if self.process.wait() != 0:
            sys.exit(f"error: vantage live ended with {self.process.returncode}: {''.join(self.said)}")
        return json.loads(out)

    def memory(self):
        """Resident after a tenth of the time and at the end, and the most [MiB]."""
        last = self.resident[-1][0]
        early = next(size for at, size in self.resident if at >= 0.1 * last)
        return f"{early:.0f} / {self.resident[-1][1]:.0f} / {max(size for _, size in self.resident):.0f}"


def poses_of(path):
    """By stamp in ns: x, y, z, qx, qy, qz, qw as they are written."""
    found = {}
    for line in open(path, encoding="ascii"):
        words = line.split()
        if words and not line.startswith("#"):
            seconds, fraction = words[0].split(".")
            found[int(seconds) * 1_000_000_000 + int(fraction.ljust(9, "0")[:9])] = [float(w) for w in words[1:8]]
    return found


def largest_difference(published, localized):
    """Of numbers of poses with the same stamp (to 10 us), and how many have no partner."""
    rounded = {round(stamp, -4): pose for stamp, pose in localized.items()}
    largest, alone = 0.0, 0
    for stamp, pose in published.items():
        other = rounded.get(round(stamp, -4))
        if other is None:
            alone += 1
        else:
            largest = max(largest, max(abs(a - b) for a, b in zip(pose, other)))
    return largest, alone


def street(folder, programs, source):
    data = os.environ.get("VANTAGE_DATA_DIR", f"{source}/../shared/data") + "/kitti_street"
    if not os.path.isdir(data):
        print(f"street: SKIPPED, there is no {data}")
        return None
    config = f"{folder}/street.toml"
    text = config_for(f"{source}/configs/kitti_street/L20.toml", f"{data}/map.pcd", f"{folder}/street",
                      f"\n[live]\ndomain = {DOMAIN}\n")
    open(config, "w", encoding="utf-8").write(text)
    output_of(f"{programs}/vantage-build", config, "-q")
    output_of(f"{programs}/../tests/live_flatten", f"{data}/scans", f"{folder}/street.flat", "--truth",
              f"{data}/ref_poses_tum.txt")
    return config, f"{folder}/street.flat", ["--speed", "2"], []


def campus(folder, programs, source):
    output_of(f"{programs}/vantage-simulate", f"{source}/configs/simulate/motion.toml", "--out", f"{folder}/world",
              "-q", "--overwrite", "--set", 'lidar.model="hdl64"')
    config = f"{folder}/campus.toml"
    text = config_for(f"{source}/configs/demo/L20.toml", f"{folder}/world/map.pcd", f"{folder}/campus",
                      f"\n[live]\ndomain = {DOMAIN}\ntopics = {{ imu = \"/imu\", odometry = \"/odom\" }}\n")
    open(config, "w", encoding="utf-8").write(text)
    output_of(f"{programs}/vantage-build", config, "-q")
    output_of(f"{programs}/../tests/live_flatten", f"{folder}/world/scans", f"{folder}/campus.flat", "--imu",
              f"{folder}/world/imu.csv", "--odometry", f"{folder}/world/odometry.tum", "--truth",
              f"{folder}/world/reference.tum")
    return config, f"{folder}/campus.flat", [], ["--set", IMU_OF_MOTION]


def restarts(folder, programs, made):
    """From the start of the program to its first tracked pose [s], five times; then without a cache of files."""
    config, flat, speed, more = made
    more = more + ["--set", f"live.state_file={folder}/state.json"]
    live = Live(programs, config, *more)
    robot = subprocess.Popen([f"{programs}/../tests/live_robot", flat, f"{folder}/poses.txt", "--domain", DOMAIN,
                              "--seconds", "120", *speed], stdout=subprocess.DEVNULL)

    def wait_until_tracked():
        while not any(": tracked at" in line for line in live.said):
            if live.process.poll() is not None:
                sys.exit("error: " + "".join(live.said))
            time.sleep(0.001)

    wait_until_tracked()
    times = {}
    for drops_cache in [False, True] if os.geteuid() == 0 else [False]:
        times[drops_cache] = []
        for _ in range(5):
            time.sleep(2.0)  # a pose is kept once a second
            live.process.kill()
            live.process.wait()
            if drops_cache:
                os.sync()
                open("/proc/sys/vm/drop_caches", "w", encoding="ascii").write("3")
            begin = time.monotonic()
            live = Live(programs, config, *more)
            wait_until_tracked()
            times[drops_cache].append(time.monotonic() - begin)
    robot.kill()
    robot.wait()
    live.process.kill()
    live.process.wait()
    return times


HEADER = ("| world | sender | sent | received | tracked | scan to pose, ms: median / p99 / most | error, cm: median / "
          "p99 / most | resident, MiB: early / end / most |\n|---|---|---|---|---|---|---|---|")


def row(world, sender, sent, summary, delays, errors, memory):
    cells = [world, sender, sent, summary["scans"], summary["tracked"], delays, errors, memory]
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def run(world, made, folder, programs, seconds):
    config, flat, speed, more = made
    recording, poses = f"{folder}/run.mcap", f"{folder}/poses.txt"
    live = Live(programs, config, "--record", recording, *more)
    robot = output_of(f"{programs}/../tests/live_robot", flat, poses, "--domain", DOMAIN, "--seconds", str(seconds),
                      *speed)
    summary = live.end()
    found = json.loads(robot.splitlines()[-1])
    delay, error = found["delay_ms"], found["error_m"]
    row(world, "Cyclone DDS", found["sent"], summary,
        f"{delay['median']:.1f} / {delay['p99']:.1f} / {delay['max']:.1f}",
        f"{100 * error['median']:.1f} / {100 * error['p99']:.1f} / {100 * error['max']:.1f}", live.memory())
    said = live.said

    motion = ["--imu", "/imu", "--odometry", recording, "--odometry-topic", "/odom"] if more else []
    inputs = ["--scans", recording, "--topic", "/points", *motion]
    output_of(f"{programs}/vantage-localize", config, *inputs, "--initial-pose", "auto", "--out", f"{folder}/again",
              "-q", *more)
    largest, alone = largest_difference(poses_of(poses), poses_of(f"{folder}/again/trajectory.tum"))

    live = Live(programs, config, *more)
    begin = time.monotonic()
    played = json.loads(output_of(f"{programs}/vantage-play", config, *inputs, "--json", *more).splitlines()[-1])
    summary = live.end()
    delay = summary["delay_ms"]
    row(world, "Fast DDS (vantage play)", played["scans"], summary,
        f"{delay['median']:.1f} / {delay['p99']:.1f} / - (from its arrival)", "-", live.memory())
    print(f"\n{world}: the poses of `vantage localize` on the recording differ by {largest:.2g} at most; {alone} of "
          f"them are missing. The recording has {os.path.getsize(recording) / 2**20:,.0f} MiB and was played in "
          f"{time.monotonic() - begin:.0f} s. What `vantage live` said:")
    print("".join(said + ["-- played:\n"] + live.said), flush=True)
    os.remove(recording)
    for dropped, times in restarts(folder, programs, made).items():
        times.sort()
        print(f"{world}: first pose {times[len(times) // 2]:.2f} s after the program's start at the median, "
              f"{times[-1]:.2f} s at most{', files read from the disk' if dropped else ''}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("build")
    parser.add_argument("source")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each drive (60)")
    parser.add_argument("--only", choices=["street", "campus"])
    parser.add_argument("--keep", metavar="FOLDER", help="keeps what was made there")
    options = parser.parse_args()
    programs = os.path.abspath(options.build) + "/bin"
    source = os.path.abspath(options.source)
    with tempfile.TemporaryDirectory() as scratch:
        folder = os.path.abspath(options.keep) if options.keep else scratch
        os.makedirs(folder, exist_ok=True)
        print(HEADER, flush=True)
        for name, make in (("street", street), ("campus", campus)):
            if options.only in (None, name):
                made = make(folder, programs, source)
                if made:
                    run(name, made, folder, programs, options.seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
