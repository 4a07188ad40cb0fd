#!/usr/bin/env python3
"""What goes wrong on a robot: a robot in one network namespace, `vantage live` in another, a switch between them.

The robot speaks DDS by Cyclone DDS. It is killed, its cable is pulled, its clock jumps, it is carried away, it sends
ten times as many scans as usual; the disk of the recording is full; the localizer is killed, and started before its
network. After each, the robot's poses must be right again, and the localizer must have told what happened and must not
have grown. Of all poses, no more than `max_risk` promises may have been off by more than the alert limit.

usage: faults.py BUILD_DIR SOURCE_DIR    (needs root)
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../support"))
from running import Live, make_small_campus, output_of, resident  # noqa: E402

RIGHT = 0.3  # m
ALERT_LIMIT, MAX_RISK = 0.5, 0.01  # m; the defaults of [localizer]
GROWTH = 16.0  # MiB
SKIPPED = 4  # exit code

MORE = """
[live]
domain = 7
state_file = "state.json"
topics = { imu = "/imu", odometry = "/odom" }
"""


class Network:
    """Two namespaces, and a switch in a third. It ends with the `with` block."""

    def __init__(self):
        self.names = {name: f"vantage_{name}_{os.getpid()}" for name in ("robot", "localizer", "switch")}

    def __enter__(self):
        ip = lambda *words: output_of("ip", *words)
        for name in self.names.values():
            ip("netns", "add", name)
            ip("-n", name, "link", "set", "lo", "up")
        switch = self.names["switch"]
        ip("-n", switch, "link", "add", "name", "br0", "type", "bridge", "mcast_snooping", "0")
        ip("-n", switch, "link", "set", "br0", "up")
        for number, end in enumerate(("robot", "localizer"), 1):
            ip("-n", switch, "link", "add", "name", end, "type", "veth", "peer", "name", "eth0",
               "netns", self.names[end])
            ip("-n", switch, "link", "set", end, "master", "br0", "up")
            ip("-n", self.names[end], "address", "add", f"10.97.0.{number}/24", "dev", "eth0")
            ip("-n", self.names[end], "link", "set", "eth0", "up")
        return self

    def __exit__(self, *_):
        for name in self.names.values():
            subprocess.run(["ip", "netns", "delete", name], check=False)

    def inside(self, end, *command):
        return ["ip", "netns", "exec", self.names[end], *command]

    def cable(self, state):
        """Of the robot: up or down."""
        output_of("ip", "-n", self.names["switch"], "link", "set", "robot", state)

    def interface(self, end, state):
        """Of an end: up or down."""
        output_of("ip", "-n", self.names[end], "link", "set", "eth0", state)


class Robot:
    def __init__(self, network, build, folder, *more, flat="world.flat"):
        self.process = subprocess.Popen(
            network.inside("robot", f"{build}/tests/live_robot", flat, "poses.txt", "--domain", "7", *more),
            cwd=folder, stdout=subprocess.PIPE, text=True)

    def end(self):
        out, _ = self.process.communicate()
        if self.process.returncode != 0:
            sys.exit(f"FAILED: the robot ended with {self.process.returncode}: {out}")
        return json.loads(out.splitlines()[-1])

    def kill(self):
        self.process.kill()
        self.process.wait()


def make_world(build, source, folder):
    make_small_campus(build, source, folder, 0.25, MORE)
    flatten = [f"{build}/tests/live_flatten", "world/scans"]
    truth = ["--truth", "world/reference.tum"]
    output_of(*flatten, "world.flat", "--imu", "world/imu.csv", "--odometry", "world/odometry.tum", *truth, cwd=folder)
    output_of(*flatten, "scans.flat", *truth, cwd=folder)


def play_before_network(network, build, folder, expect):
    """`vantage play` is found by the localizer once its network is up."""
    network.interface("robot", "down")
    path = f"{folder}/play.txt"
    with open(path, "w", encoding="utf-8") as told:
        play = subprocess.Popen(
            network.inside("robot", f"{build}/bin/vantage-play", "world.toml", "--scans", "world/scans", "--imu",
                           "world/imu.csv", "--odometry", "world/odometry.tum", "--duration", "5"),
            cwd=folder, stdout=told, stderr=told)
    text = lambda: open(path, encoding="utf-8").read()
    last = time.monotonic() + 60.0
    while "no network is up" not in text() and time.monotonic() < last:
        time.sleep(0.1)
    network.interface("robot", "up")
    try:
        code = play.wait(120.0)
    except subprocess.TimeoutExpired:
        play.kill()
        play.wait()
        code = "no end"
    print(text(), end="")
    expect(code == 0, f"`vantage play` that was started before its network ended with {code}")
    expect("the network eth0 10.97.0.1 came up: connects again" in text(), "`vantage play` does not connect again")


def main(build, source):
    if os.geteuid() != 0:
        print("SKIPPED: only root can make network namespaces")
        return SKIPPED
    probe = subprocess.run(["unshare", "--net", "ip", "link", "add", "name", "br0", "type", "bridge"],
                           stderr=subprocess.PIPE, text=True, check=False)
    if probe.returncode != 0:
        print(f"SKIPPED: no network of namespaces can be made: {probe.stderr.strip()}")
        return SKIPPED
    failures, poses = [], []

    def expect(condition, text):
        if not condition:
            failures.append(text)

    with tempfile.TemporaryDirectory() as folder, Network() as network:
        make_world(build, source, folder)
        os.mkdir(f"{folder}/disk")
        output_of("mount", "-t", "tmpfs", "-o", "size=8m", "tmpfs", f"{folder}/disk")
        try:
            live = Live(build, folder, "--record", "disk/run.mcap", inside=network.inside("localizer"))

            def drive(what, seconds, *more, **options):
                return judge(what, Robot(network, build, folder, "--seconds", str(seconds), *more, **options).end())

            def judge(what, found):
                error = found["error_m"]
                print(f"{what}: {found['received']} of {found['sent']} scans have a pose; {error['median']:.3f} m off "
                      f"at the median, {error['max']:.3f} at most, {error['last']:.3f} at the end; "
                      f"{resident(live.process.pid):.0f} MiB resident", flush=True)
                expect(0.0 <= error["last"] < RIGHT, f"{what}: the last pose is {error['last']} m off")
                errors = [float(line.split()[9]) for line in open(f"{folder}/poses.txt", encoding="ascii")]
                poses.extend(error for error in errors if error >= 0.0)
                return found

            found = drive("a drive", 12)
            expect(found["received"] >= 0.5 * found["sent"], f"a drive: {found}")
            live.wait_for("the recording has ended")
            before = resident(live.process.pid)

            robot = Robot(network, build, folder, "--seconds", "60")
            time.sleep(5.0)
            robot.kill()
            drive("the robot killed and started again", 8)

            robot = Robot(network, build, folder, "--seconds", "20")
            time.sleep(6.0)
            network.cable("down")
            time.sleep(5.0)
            network.cable("up")
            found = judge("the cable pulled for 5 s", robot.end())
            expect(found["received"] >= 0.3 * found["sent"], f"the cable: {found}")

            drive("the clock an hour ahead", 8, "--shift", "3600")
            live.wait_for("stamps of scans jumped ahead")
            drive("the clock an hour back", 8)
            live.wait_for("stamps of scans went back")

            drive("carried away", 8, "--from", "20")

            found = drive("100 scans a second, no IMU", 8, "--speed", "10", flat="scans.flat")
            expect(found["sent"] > 600, f"the flood: {found}")
            live.wait_for("dropped")

            after = resident(live.process.pid)
            expect(after < before + GROWTH, f"the localizer grew from {before:.0f} to {after:.0f} MiB")
            live.end(signal.SIGKILL)

            begin = time.monotonic()
            live = Live(build, folder, inside=network.inside("localizer"))
            print(f"started again in {time.monotonic() - begin:.2f} s")
            expect("begins where the last session ended" in live.text(), "the state is lost")
            drive("the localizer killed and started again", 8)
            live.end(signal.SIGKILL)

            network.interface("localizer", "down")
            live = Live(build, folder, inside=network.inside("localizer"))
            live.wait_for("no network is up")
            network.interface("localizer", "up")
            live.wait_for("the network eth0 10.97.0.2 came up: connects again")
            drive("the localizer started before its network", 8)
            play_before_network(network, build, folder, expect)
            wrong = sum(error > ALERT_LIMIT for error in poses)
            print(f"{wrong} of {len(poses)} poses are more than {ALERT_LIMIT} m off")
            expect(wrong <= MAX_RISK * len(poses), f"{wrong} of {len(poses)} poses are wrong")
            code, out = live.end(signal.SIGTERM)
            expect(code == 0, f"the localizer ended with {code}: {live.text()}")
            print(out, end="")
        finally:
            output_of("umount", f"{folder}/disk")
            print(open(f"{folder}/live.txt", encoding="utf-8").read())
    for failure in failures:
        print("FAILED:", failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(*[os.path.abspath(path) for path in sys.argv[1:3]]))
