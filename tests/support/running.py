"""Programs that tests in Python run, and the worlds that they run them in."""

import re
import subprocess
import sys

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


def resident(pid):
    """Memory of a process [MiB]; None once it has ended."""
    try:
        status = open(f"/proc/{pid}/status", encoding="ascii").read()
    except OSError:
        return None
    size = re.search(r"VmRSS:\s+(\d+)", status)
    return int(size[1]) / 1024.0 if size else None
