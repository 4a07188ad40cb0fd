#!/usr/bin/env python3
"""Makes the Debian packages of a build folder, and checks what is in them.

usage: packages.py BUILD_DIR
"""

import os
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../support"))
from running import output_of  # noqa: E402

# Where the files of a package may lie.
FOLDERS = {
    "vantage-robot": ["usr/bin/", "usr/lib/TRIPLET/lib", "usr/lib/TRIPLET/vantage/", "usr/share/man/man1/",
                      "usr/share/doc/vantage-robot/", "usr/share/bash-completion/completions/",
                      "usr/share/zsh/site-functions/", "lib/systemd/system/", "usr/lib/systemd/system/"],
    "vantage": ["usr/bin/", "usr/lib/TRIPLET/libvantage_build.so.", "usr/lib/TRIPLET/vantage/", "usr/share/man/man1/",
                "usr/share/doc/vantage/"],
    "libvantage-dev": ["usr/bin/vantage-conformance", "usr/include/vantage/", "usr/lib/TRIPLET/lib",
                       "usr/lib/TRIPLET/cmake/vantage/", "usr/share/man/man1/", "usr/share/doc/libvantage-dev/",
                       "usr/share/doc/vantage/", "usr/share/vantage/examples/"],
}
ROBOT_PROGRAMS = {"vantage", "vantage-info", "vantage-live", "vantage-localize"}
ROBOT_LIBRARIES = {"libvantage_core", "libvantage_engine"}
ROBOT_KINDS = {"store", "matcher", "relocalizer"}
ROBOT_MEGABYTES = 12.0  # on a robot's disk, with the libraries of Vantage


def make(build):
    """Makes the packages. Returns the file of each, by its name."""
    output_of("cmake", "--build", build, "--target", "packages")
    version = re.search(r'^set\(CPACK_PACKAGE_VERSION "(.*)"\)', open(f"{build}/CPackConfig.cmake").read(), re.M)[1]
    release = re.search(r'^set\(CPACK_DEBIAN_PACKAGE_RELEASE "(.*)"\)', open(f"{build}/CPackConfig.cmake").read(),
                        re.M)[1]
    architecture = output_of("dpkg", "--print-architecture").strip()
    return {name: f"{build}/packages/{name}_{version}-{release}_{architecture}.deb" for name in FOLDERS}


def fields(deb):
    return dict(re.findall(r"^([A-Za-z-]+): (.*)$", output_of("dpkg-deb", "-f", deb), re.M))


def main(build):
    failures = []

    def expect(condition, text):
        if not condition:
            failures.append(text)

    debs = make(build)
    triplet = output_of("dpkg-architecture", "-qDEB_HOST_MULTIARCH").strip()
    owners = {}
    with tempfile.TemporaryDirectory() as scratch:
        for name, deb in debs.items():
            root = os.path.join(scratch, name)
            output_of("dpkg-deb", "-x", deb, root)
            files = [os.path.relpath(os.path.join(at, file), root) for at, _, found in os.walk(root) for file in found]
            folders = [folder.replace("TRIPLET", triplet) for folder in FOLDERS[name]]
            for file in files:
                expect(file.startswith(tuple(folders)), f"{name} has {file}")
                expect(file not in owners, f"{name} and {owners.get(file)} have {file}")
                owners[file] = name
            programs = {os.path.basename(file) for file in files if file.startswith("usr/bin/")}
            manuals = {os.path.basename(file)[:-5] for file in files if file.startswith("usr/share/man/")}
            expect(programs == manuals, f"{name}: programs {programs}, manuals {manuals}")
            for manual in sorted(manuals):
                said = subprocess.run(["man", "--warnings", "-l", f"{root}/usr/share/man/man1/{manual}.1.gz"],
                                      env=dict(os.environ, LC_ALL="C.UTF-8", MAN_KEEP_STDERR="1"), check=False,
                                      stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
                expect(said.returncode == 0 and not said.stderr, f"the manual of {manual}: {said.stderr.decode()}")
                expect(manual.upper().encode() in said.stdout, f"the manual of {manual} is of something else")
            for file in files:
                path = os.path.join(root, file)  # a link leads to the library of another package
                if os.path.islink(path) or open(path, "rb").read(4) != b"\x7fELF":
                    continue
                said = output_of("objdump", "-p", path)
                expect("RUNPATH" not in said and "RPATH" not in said, f"{name}: {file} names folders of libraries")

        robot = fields(debs["vantage-robot"])
        expect("open3d" not in robot["Depends"].lower(), "vantage-robot needs Open3D: " + robot["Depends"])
        expect("libfastrtps" in robot["Depends"] or "libfastdds" in robot["Depends"], "vantage-robot needs no DDS")
        robot_root = os.path.join(scratch, "vantage-robot")
        expect(set(os.listdir(f"{robot_root}/usr/bin")) == ROBOT_PROGRAMS, "the programs of vantage-robot are others")
        libraries = {file.split(".")[0] for file in os.listdir(f"{robot_root}/usr/lib/{triplet}") if ".so" in file}
        expect(libraries == ROBOT_LIBRARIES, f"vantage-robot has the libraries {libraries}")
        kinds = {file.split("_")[1] for file in os.listdir(f"{robot_root}/usr/lib/{triplet}/vantage")}
        expect(kinds == ROBOT_KINDS, f"vantage-robot has plugins of the kinds {kinds}")
        size = sum(os.lstat(os.path.join(at, file)).st_size for at, _, found in os.walk(robot_root) for file in found)
        size /= 1e6
        expect(size <= ROBOT_MEGABYTES, f"vantage-robot takes {size:.1f} MB")
        print(f"vantage-robot: {size:.1f} MB installed, needs {robot['Depends']}")
        same = f"(= {robot['Version']})"
        expect(f"vantage-robot {same}" in fields(debs["vantage"])["Depends"], "vantage does not need vantage-robot")
        expect(f"vantage {same}" in fields(debs["libvantage-dev"])["Depends"], "libvantage-dev does not need vantage")

        # verify wants the program to be there.
        folder = "lib" if os.path.isdir(f"{robot_root}/lib") else "usr/lib"
        unit = open(f"{robot_root}/{folder}/systemd/system/vantage-live.service").read()
        path = os.path.join(scratch, "vantage-live.service")
        open(path, "w").write(unit.replace("/usr/bin/", f"{robot_root}/usr/bin/"))
        said = output_of("systemd-analyze", "verify", "--man=no", path)
        expect(not said.strip(), f"systemd-analyze verify: {said}")

    done = subprocess.run(["lintian", "--fail-on", "error", "--tag-display-limit", "0", *debs.values()],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    print(done.stdout, end="")
    expect(done.returncode == 0, "lintian finds errors, see above")
    for failure in failures:
        print("FAILED:", failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(os.path.abspath(sys.argv[1])))
