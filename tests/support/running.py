"""Programs that tests in Python run, and the worlds that they run them in."""

import os
import re
import subprocess
import sys
import time

# The IMU of configs/simulate/motion.toml, for --set.
IMU_OF_MOTION = "localizer.T_sensor_imu=[0.0, 0.0, -0.05, 0.0, 0.0, 0.0]"


def output_of(*command, **options):
    """What it printed on both outputs. The test ends if it fails."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **options)
    if done.returncode != 0:
        sys.exit(f"FAILED: {' '.join(command)} ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def config_for(config, map_file, root, more=""):
    """The text of a configuration, for another map and another folder of its bundle, with more tables."""
    text = open(config, encoding="utf-8").read()
    text = re.sub(r"files = .*", f'files = ["{map_file}"]', text)
    return re.sub(r"root = .*? }", f'root = "{root}" }}', text) + more


def make_small_campus(build, source, folder, spacing, more):
    """A campus of 60 m and a drive in `world`, a configuration `world.toml` with more tables, and its bundle.

    spacing: of the map's points [m]
    """
    output_of(f"{build}/bin/vantage-simulate", f"{source}/configs/simulate/motion.toml", "--out", f"{folder}/world",
              "-q", "--set", f"map.point_spacing={spacing}", "--set", "campus.size_x=60", "--set", "campus.size_y=60")
    with open(f"{folder}/world.toml", "w", encoding="utf-8") as file:
        file.write(config_for(f"{source}/configs/demo/L20.toml", "world/map.pcd", "bundle", more))
    output_of(f"{build}/bin/vantage-build", "world.toml", "-q", cwd=folder)


class Live:
    """`vantage live` in the world of make_small_campus, and what it says."""

    def __init__(self, build, folder, *more, inside=()):
        """inside: a command that runs the program, such as `ip netns exec NAME`."""
        self._said = open(f"{folder}/live.txt", "ab+")
        self._begin = self._said.seek(0, os.SEEK_END)
        command = [*inside, f"{build}/bin/vantage-live", "world.toml", "--set", IMU_OF_MOTION, *more]
        self.process = subprocess.Popen(command, cwd=folder, stderr=self._said, stdout=subprocess.PIPE)
        self.wait_for("ready in domain")

    def text(self):
        """Its standard error so far."""
        self._said.seek(self._begin)
        return self._said.read().decode()

    def wait_for(self, words):
        """The test ends if it does not say them within two minutes."""
        end = time.monotonic() + 120.0
        while words not in self.text():
            if time.monotonic() > end:
                sys.exit(f"FAILED: the localizer does not say '{words}':\n{self.text()}")
            if self.process.poll() is not None:
                sys.exit(f"FAILED: the localizer ended with {self.process.returncode}:\n{self.text()}")
            time.sleep(0.05)

    def end(self, number):
        """Sends it a signal. Returns its exit code and what it printed."""
        self.process.send_signal(number)
        out, _ = self.process.communicate()
        return self.process.returncode, out.decode()


def resident(pid):
    """Memory of a process [MiB]; None once it has ended."""
    try:
        status = open(f"/proc/{pid}/status", encoding="ascii").read()
    except OSError:
        return None
    size = re.search(r"VmRSS:\s+(\d+)", status)
    return int(size[1]) / 1024.0 if size else None
