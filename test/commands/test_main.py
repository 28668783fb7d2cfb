# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command `valve_friction`: how it finds its sub-commands, their options, and how it ends."""

import argparse
import importlib
import io
import os
import re
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from processes import ran

from valve_friction_ros import __version__
from valve_friction_ros.commands.arguments import add_options, percent
from valve_friction_ros.commands.main import SUB_COMMANDS, run
from valve_friction_ros.dashboard.accounts import Account, Role

EXTRA = Path(__file__).with_name("extra_sub_command.py")
SLOW = {
    *("asyncio", "jinja2", "matplotlib", "multiprocessing", "numba", "numpy", "pandas", "rclpy"),
    *("rich", "scipy", "sqlite3", "yaml"),
}
PROGRAM = ["-m", "valve_friction_ros"]


def start(*arguments, program=PROGRAM, **streams):
    """Start the command as a process; its streams are pipes unless said otherwise."""
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams
    return subprocess.Popen(
        [sys.executable, *map(str, program), *map(str, arguments)], text=True, **streams
    )


def ended(process):
    """Exit code, stdout and stderr."""
    out, err = process.communicate(timeout=300)
    return process.returncode, out, err


def extra(*arguments, **streams):
    return ended(start("extra", *arguments, program=[EXTRA], **streams))


class TestChoice:
    def test_help_has_a_line_for_each(self):
        code, out, err = ended(start("--help"))
        assert (code, err) == (0, "")
        lines = [" ".join(line.split()) for line in out.splitlines()]
        for name, text in SUB_COMMANDS.items():
            assert f"{name} {text}" in lines

    def test_help_of_a_sub_command_imports_nothing_slow(self):
        """It is there at once, too: the declarations of all take only what is light."""
        code = (
            "import sys\n"
            "from valve_friction_ros.commands.main import SUB_COMMANDS, run\n"
            "for name in SUB_COMMANDS:\n"
            "    try: run([*name.split(), '--help'])\n"
            "    except SystemExit as end: assert end.code == 0\n"
            "print('\\n'.join(sys.modules), file=sys.stderr)"
        )
        loaded = ended(start("-c", code, program=[]))[2].split()
        assert "valve_friction_ros.commands.arguments.declared" in loaded
        assert not SLOW & set(loaded)

    def test_version(self, told):
        assert told("--version") == f"valve_friction {__version__}\n"

    @pytest.mark.parametrize(
        ("arguments", "speaker", "words"),
        [
            ("identfy a.csv --json", "", "unknown sub-command 'identfy'; the nearest is 'identi"),
            ("identify_folder a", "", "'identify_folder'; the nearest is 'identify-folder'"),
            ("", "", "the following arguments are required: SUB-COMMAND"),
            ("--json identify", "", ""),
            ("history --jason", " history", "unrecognized arguments: --jason"),
            ("call fv_101 idnetify", " call", "unknown service 'idnetify'; did you mean 'identify"),
        ],
    )
    def test_wrong_arguments(self, command, arguments, speaker, words):
        """One line, which names the sub-command if there is one."""
        code, out, err = command(*arguments.split())
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert err.startswith(f"valve_friction{speaker}: ")
        assert err.endswith("; see --help\n")
        assert words in err

    @pytest.mark.parametrize("name", SUB_COMMANDS)
    def test_each_describes_itself(self, told, name):
        out = told(*name.split(), "--help")
        assert out.startswith(f"usage: valve_friction {name} ")
        assert "exit code 2" in " ".join(out.lower().replace("; 2:", " exit code 2").split())
        file, _, action = name.replace("-", "_").partition(" ")
        module = importlib.import_module(f"valve_friction_ros.commands.{file}")
        assert callable(getattr(module, action or "run"))


