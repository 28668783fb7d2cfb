# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Installation of valve_friction_ros, for colcon and for pip."""

import xml.etree.ElementTree as ET
from pathlib import Path

from setuptools import find_packages, setup

NAME = "valve_friction_ros"
HERE = Path(__file__).resolve().parent

MANIFEST = ET.parse(HERE / "package.xml").getroot()  # noqa: S314 - our own
MAINTAINER = MANIFEST.find("maintainer")


def files(pattern: str) -> list[str]:
    """Paths matching `pattern`, relative to this file and in a fixed order."""
    return sorted(path.relative_to(HERE).as_posix() for path in HERE.glob(pattern))


setup(
    name=NAME,
    version=MANIFEST.findtext("version"),
    description="Karnopp friction of control valves: identified and diagnosed on ROS 2 topics",
    long_description=(HERE / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    classifiers=[
        "Environment :: Console",
        "Intended Audience :: Manufacturing",
        "Intended Audience :: Science/Research",
        "Operating System :: POSIX :: Linux",
        "Programming Language :: Python :: 3",
        "Topic :: Scientific/Engineering",
        "Typing :: Typed",
    ],
    maintainer=MAINTAINER.text,
    maintainer_email=MAINTAINER.get("email"),
    author=", ".join(one.text for one in MANIFEST.findall("author")) or None,
    url=MANIFEST.findtext("url"),
    license="Apache-2.0",
    python_requires=">=3.10",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: ["py.typed", "**/*.xml", "**/*.html", "dashboard/pages/*.js", "dashboard/pages/*.css"]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", files("config/*.[jsxy]*")),
        (f"share/{NAME}/launch", files("launch/*.launch.py")),
        (f"share/{NAME}/examples/paper", files("examples/paper/*.py")),
    ],
    install_requires=[  # the oldest versions that `make test-oldest` tests
        "setuptools",
        "Jinja2>=3.1.2",
        "matplotlib>=3.6.3",
        "numba>=0.58.1",
        "numpy>=1.26.4",
        "pandas>=2.1.4",
        "PyYAML>=6.0.1",
        "rich>=13.7.1",
        "scipy>=1.11.4",
        "SQLAlchemy>=1.4.50",
    ],
    extras_require={
        # Private names of rosbags 0.11 are used.
        "bags": ["backports.zstd", "lz4", "rosbags>=0.11.9,<0.12"],
        "cluster": ["distributed>=2026.8"],  # Dask: folders on many machines
        "dashboard": ["nicegui>=3.18,<4"],
        # SQLAlchemy 1.4 does not know psycopg 3.
        "database": ["SQLAlchemy>=2.0,<3", "psycopg[binary]>=3.2,<4"],
        "stores": ["s3fs", "universal_pathlib>=0.3.10,<0.4"],  # folders in object stores
        "tables": ["openpyxl", "pyarrow"],  # Excel and Parquet
        # By pytest among them `colcon test` knows that there are tests.
        "test": ["hypothesis", "pytest", "pytest-timeout"],
    },
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "dashboard = valve_friction_ros.nodes.start:dashboard",
            "identifier = valve_friction_ros.nodes.start:identifier",
            "identifiers = valve_friction_ros.nodes.start:identifiers",
            "simulator = valve_friction_ros.nodes.start:simulator",
            "stroke_player = valve_friction_ros.nodes.start:stroke_player",
            "pressure_source = valve_friction_ros.nodes.start:pressure_source",
            "valve_friction = valve_friction_ros.commands.start:main",
        ],
    },
)
