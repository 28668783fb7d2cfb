# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The linters of ROS, where they are installed: `colcon test` runs them so."""

import importlib
import shutil
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[1]
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