class TestEnd:
    """One line on stderr whatever happens, but for a bug."""

    def test_well(self):
        assert extra("well") == (1, "short\n", "")

    @pytest.mark.parametrize(
        ("ending", "line"),
        [
            ("refusal", "not that one"),
            ("own refusal", "not this one"),
            ("no file", "none.csv: No such file or directory"),
        ],
    )
    def test_refused(self, ending, line):
        assert extra(ending) == (2, "", f"valve_friction extra: {line}\n")

    @pytest.mark.parametrize(
        "ending", ["interrupted", "disguised", "in a parser", "ignored", "swallowed"]
    )
    def test_interrupted(self, ending):
        assert extra(ending) == (130, "", "valve_friction extra: interrupted\n")

    def test_interrupted_while_it_is_imported(self):
        """At once, whatever a library does with exceptions while it is imported."""
        code = (
            "import sys, time\n"
            "from valve_friction_ros.commands import start\n"
            "class Slow:\n"
            "    def find_spec(self, name, *_):\n"
            "        if name.endswith('commands.main'):\n"
            "            print('importing', flush=True)\n"
            "            try: time.sleep(30)\n"
            "            except BaseException: time.sleep(30)\n"
            "sys.meta_path.insert(0, Slow())\n"
            "sys.exit(start.main())"
        )
        process = start("-c", code, "identify", program=[])
        assert process.stdout.readline() == "importing\n"
        process.send_signal(signal.SIGINT)
        assert ended(process) == (130, "", "valve_friction identify: interrupted\n")

    def test_a_bug_shows_where_it_is(self):
        code, out, err = extra("bug")
        assert (code, out) == (1, "")
        assert err.startswith("Traceback")
        assert err.endswith("KeyError: 'a bug'\n")

    def test_in_the_background_of_a_shell(self):
        """Ctrl-C is not for a process that was started with SIGINT ignored."""
        ignored = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            process = start("extra", "interrupted", program=[EXTRA])
        finally:
            signal.signal(signal.SIGINT, ignored)
        assert ended(process) == (1, "short\n", "")

    @pytest.mark.parametrize("ending", ["short", "long"])
    def test_closed_output(self, ending):
        reading, writing = os.pipe()
        os.close(reading)
        code, _, err = extra(ending, stdout=writing)
        os.close(writing)
        assert (code, err) == (141, "")

    @pytest.mark.parametrize("ending", ["short", "long"])
    @pytest.mark.parametrize("unbuffered", ["", "1"])
    def test_full_output(self, ending, unbuffered):
        environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
        with Path("/dev/full").open("w") as full:
            code, _, err = extra(ending, stdout=full, env=environment)
            assert (code, err) == (
                2,
                "valve_friction extra: standard output: No space left on device\n",
            )
            assert extra(ending, stdout=full, stderr=full, env=environment)[0] == 2

    @pytest.mark.parametrize("name", [[], ["identify"]])
    @pytest.mark.parametrize("unbuffered", ["", "1"])
    def test_full_output_of_the_help(self, name, unbuffered):
        """Short or longer than a buffer."""
        with Path("/dev/full").open("w") as full:
            environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
            code, _, err = ended(start(*name, "--help", stdout=full, env=environment))
        speaker = " ".join(["valve_friction", *name])
        assert (code, err) == (2, f"{speaker}: standard output: No space left on device\n")

    @pytest.mark.parametrize("closed", [1, 2])
    def test_a_stream_that_was_closed_before(self, closed):
        shell = f'exec "$@" {closed}>&-'
        code = subprocess.run(
            ["sh", "-c", shell, "sh", sys.executable, EXTRA, "extra", "well"],
            capture_output=True,
            timeout=300,
            check=False,
        )
        assert code.returncode == 1
        assert code.stderr == b""


class TestRealSubCommands:
    @pytest.mark.parametrize(
        ("arguments", "file"),
        [
            (["identify", "record.csv", "--valve", "valve.yaml"], "record.csv"),
            (["validate", "record.csv", "--estimate", "estimate.json"], "estimate.json"),
            (["identify-folder", ".", "--output", "all.csv", "--valve", "a.yaml"], "a.yaml"),
            (["reproduce-paper", "--config", "."], "bench_low.yaml"),
        ],
    )
    def test_interrupted_while_it_reads(self, tmp_path, bench_yaml, arguments, file):
        (tmp_path / "valve.yaml").write_text(bench_yaml.read_text())
        (tmp_path / "record.csv").write_text("time_s,position_m,force_n\n0,0,0\n")
        (tmp_path / file).unlink(missing_ok=True)
        os.mkfifo(tmp_path / file)
        path = os.pathsep.join(filter(None, [str(bench_yaml.parents[1]), *sys.path]))
        environment = os.environ | {"PYTHONPATH": path}
        process = start(*arguments, cwd=tmp_path, env=environment)
        with (tmp_path / file).open("w"):  # returns when the command reads
            process.send_signal(signal.SIGINT)
            code, out, err = ended(process)
        assert (code, out) == (130, "")
        assert err.startswith(f"valve_friction {arguments[0]}: interrupted")
        assert err.count("\n") == 1

    @pytest.mark.parametrize("options", [[], ["--json"]])
    def test_a_picture_on_a_full_disk(self, quick_csv, bench_options, tmp_path, options):
        """The numbers are printed, the file is named, and no part of it stays."""
        picture = tmp_path / "record.png"
        process = start(
            *("identify", quick_csv, *bench_options, *options, "--plot", picture),
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000)),
        )
        code, out, err = ended(process)
        assert code == 2
        assert "spring_constant" in out
        assert err == f"valve_friction identify: {picture}: File too large\n"
        assert {path.name for path in tmp_path.iterdir()} == {quick_csv.name}

    def test_a_picture_beside_a_closed_output(self, quick_csv, bench_options, tmp_path):
        picture = tmp_path / "record.png"
        reading, writing = os.pipe()
        os.close(reading)
        process = start("identify", quick_csv, *bench_options, "--plot", picture, stdout=writing)
        os.close(writing)
        code, _, err = ended(process)
        assert (code, err) == (141, "")
        assert picture.stat().st_size > 20_000


