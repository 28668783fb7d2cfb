# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The package as its users get it: built by colcon, started from the installed tree, linted."""

import ast
import importlib
import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from configparser import ConfigParser
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest
import rclpy
import yaml
from documentation import TEXT
from processes import PATIENCE, printed

from valve_friction_ros import __version__

PROJECT = Path(__file__).resolve().parents[1]
NAME = "valve_friction_ros"
EXECUTABLES = {
    "dashboard",
    "identifier",
    "identifiers",
    "pressure_source",
    "simulator",
    "stroke_player",
    "valve_friction",
}
LAUNCH_FILES = ["bench.launch.py", "monitor.launch.py"]
DOMAIN = 91


def setup_text():
    return (PROJECT / "setup.py").read_text()


def entry_points():
    found = re.findall(rf'"(\w+) = ({NAME}[\w.]+):(\w+)"', setup_text())
    return {name: (module, function) for name, module, function in found}


def test_there_is_one_version():
    """What setup.py gives is that of package.xml, so is the module's; the change log knows it."""
    declared = ET.parse(PROJECT / "package.xml").getroot().findtext("version")
    given = subprocess.run(
        [sys.executable, "setup.py", "--version"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert given.stdout.split()[-1] == declared
    assert __version__ == declared
    assert not re.search(r'version="', setup_text())
    assert re.search(rf"^{re.escape(declared)}\b", (PROJECT / "CHANGELOG.rst").read_text(), re.M)


def imported_modules(path):
    """Top-level names of the modules that a source file imports absolutely."""
    names = set()
    for statement in ast.walk(ast.parse(path.read_text())):
        if isinstance(statement, ast.Import):
            names |= {alias.name for alias in statement.names}
        elif isinstance(statement, ast.ImportFrom) and statement.level == 0:
            names.add(statement.module)
    return {name.partition(".")[0] for name in names}


LIBRARIES = {  # what is imported, by its rosdep key and its name on PyPI
    "jinja2": ("python3-jinja2", "Jinja2"),
    "matplotlib": ("python3-matplotlib", "matplotlib"),
    "numba": ("python3-numba", "numba"),
    "numpy": ("python3-numpy", "numpy"),
    "pandas": ("python3-pandas", "pandas"),
    "rich": ("python3-rich", "rich"),
    "scipy": ("python3-scipy", "scipy"),
    "sqlalchemy": ("python3-sqlalchemy", "SQLAlchemy"),
    "yaml": ("python3-yaml", "PyYAML"),
}
BAG_LIBRARIES = {"backports": "backports.zstd", "lz4": "lz4", "rosbags": "rosbags"}
DATABASE_LIBRARIES = {"psycopg"}
DASHBOARD_LIBRARIES = {"fastapi", "nicegui", "starlette", "uvicorn"}  # NiceGUI is built on them

CLUSTER_LIBRARIES = {"dask", "distributed"}


def exec_depends():
    root = ET.parse(PROJECT / "package.xml").getroot()
    return {element.text for element in root.iter("exec_depend")}


def third_party_imports():
    """Modules from outside the package and Python, with the files that import them."""
    own = set(sys.stdlib_module_names) | {NAME}
    paths = [*(PROJECT / NAME).rglob("*.py"), *(PROJECT / "launch").glob("*.py")]
    return [(module, path) for path in paths for module in imported_modules(path) - own]


def test_manifest_names_every_message_package_and_library():
    declared = exec_depends()
    assert not [key for key in declared if key.endswith("-pip")]
    imports = third_party_imports()
    assert {module for module, _ in imports} >= LIBRARIES.keys() | BAG_LIBRARIES.keys()
    assert {key for key in declared if key.startswith("python3-")} == {
        key for key, _ in LIBRARIES.values()
    }
    for module, path in imports:
        if module in BAG_LIBRARIES:
            assert path.parent == PROJECT / NAME / "records" / "bags"
        elif module in DATABASE_LIBRARIES:
            assert path == PROJECT / NAME / "history" / "database.py"
        elif module in DASHBOARD_LIBRARIES:
            assert path.is_relative_to(PROJECT / NAME / "dashboard")
        elif module in CLUSTER_LIBRARIES:
            assert path == PROJECT / NAME / "fleet" / "workers.py"
        elif module == "upath":
            assert path == PROJECT / NAME / "records" / "files.py"
        else:
            assert LIBRARIES.get(module, (module,))[0] in declared, f"{path.name}: {module}"


def requirements(name):
    """What setup.py gives for a keyword."""
    tree = ast.parse(setup_text())
    (found,) = (
        ast.literal_eval(word.value)
        for word in ast.walk(tree)
        if isinstance(word, ast.keyword) and word.arg == name
    )
    return found


def parted(requirement):
    """Name and limits of a requirement."""
    return re.fullmatch(r"([\w.-]+)(.*)", requirement).groups()


def pins(file):
    """Versions that a file of pinned requirements names, those for the oldest Python first."""
    found = {}
    for line in (PROJECT / "requirements" / file).read_text().splitlines():
        if match := re.match(r"([\w.-]+)==([^\s;]+)", line):
            found.setdefault(match[1], match[2])
    return found


def test_setup_names_every_library():
    required = {parted(each)[0] for each in requirements("install_requires")}
    assert required == {"setuptools", *(name for _, name in LIBRARIES.values())}
    bags = {parted(each)[0] for each in requirements("extras_require")["bags"]}
    assert bags == set(BAG_LIBRARIES.values())


@pytest.mark.parametrize("extra", ["dashboard", "database"])
def test_what_is_an_extra(extra):
    """Its limits hold for what is pinned, and a page says how it is installed."""
    needed = requirements("extras_require")[extra]
    for one in needed:
        name, limits = parted(one.replace("[binary]", ""))
        lowest, highest = re.fullmatch(r">=(\d+\.\d+),<(\d+)", limits).groups()
        pinned = [int(n) for n in (pins("run.txt") | pins(f"{extra}.txt"))[name].split(".")[:2]]
        assert [int(part) for part in lowest.split(".")] <= pinned < [int(highest), 0]
    wanted = " ".join(f"'{one}'" for one in needed)
    for command in (f"pip install {wanted}", f"make venv-{extra}"):
        assert command in TEXT


def test_containers_install_the_extras():
    """What is added to the image has the limits of setup.py; the commands name what there is."""
    plant = yaml.safe_load((PROJECT / "compose.yaml").read_text())
    extras = requirements("extras_require")
    added = plant["x-ros"]["build"]["args"]["EXTRAS"].split()
    assert set(added) >= {*extras["bags"], *extras["dashboard"]}
    share = f"/ws/install/share/{NAME}/"
    for service in plant["services"].values():
        words = service.get("command", "").split()
        if words:
            assert words[3] in (EXECUTABLES if words[1] == "run" else LAUNCH_FILES)
        for word in words:
            if share in word:
                assert (PROJECT / word.partition(share)[2]).is_file(), word


def test_clusters_and_stores_are_extras():
    """Their limits hold for what is pinned; pages and refusals say how they are installed."""
    pinned, extras = pins("cluster.txt"), requirements("extras_require")
    sources = "".join(path.read_text() for path in (PROJECT / NAME).rglob("*.py"))
    for needed in (*extras["cluster"], *extras["stores"]):
        name, limits = parted(needed)
        if lowest := re.match(r">=([\d.]+)", limits):
            assert f"{pinned[name]}.".startswith(f"{lowest[1]}.")
        word = f"'{needed}'" if limits else needed
        for text in (TEXT, sources):
            assert re.search(rf"pip install [^`#]*{re.escape(word)}", text), word
    assert "make venv-cluster" in TEXT


def test_the_oldest_versions_are_those_that_are_tested():
    minima = dict(map(parted, requirements("install_requires")))
    assert minima.pop("setuptools") == ""
    oldest = pins("oldest.txt")
    assert minima == {name: f">={oldest[name]}" for name in minima}
    assert not oldest.keys() & set(BAG_LIBRARIES.values())


def test_the_newest_versions_are_those_that_are_installed():
    pinned = pins("run.txt")
    for name in (*(name for _, name in LIBRARIES.values()), *BAG_LIBRARIES.values()):
        assert name in pinned


def test_the_remedy_is_the_extra():
    bags = requirements("extras_require")["bags"]
    text = (PROJECT / NAME / "records" / "bags" / "topics.py").read_text()
    remedy = re.search(r"pip install ([^`]+)`", text)[1]
    assert sorted(word.strip("'") for word in remedy.split()) == sorted(bags)
    assert f"pip install {remedy}" in TEXT


def test_entry_points_exist():
    assert set(entry_points()) == EXECUTABLES
    for module, function in entry_points().values():
        assert callable(getattr(importlib.import_module(module), function))


def test_executables_go_where_ros2_run_looks():
    parser = ConfigParser()
    parser.read(PROJECT / "setup.cfg")
    assert parser["develop"]["script_dir"] == f"$base/lib/{NAME}"
    assert parser["install"]["install_scripts"] == f"$base/lib/{NAME}"


@pytest.mark.parametrize("name", LAUNCH_FILES)
def test_launch_file(name):
    path = PROJECT / "launch" / name
    code = compile(path.read_text(), str(path), "exec")
    if importlib.util.find_spec("launch_ros") is None:
        assert "generate_launch_description" in code.co_names  # launch comes with ROS only
        return
    namespace = {"__name__": path.stem}
    exec(code, namespace)
    assert namespace["generate_launch_description"]().entities


@pytest.fixture
def launch_file(monkeypatch):
    """Function of a name: a launch file, with stand-ins for launch, which comes with ROS only."""
    for name in ("launch", "launch.actions", "launch.substitutions", "launch_ros",
                 "launch_ros.actions", "launch_ros.parameter_descriptions",
                 "launch_ros.substitutions"):  # fmt: skip
        monkeypatch.setitem(sys.modules, name, MagicMock())

    def load(name):
        namespace = {"__name__": name}
        exec((PROJECT / "launch" / f"{name}.launch.py").read_text(), namespace)
        return SimpleNamespace(**namespace)

    return load


@pytest.fixture
def monitor(launch_file):
    """The launch file of a plant."""
    return launch_file("monitor")


@pytest.mark.parametrize("with_identifier", ["true", "false"])
def test_a_bench_with_its_identifier_and_without(launch_file, with_identifier):
    """The tag is that of the namespace, unless the parameter file, which comes later, has one."""
    names = launch_file("bench").nodes.__globals__
    config = str(PROJECT / "config" / "bench_low.yaml")
    given = {"valve": "/area/fv_102", "config": config, "identifier": with_identifier}
    names["LaunchConfiguration"] = lambda name: SimpleNamespace(perform=lambda _: given[name])
    names["Node"] = lambda **settings: settings
    names["ParameterValue"] = lambda value, value_type: (value.perform(None), value_type)
    given |= {"use_sim_time": "false", "log_level": "warn"}
    context = SimpleNamespace(launch_configurations=given)
    nodes = {node["name"]: node for node in names["nodes"](context)}
    wanted = {"pressure_source", "simulator"}
    assert set(nodes) == wanted | ({"identifier"} if with_identifier == "true" else set())
    assert {node["namespace"] for node in nodes.values()} == {"/area/fv_102"}
    time = {"use_sim_time": ("false", bool)}
    assert nodes["simulator"]["parameters"] == [config, time]
    if with_identifier == "true":
        assert nodes["identifier"]["parameters"] == [{"valve_tag": "FV-102"}, config, time]
    given["valve"] = "9bad"
    with pytest.raises(ValueError, match=r"valve '9bad' is not a ROS namespace: use .*:=fv_101"):
        names["nodes"](context)


@pytest.mark.parametrize(("name", "typed"), [("bench", "valv"), ("monitor", "one_proces")])
def test_a_mistyped_argument_is_refused(launch_file, name, typed):
    names = launch_file(name).require_known.__globals__
    with pytest.raises(ValueError, match=f"no argument '{typed}': did you mean"):
        names["require_known"](SimpleNamespace(launch_configurations={typed: "x"}))
    foreign = dict.fromkeys([*names["ARGUMENTS"], "config", "map"], "x")  # of a file that includes
    names["require_known"](SimpleNamespace(launch_configurations=foreign))


USUAL = {"pressure_topic": "/plant/{valve}/pressure", "stem_topic": "stem"}


def test_a_list_of_valves(monitor):
    one, other = monitor.plant_valves("fv_101, area/fv_102", USUAL)
    assert one.namespace == "/fv_101"
    assert one.remappings("/fv_101/") == [
        ("/fv_101/actuator_pressure", "/plant/fv_101/pressure"),
        ("/fv_101/stem_state", "stem"),
    ]
    assert other.remappings("")[0] == ("actuator_pressure", "/plant/area/fv_102/pressure")
    assert one.qualities("auto") == {}
    prefix = "qos_overrides.{}.subscription.reliability"
    assert other.qualities("reliable") == {
        prefix.format("/plant/area/fv_102/pressure"): "reliable",
        prefix.format("/area/fv_102/stem"): "reliable",
    }


def test_a_file_of_valves(monitor, tmp_path):
    file = tmp_path / "plant.yaml"
    file.write_text("fv_101: {stem_topic: /x101}\nfv_102:\n")
    one, other = monitor.plant_valves(str(file), USUAL)
    assert dict(one.remappings(""))["stem_state"] == "/x101"
    assert dict(one.remappings(""))["actuator_pressure"] == "/plant/fv_101/pressure"
    assert other.topics == {**USUAL, "pressure_topic": "/plant/fv_102/pressure"}
    file.write_text("[fv_101, fv_102]")
    assert [valve.namespace for valve in monitor.plant_valves(str(file), USUAL)] == [
        "/fv_101",
        "/fv_102",
    ]


@pytest.mark.parametrize(("asked", "started"), [("true", ["dashboard"]), ("false", [])])
def test_the_dashboard_is_started_on_request(monitor, asked, started):
    names = monitor.dashboard.__globals__
    names["LaunchConfiguration"].return_value.perform.return_value = asked
    names["Node"].side_effect = lambda **settings: settings
    assert [node["executable"] for node in monitor.dashboard(None)] == started


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no valve given"),
        ("fv_101 fv_101", "'fv_101' is listed twice"),
        ("fv_101,/fv_101", "'/fv_101' is listed twice"),
        ("fv-101", "'fv-101' is not a ROS namespace"),
        ("missing.yaml", "'missing.yaml' is not a file"),
    ],
)
def test_wrong_lists_of_valves(monitor, text, words):
    with pytest.raises(ValueError, match=words):
        monitor.plant_valves(text, USUAL)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("fv_101: {topic: /x101}", "unknown key 'topic': use pressure_topic and stem_topic"),
        ("fv_101: /x101", "'fv_101' has '/x101': use pressure_topic and stem_topic"),
        ("fv_101: 5", "'fv_101' has '5': use pressure_topic and stem_topic"),
        ("fv_101: {stem_topic: }", "stem_topic '' of valve 'fv_101' is not a topic name"),
        (
            "fv_101: {stem_topic: '/{tag}/x'}",
            "stem_topic '/{tag}/x' of valve 'fv_101' is not a topic name",
        ),
        ("fv_101", "holds no valves: write a line such as 'fv_101:'"),
        ("fv_101: {stem_topic: /x", "cannot be read as YAML: while parsing a flow mapping in"),
    ],
)
def test_wrong_files_of_valves(monitor, tmp_path, content, words):
    """Each is refused before a process starts, which would end and be started again for ever."""
    file = tmp_path / "plant.yaml"
    file.write_text(content)
    with pytest.raises(ValueError, match=re.escape(words)):
        monitor.plant_valves(str(file), USUAL)


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Build a copy of the sources with colcon, and return the folder it installs into."""
    if importlib.util.find_spec("colcon_core") is None:
        pytest.skip("colcon is not installed: run make venv-test, or apt install colcon")
    workspace = tmp_path_factory.mktemp("workspace")
    ignored = shutil.ignore_patterns(
        ".*", "build", "install", "log", "__pycache__", "*.egg-info", "*.png"
    )
    shutil.copytree(PROJECT, workspace / "src" / NAME, ignore=ignored)
    build = subprocess.run(
        [sys.executable, "-m", "colcon", "--log-base", "log", "build", "--packages-select", NAME],
        cwd=workspace,
        env=os.environ | {"COLCON_HOME": str(workspace / "colcon")},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert build.returncode == 0, build.stdout + build.stderr
    return workspace / "install" / NAME


def files_below(folder):
    """Every file, modules and data alike, but for what running them leaves behind."""
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder) for path in paths if "__pycache__" not in path.parts}


def test_installed_tree(installed):
    executables = installed / "lib" / NAME
    assert {path.name for path in executables.iterdir()} == EXECUTABLES
    assert all(os.access(path, os.X_OK) for path in executables.iterdir())

    share = installed / "share"
    assert (share / "ament_index/resource_index/packages" / NAME).is_file()
    assert (share / NAME / "package.xml").is_file()
    for folder, pattern in (("config", "*.[jsxy]*"), ("launch", "*.launch.py")):
        wanted = {path.name for path in (PROJECT / folder).glob(pattern)}
        assert wanted
        assert {path.name for path in (share / NAME / folder).iterdir()} == wanted

    library = next(installed.glob(f"lib/python*/site-packages/{NAME}"))
    assert files_below(library) == files_below(PROJECT / NAME)


@pytest.fixture
def observer(monkeypatch):
    """A node that looks at the domain of the started process."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = rclpy.create_node("observer", context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


