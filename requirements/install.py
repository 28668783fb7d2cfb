"""Make or reuse a virtual environment: `python3 requirements/install.py .venv [WORD]`.

run.txt goes in, ros.txt where no ROS 2 Jazzy is sourced, the package itself as an editable install;
with the word `dashboard` dashboard.txt too, with `database` also database.txt, with `cluster` also
cluster.txt, with `test` also
test.txt, with `docs` also docs.txt;
with `oldest` oldest.txt in place of them all; with `kilted` what `test` adds, and ros-kilted.txt in
place of ros.txt.
It is made anew when Python, ROS or one of the files changed. Where the versions of oldest.txt
cannot be had, it ends with one line and the exit code 3.
This file must parse on any Python, to say that it is too old.
"""

from __future__ import print_function

import os
import subprocess
import sys

PROJECT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
NOT_HERE = 3
"""Exit code where this machine can have no such environment."""
MESSAGES = ("diagnostic_msgs", "sensor_msgs", "std_msgs", "std_srvs")
ORDER = [
    ("dashboard", "the dashboard needs"),
    ("database", "a history on a server needs"),
    ("cluster", "Dask clusters and object stores need"),
    ("test", "checks the package"),
    ("docs", "builds the documentation"),
]
ADDED = {ORDER[last][0]: ORDER[: last + 1] for last in range(len(ORDER))}
ADDED["kilted"] = ADDED["test"]
"""The files that a word adds to run.txt, in this order, and what they hold."""


def stop(text, *words):
    """End with one line of explanation."""
    sys.exit("make: " + text % words)


def skip(reason):
    """End with one line and `NOT_HERE`: what oldest.txt pins cannot be had."""
    print("make: the oldest versions are not tested here: " + reason, flush=True)
    sys.exit(NOT_HERE)


def check_python(oldest, docs):
    """Refuse a Python that the pinned wheels do not serve, or that cannot make environments."""
    here = "%d.%d" % sys.version_info[:2]
    if not (3, 10) <= sys.version_info[:2] <= (3, 13):
        stop("Python 3.10 to 3.13 is needed and %s is %s: choose another, as in `make "
             "PYTHON=python3.12 demo`", sys.executable, here)  # fmt: skip
    if docs and sys.version_info[:2] < (3, 11):
        stop("the documentation needs Python 3.11 to 3.13 and %s is %s: choose another, as in "
             "`make PYTHON=python3.12 docs`", sys.executable, here)  # fmt: skip
    if oldest and sys.version_info[:2] > (3, 12):
        skip("requirements/oldest.txt is for CPython 3.10 to 3.12 and %s is %s; choose another, as "
             "in `make PYTHON=python3.12 test-oldest`" % (sys.executable, here))  # fmt: skip
    try:
        import ensurepip  # noqa: F401 - packaged apart from Python by Debian and Ubuntu
    except ImportError:
        stop("Python's venv module is missing: run `apt install python3-venv` (python%s-venv for "
             "a Python that is not the system's)", here)  # fmt: skip


def sourced_ros():
    """Tell whether ROS 2 Jazzy is sourced; refuse another ROS, and one that lacks something."""
    distribution = os.environ.get("ROS_DISTRO", "")
    if distribution not in ("", "jazzy"):
        stop("ROS 2 Jazzy is needed and ROS_DISTRO is %s: source /opt/ros/jazzy/setup.bash in a "
             "new shell, or use a shell without ROS", distribution)  # fmt: skip
    if not distribution:
        return False
    try:
        import rclpy.node  # noqa: F401 - the whole of it, with the library compiled for one Python
    except ImportError:
        stop("ROS_DISTRO is jazzy and %s cannot import rclpy: source /opt/ros/jazzy/setup.bash, "
             "choose its Python as in `make PYTHON=/usr/bin/python3`, or unset ROS_DISTRO",
             sys.executable)  # fmt: skip
    from importlib.util import find_spec

    missing = [name for name in MESSAGES if not find_spec(name)]
    if missing:
        packages = " ".join("ros-jazzy-" + name.replace("_", "-") for name in missing)
        stop("ROS 2 Jazzy lacks message packages: run `apt install %s`", packages)
    return True


def read(*path):
    """Return the text of a file, nothing if it is not there."""
    if not os.path.exists(os.path.join(*path)):
        return ""
    with open(os.path.join(*path)) as stream:
        return stream.read()


def refuse_strange(path):
    """Refuse to clear a folder that is not empty and was not made here."""
    mark = os.path.join(path, "made-by-make")
    if os.path.isdir(path) and os.listdir(path) and not os.path.exists(mark):
        stop("%s was not made by make: move it away, or use another folder as in `make "
             "VENV=.venv-make`", path)  # fmt: skip


def main(path, word):
    """Bring the environment at `path` up to date; its `made-by-make` holds what it came from."""
    oldest = word == "oldest"
    check_python(oldest, word == "docs")
    import venv

    kilted = word == "kilted"  # from wheels in any case
    system = not kilted and sourced_ros()
    libraries = "requirements/oldest.txt" if oldest else "requirements/run.txt"
    ros = "requirements/ros-kilted.txt" if kilted else "requirements/ros.txt"
    wheels = [libraries] + ([] if system else [ros])
    sources = ["requirements/install.py", "requirements/build.txt", "setup.py", "setup.cfg"]
    found = read(path, "made-by-make")
    made = repr((sys.version, os.path.realpath(sys.executable), os.path.abspath(path), PROJECT))
    made += "".join(read(PROJECT, name) for name in sources + wheels)

    def run(*arguments):
        command = (os.path.join(path, "bin", "python"),) + arguments
        done = subprocess.run(
            command, check=False, cwd=PROJECT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        if done.returncode != 0:
            output = done.stdout.decode(errors="replace")
            if oldest and "No matching distribution found" in output:
                skip(output.strip().splitlines()[-1])
            sys.stderr.write(output)
            stop("set-up failed, for the reason above: mend it and run make again")

    def install(*words):
        run("-m", "pip", "install", "--quiet", "--no-input", "--disable-pip-version-check",
            "--no-deps", "--no-build-isolation", *words)  # fmt: skip

    def finish(state):
        with open(os.path.join(path, "made-by-make"), "w") as stream:
            stream.write(state)

    if not found.startswith(made) or not os.path.exists(os.path.join(path, "bin", "python")):
        refuse_strange(path)
        distribution = "ROS 2 Kilted" if kilted else "ROS 2 Jazzy"
        where = "the sourced " + distribution if system else distribution + " from wheels"
        print("Making %s with %s: once, about a minute ..." % (path, where), flush=True)
        venv.create(path, system_site_packages=system, clear=True, symlinks=True)
        finish("")
        run("-Im", "ensurepip")
        install("-r", "requirements/build.txt")
        install("-e", ".", *(word for name in wheels for word in ("-r", name)))
        finish(made)
        found = made
    for name, what in ADDED.get(word, ()):
        source = "requirements/%s.txt" % name
        made += read(PROJECT, source)
        if not found.startswith(made):
            print("Adding what %s: once, about half a minute ..." % what, flush=True)
            install("-r", source)
            if not system:
                run("-m", "pip", "--disable-pip-version-check", "check")
            finish(made)
            found = made


if __name__ == "__main__":
    try:
        main(os.path.abspath(sys.argv[1]), "".join(sys.argv[2:]))
    except KeyboardInterrupt:
        stop("set-up interrupted: run make again to complete it")