TEXT = """
    --plot FILE.png: draw it, --on a grid
        of 5 %%
    --folder DIR: where
    --json: print it
    --name NAME: of it (%(default)s)
    --jobs N: how many
    """


@pytest.mark.parametrize("command", [["demo"], ["call", "/fv_101", "identify"]])
def test_without_ros_one_line_says_so(command):
    code = "import sys; sys.modules['rclpy'] = None; from valve_friction_ros.commands.main import *"
    ended, _, error = ran(program=("-c", f"{code}; sys.exit(run({command}))"))
    assert ended == 2
    told = rf"valve_friction {command[0]}: ROS 2 is needed \(.*rclpy.*\): source it, or .*\n"
    assert re.fullmatch(told, error)


def test_options_from_their_help():
    """Paths, texts, flags, and what is said beside."""
    parser = argparse.ArgumentParser()
    add_options(parser, TEXT, name={"default": "all"}, jobs={"type": int, "required": True})
    given = ["--plot", "a.png", "--folder", "b", "--json", "--jobs", "2"]
    wanted = argparse.Namespace(plot=Path("a.png"), folder=Path("b"), json=True, name="all", jobs=2)
    assert parser.parse_args(given) == wanted
    left_out = argparse.Namespace(plot=None, folder=None, json=False, name="all", jobs=2)
    assert parser.parse_args(["--jobs", "2"]) == left_out
    shown = " ".join(parser.format_help().split())
    for words in ("--plot FILE.png draw it, --on a grid of 5 %", "--name NAME of it (all)"):
        assert words in shown


def test_percent():
    for text, share in (("90", 0.9), ("2.5 %", 0.025), ("-10", -0.1)):
        assert percent(text) == pytest.approx(share)
    for text in ("101", "many", "nan", ""):
        with pytest.raises(argparse.ArgumentTypeError, match="is not a percentage, such as 90"):
            percent(text)


PASSWORD = "correct horse battery"


def test_a_piped_password(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", io.StringIO(f"{PASSWORD}\n"))
    assert run(["dashboard-account", "anna", "--role", "operate"]) == 0
    printed = capsys.readouterr()
    account = Account.read(printed.out)
    assert (account.name, account.role) == ("anna", Role.OPERATE)
    assert account.password.matches(PASSWORD)
    assert PASSWORD not in printed.out + printed.err


@pytest.mark.parametrize(
    ("name", "password", "words"),
    [("anna", "short", "10 to 200 characters"), ("an na", PASSWORD, "an account name must")],
)
def test_what_is_refused(monkeypatch, refused, name, password, words):
    monkeypatch.setattr(sys, "stdin", io.StringIO(f"{password}\n"))
    assert words in refused("dashboard-account", name)


def test_a_terminal_is_asked_twice(monkeypatch, capsys):
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    for second, code in ((PASSWORD, 0), ("another password", 2)):
        answers = iter([PASSWORD, second])
        monkeypatch.setattr("getpass.getpass", lambda _, answers=answers: next(answers))
        assert run(["dashboard-account", "bo"]) == code
    printed = capsys.readouterr()
    assert Account.read(printed.out).role is Role.VIEW
    assert "the two passwords differ" in printed.err
