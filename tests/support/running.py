"""Programs that tests in Python run."""

import subprocess
import sys


def output_of(*command, **options):
    """What it printed on both outputs. The test ends if it fails."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **options)
    if done.returncode != 0:
        sys.exit(f"FAILED: {' '.join(command)} ended with {done.returncode}:\n{done.stdout}")
    return done.stdout
