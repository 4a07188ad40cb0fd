"""Programs that tests in Python run."""

import re
import subprocess
import sys


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
