"""Make or reuse the virtual environment: `python3 requirements/install.py .venv [test]`.

The pinned wheels of run.txt go in, those of ros.txt where no ROS 2 Jazzy is sourced, the package
itself as an editable install, and with `test` those of test.txt. What is already there is left
alone: each step writes down what it was made from as its last act, so an interrupted one is done
again.

This file must parse on any Python, to say that it is too old.
"""

from __future__ import print_function

import hashlib
import os
import shutil
import subprocess
import sys

REQUIREMENTS = os.path.dirname(os.path.abspath(__file__))
PROJECT = os.path.dirname(REQUIREMENTS)
OLDEST, NEWEST = (3, 10), (3, 13)
MESSAGES = ("diagnostic_msgs", "sensor_msgs", "std_msgs", "std_srvs")
MARK = "made-by-make"


def stop(message):
    """End with one line of explanation."""
    sys.exit("make: " + message)


def check_python():
    """Refuse a Python that the pinned wheels do not serve, or that cannot make environments."""
    here = "%d.%d" % sys.version_info[:2]
    if not OLDEST <= sys.version_info[:2] <= NEWEST:
        stop(
            "Python 3.10 to 3.13 is needed and %s is %s: choose another, as in "
            "`make PYTHON=python3.12 demo`" % (sys.executable, here)
        )
    try:
        import ensurepip
        import venv
    except ImportError:
        stop(
            "Python's venv module is missing: run `apt install python3-venv` "
            "(python%s-venv for a Python that is not the system's)" % here
        )
    return ensurepip, venv


def check_message_packages():
    """Name the message packages that a minimal ROS installation lacks."""
    from importlib.util import find_spec

    missing = [name for name in MESSAGES if find_spec(name) is None]
    if missing:
        packages = " ".join("ros-jazzy-" + name.replace("_", "-") for name in missing)
        stop("ROS 2 Jazzy lacks message packages: run `apt install %s`" % packages)


def sourced_ros():
    """Tell whether rclpy comes from a ROS 2 Jazzy installation (True) or from wheels (False)."""
    distribution = os.environ.get("ROS_DISTRO", "")
    if distribution not in ("", "jazzy"):
        stop(
            "ROS 2 Jazzy is needed and ROS_DISTRO is %s: source /opt/ros/jazzy/setup.bash "
            "in a new shell, or use a shell without ROS" % distribution
        )
    try:
        import rclpy.node  # the whole of it, with the library compiled for one Python
    except ImportError:
        if distribution:
            stop(
                "ROS_DISTRO is jazzy and %s cannot import rclpy: source /opt/ros/jazzy/setup.bash, "
                "choose its Python as in `make PYTHON=/usr/bin/python3`, or unset ROS_DISTRO"
                % sys.executable
            )
        return False
    inside = os.path.realpath(rclpy.__file__).startswith(os.path.realpath(sys.prefix) + os.sep)
    if sys.prefix != sys.base_prefix and inside:
        return False  # an activated virtual environment's own: the new one would not see it
    if not distribution:
        from importlib.metadata import PackageNotFoundError, version

        try:
            if not version("rclpy").startswith("7.1."):
                return False  # not Jazzy's
        except PackageNotFoundError:
            return False
    check_message_packages()
    return True


def fingerprint(words, files):
    """Write down what a step is made from: a line a word, and a digest a file."""
    lines = list(words)
    for name in files:
        with open(os.path.join(PROJECT, name), "rb") as stream:
            lines.append("%s %s" % (hashlib.sha256(stream.read()).hexdigest(), name))
    return "\n".join(lines) + "\n"


class Environment:
    """The virtual environment and the steps that fill it."""

    def __init__(self, path):
        self.path = os.path.abspath(path)
        self.python = os.path.join(self.path, "bin", "python")

    def done(self, step, state):
        """Tell whether `step` was finished from the same `state`."""
        try:
            with open(os.path.join(self.path, "done-" + step)) as stream:
                return stream.read() == state and os.path.exists(self.python)
        except (IOError, OSError):
            return False

    def finish(self, step, state):
        """Write down that `step` is finished."""
        with open(os.path.join(self.path, "done-" + step), "w") as stream:
            stream.write(state)

    def empty(self):
        """Remove what is there, if `make` put it there; the mark goes last."""
        mark = os.path.join(self.path, MARK)
        if not os.path.isdir(self.path):
            os.makedirs(self.path)
        elif os.listdir(self.path) and not os.path.exists(mark):
            stop(
                "%s was not made by make: move it away, or use another folder as in "
                "`make VENV=.venv-make`" % self.path
            )
        open(mark, "a").close()
        for name in os.listdir(self.path):
            path = os.path.join(self.path, name)
            if os.path.isdir(path) and not os.path.islink(path):
                shutil.rmtree(path)
            elif name != MARK:
                os.remove(path)

    def run(self, *arguments):
        """Run a module in the environment; its output is shown when it fails, which ends this."""
        process = subprocess.Popen(
            [self.python, "-m"] + list(arguments),
            cwd=PROJECT,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        output = process.communicate()[0].decode("utf-8", "replace")
        if process.returncode != 0:
            sys.stderr.write(output)
            stop("set-up failed, for the reason above: mend it and run make again")

    def pip(self, *arguments):
        """Install exactly what is asked for, quietly."""
        self.run(
            "pip", "install", "--quiet", "--no-input", "--disable-pip-version-check",
            "--no-warn-script-location", "--no-deps", "--no-build-isolation", *arguments
        )  # fmt: skip

    def requirements(self, *names):
        """Install files of this folder."""
        for name in names:
            self.pip("--requirement", os.path.join(REQUIREMENTS, name))


def main(path, test):
    """Bring the environment at `path` up to date."""
    check_python()
    system = sourced_ros()
    environment = Environment(path)
    wheels = ["run.txt"] if system else ["run.txt", "ros.txt"]
    state = fingerprint(
        [sys.version, os.path.realpath(sys.executable), environment.path, PROJECT],
        ["requirements/" + name for name in ["install.py", "build.txt"] + wheels],
    )
    if not environment.done("run", state):
        where = "the sourced ROS 2 Jazzy" if system else "ROS 2 Jazzy from wheels"
        print("Making %s with %s: once, about a minute ..." % (path, where), flush=True)
        environment.empty()
        options = ["--system-site-packages"] if system else []
        if subprocess.call([sys.executable, "-m", "venv"] + options + [environment.path]) != 0:
            stop("%s could not be made, the reason is above" % path)
        environment.requirements("build.txt", *wheels)
        environment.finish("run", state)

    state = fingerprint([], ["setup.py", "setup.cfg"])
    if not environment.done("package", state):
        environment.pip("--editable", PROJECT)
        environment.finish("package", state)

    state = fingerprint([], ["requirements/test.txt"])
    if test and not environment.done("test", state):
        print("Adding what checks the package: once, about half a minute ...", flush=True)
        environment.requirements("test.txt")
        if not system:
            environment.run("pip", "--disable-pip-version-check", "check")
        environment.finish("test", state)


if __name__ == "__main__":
    try:
        main(sys.argv[1], "test" in sys.argv[2:])
    except KeyboardInterrupt:
        stop("set-up interrupted: run make again to complete it")