def wait_until(condition, process, output):
    """Ask until `condition` holds; fail when `process` ends before, or patience does."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert process.poll() is None, output.read_text()
        assert time.monotonic() < deadline, f"not within {PATIENCE:.0f} s: {output.read_text()}"
        time.sleep(0.02)


def test_node_from_the_installed_tree(installed, observer, tmp_path):
    library = next(installed.glob("lib/python*/site-packages"))
    environment = os.environ | {
        "AMENT_PREFIX_PATH": os.pathsep.join(
            filter(None, [str(installed), os.environ.get("AMENT_PREFIX_PATH")])
        ),
        "PYTHONPATH": os.pathsep.join(filter(None, [str(library), os.environ.get("PYTHONPATH")])),
        "ROS_DOMAIN_ID": str(DOMAIN),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOG_DIR": str(tmp_path / "log"),
    }
    where = printed("-c", f"import {NAME}; print({NAME}.__file__)", cwd=tmp_path, env=environment)
    assert Path(where.strip()).is_relative_to(library)

    output = tmp_path / "output.txt"
    command = [installed / "lib" / NAME / "identifier", "--ros-args", "-r", "__ns:=/fv_101"]
    if " " in sys.executable:  # no first line of a script can name such a Python
        command.insert(0, sys.executable)
    with output.open("w") as stream:
        process = subprocess.Popen(
            command, cwd=tmp_path, env=environment, stdout=stream, stderr=subprocess.STDOUT
        )
    try:
        wait_until(
            lambda: ("identifier", "/fv_101") in observer.get_node_names_and_namespaces(),
            process,
            output,
        )
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0, output.read_text()
    finally:
        process.kill()
        process.wait()
    assert "Traceback" not in output.read_text(), output.read_text()


SOURCES = [str(PROJECT / name) for name in ("valve_friction_ros", "launch", "setup.py")]
XML = [*PROJECT.glob("*.xml"), *PROJECT.glob("config/*.xml"), *PROJECT.rglob("nodes/*.xml")]


def result_of(linter, arguments):
    """Return the exit code of a linter; the test is skipped where it is not installed."""
    pytest.importorskip(linter)
    return importlib.import_module(f"{linter}.main").main(argv=[*arguments])


def test_flake8():
    assert result_of("ament_flake8", ["--config", str(PROJECT / ".flake8"), *SOURCES]) == 0


def test_pep257():
    """As numpydoc wants it; a value is described by a noun, a function by a verb (D401)."""
    options = ["--convention", "numpy", "--add-ignore", "D105", "D107", "D401", "--"]
    assert result_of("ament_pep257", [*options, *SOURCES]) == 0


def test_copyright():
    assert result_of("ament_copyright", SOURCES) == 0


def test_xmllint():
    if shutil.which("xmllint") is None:
        pytest.skip("xmllint is not installed")
    assert result_of("ament_xmllint", [str(path) for path in XML]) == 0


def test_xml_can_be_read():
    assert len(XML) >= 4
    for path in XML:
        ET.parse(path)


def test_release_check_names_what_is_left_for_the_owner():
    sys.path.insert(0, str(PROJECT / ".ci"))
    try:
        release = importlib.import_module("release")
    finally:
        sys.path.pop(0)
    faults = release.faults(PROJECT)
    address = ET.parse(PROJECT / "package.xml").find("maintainer").get("email")
    assert address.endswith(".example") == any(address in fault for fault in faults)
    assert not any("copyright" in fault for fault in faults), faults
