"""Installation of valve_friction_ros, for colcon and for pip."""

import re
from pathlib import Path

from setuptools import find_packages, setup

NAME = "valve_friction_ros"
HERE = Path(__file__).resolve().parent

(VERSION,) = re.findall("<version>(.*)</version>", (HERE / "package.xml").read_text("utf-8"))


def files(pattern: str) -> list[str]:
    """Paths matching `pattern`, relative to this file and in a fixed order."""
    return sorted(path.relative_to(HERE).as_posix() for path in HERE.glob(pattern))


setup(
    name=NAME,
    version=VERSION,
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
    maintainer="valve_friction_ros developers",
    maintainer_email="maintainers@valve-friction-ros.example",
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
    ],
    install_requires=[  # the oldest versions that `make test-oldest` tests
        "setuptools",
        "Jinja2>=3.1.2",
        "matplotlib>=3.6.3",
        "numba>=0.58.1",
        "numpy>=1.26.4",
        "PyYAML>=6.0.1",
        "rich>=13.7.1",
        "scipy>=1.11.4",
    ],
    extras_require={
        # Private names of rosbags 0.11 are used.
        "bags": ["backports.zstd", "lz4", "rosbags>=0.11.9,<0.12"],
        "cluster": ["distributed>=2026.8"],  # Dask: folders on many machines
        "dashboard": ["nicegui>=3.18,<4"],
        "database": ["psycopg[binary]>=3.2,<4"],
        "stores": ["s3fs", "universal_pathlib>=0.3.10,<0.4"],  # folders in object stores
        "tables": ["openpyxl", "pandas", "pyarrow"],  # Excel and Parquet
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
            "pressure_source = valve_friction_ros.nodes.start:pressure_source",
            "valve_friction = valve_friction_ros.commands.start:main",
        ],
    },
)
