#!/usr/bin/env python3
"""Installs the Debian packages on a bare system of the same release, and uses them there. Needs root and debootstrap.

usage: packages_installed.py BUILD_DIR
"""

import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import urllib.request

import packages
from running import output_of  # packages.py knows where it is

MIRROR = "http://deb.debian.org/debian"
# Mounts end with the command. Downloaded packages are kept for the next run.
IN_CHROOT = """
mount -t proc proc "$0/proc"
mount --rbind /dev "$0/dev"
mount --bind "$1" "$0/var/cache/apt/archives"
exec chroot "$0" env -i HOME=/root LC_ALL=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  DEBIAN_FRONTEND=noninteractive "${@:2}"
"""


def skip(why):
    print(f"SKIPPED: {why}")
    sys.exit(0)


def suite_of_this_system():
    system = dict(re.findall(r'^(\w+)="?([^"\n]*)', open("/etc/os-release").read(), re.M))
    if system["ID"] != "debian":
        skip("only Debian is installed bare here")
    return system["VERSION_CODENAME"]


def small_bundle(build, folder):
    """A campus, its bundle in FOLDER/bundle, and 3 scans in FOLDER/scans with the pose of the first. Returns it."""
    source = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))
    output_of(f"{build}/bin/vantage", "simulate", f"{source}/configs/simulate/demo.toml", "--out", f"{folder}/campus",
              "--quiet")
    output_of(f"{build}/bin/vantage", "build", f"{source}/configs/demo/L20.toml", "--quiet",
              "--set", "visibility.plugin=keep_all", "--set", "visibility.params={}",
              "--set", f'map.files=["{folder}/campus/map.pcd"]', "--set", f"store.params.root={folder}/bundle")
    os.mkdir(f"{folder}/scans")
    times = open(f"{folder}/campus/scans/times.txt").read().splitlines()
    for scan in sorted(file for file in os.listdir(f"{folder}/campus/scans") if file.endswith(".pcd"))[:3]:
        shutil.copy(f"{folder}/campus/scans/{scan}", f"{folder}/scans")
    open(f"{folder}/scans/times.txt", "w").write("\n".join(times[:3]) + "\n")
    x, y, z, qx, qy, qz, qw = [float(word) for word in open(f"{folder}/campus/reference.tum").readline().split()[1:]]
    roll = math.atan2(2.0 * (qw * qx + qy * qz), 1.0 - 2.0 * (qx * qx + qy * qy))
    pitch = math.asin(2.0 * (qw * qy - qz * qx))
    yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    return f"{x},{y},{z},{roll},{pitch},{yaw}"


def main(build):
    suite = suite_of_this_system()
    if os.geteuid() != 0:
        skip("only root can make a bare system")
    if shutil.which("debootstrap") is None:
        skip("there is no debootstrap")
    try:
        urllib.request.urlopen(f"{MIRROR}/dists/{suite}/InRelease", timeout=30).close()
    except OSError as error:
        skip(f"{MIRROR} cannot be reached: {error}")
    debs = packages.make(build)
    bare, cache = f"{build}/packages/{suite}", f"{build}/packages/archives"
    if not os.path.exists(f"{bare}.ready"):
        shutil.rmtree(bare, ignore_errors=True)
        output_of("debootstrap", "--variant=minbase", suite, bare, MIRROR)
        open(f"{bare}.ready", "w").close()
    os.makedirs(f"{cache}/partial", exist_ok=True)

    with tempfile.TemporaryDirectory() as scratch:
        root = f"{scratch}/root"
        output_of("cp", "-a", "--reflink=auto", bare, root)
        shutil.copy("/etc/resolv.conf", f"{root}/etc/resolv.conf")
        for deb in debs.values():
            shutil.copy(deb, f"{root}/tmp")
        os.makedirs(f"{root}/srv/vantage")
        pose = small_bundle(build, scratch)
        shutil.move(f"{scratch}/bundle", f"{root}/srv/vantage/campus")
        shutil.move(f"{scratch}/scans", f"{root}/srv/vantage/scans")

        def there(*command):
            return ["unshare", "--mount", "--propagation", "private", "bash", "-euc", IN_CHROOT, root, cache, *command]

        def run(*command):
            return output_of(*there(*command))

        def install(name):
            run("apt-get", "install", "-q", "-y", "--no-install-recommends", "/tmp/" + os.path.basename(debs[name]))

        run("apt-get", "update", "-q")
        install("vantage-robot")
        shown = run("vantage", "--help")
        assert "localize" in shown and "\n  build" not in shown, shown
        assert "libOpen3D" not in run("sh", "-c", "cat /var/lib/dpkg/info/*.list"), "Open3D came with vantage-robot"

        # The example, as a user changes it.
        os.makedirs(f"{root}/etc/vantage")
        shutil.copy(f"{root}/usr/share/doc/vantage-robot/examples/live.toml", f"{root}/etc/vantage")
        os.makedirs(f"{root}/var/lib/vantage")
        run("vantage", "localize", "/etc/vantage/live.toml", "--scans", "/srv/vantage/scans", "--initial-pose", pose,
            "--set", "localizer.live=false", "--out", "/tmp/run", "--quiet")
        with open(f"{root}/tmp/run/trajectory.tum") as trajectory:
            assert len([line for line in trajectory if not line.startswith("#")]) == 3

        # Two times: stopped as systemd stops it, and started again.
        for _ in range(2):
            live = subprocess.Popen(there("vantage-live", "/etc/vantage/live.toml", "--set", "live.domain=97"),
                                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            said = []
            for line in live.stderr:
                said.append(line)
                if "ready in domain 97" in line:
                    live.send_signal(signal.SIGTERM)
                    break
            rest = live.communicate()
            assert live.returncode == 0, (live.returncode, said, rest)
            assert "0 scans" in rest[0], (said, rest)

        install("vantage")
        assert "\n  build" in run("vantage", "--help")
        plugins = run("vantage", "plugins", "list")
        assert "uniform_grid" in plugins and "ndt" in plugins, plugins
        run("apt-get", "purge", "-q", "-y", "vantage-robot")
        assert not os.path.exists(f"{root}/usr/bin/vantage") and not os.path.exists(f"{root}/usr/bin/vantage-build")
    print("installed, used and removed on a bare", suite)
    return 0


if __name__ == "__main__":
    sys.exit(main(os.path.abspath(sys.argv[1])))
