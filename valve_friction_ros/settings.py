# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The settings of the package, each declared once: default, range, unit and description.

A declaration and the text below it define the parameter of a node with its descriptor, the line in
``--help`` and in the reference, the key of a valve file and, where given, the option of the
commands that identify. A default that belongs to a value type is looked up on first use, so this
module imports nothing slow and no ROS.
"""

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from valve_friction_ros.identification.settings import (
    CALIBRATION,
    DEFAULT_METHOD,
    FIXABLE,
    METHOD_NAMES,
    MOST_UNCERTAIN,
    STATED,
    UNITS,
    IdentificationSettings,
    current_name,
)
from valve_friction_ros.records.files import history_file

ALARM_KINDS = (
    "friction_high",
    "friction_low",
    "stuck",
    "whole_valve",
    "data_quality",
    "positioner",
)
"""Names of the alarms of a valve, as in `health.AlarmKind`."""

PACKINGS = ("ptfe", "graphite")
"""Packing classes, as in `health.survey.PACKING_LIMITS`."""

_UNIT = re.compile(r" \[([^\]]+)\]")


class _Of(NamedTuple):
    """A default given by its location in the package, such as a field of a value type."""

    module: str
    name: str

    def value(self) -> Any:
        return attrgetter(self.name)(import_module(f"valve_friction_ros.{self.module}"))


@dataclass(frozen=True, eq=False)
class Setting:
    """One setting."""

    initial: bool | float | str | list[str] | _Of | None
    """Default, or where to find it; it fixes the type. None: a number that is unset until a value
    is given; nan also means unset. A default of the integer 0 means "not given"."""
    limits: tuple[float, float] | None = None
    """Lowest and highest value. Absent for a number that may be nan or infinite, because ROS treats
    nan as outside any range; the value types still check it."""
    read_only: bool = False
    """Whether it can only be given at start. Anyone on the ROS graph can change the others, so all
    addresses, folders and limits of disk space are read-only."""
    choices: tuple[str, ...] = ()
    """Permitted values of a text; empty: any."""
    option: str = ""
    """Option of the commands that identify; empty: none."""
    is_assumed: bool = False
    """Whether the default is only assumed until a value is given; the results report this."""
    spell: Callable[[str], str] = str
    """Converts a text to its present spelling."""
    name: str = ""
    """Name of the parameter, and key of a valve file."""
    description: str = ""
    """Meaning, with the unit in brackets; [-] for none."""

    @cached_property
    def _value(self) -> Any:
        return self.initial.value() if isinstance(self.initial, _Of) else self.initial

    @property
    def default(self) -> Any:
        """Value if none is given; None: unset."""
        return None if self.is_assumed else self._value

    @property
    def assumed(self) -> Any:
        """Value assumed while it is unset; None: nothing."""
        return self._value if self.is_assumed else None

    @property
    def unit(self) -> str:
        """Unit; empty for a pure number or a text."""
        return str(_UNIT.findall(self.description)[0]).strip("-")

    @property
    def meaning(self) -> str:
        """The description without the unit."""
        return _UNIT.sub("", self.description, count=1)

    @property
    def field(self) -> str:
        """Field of `IdentificationSettings`, and attribute of the parsed arguments."""
        return (self.option or self.name).lstrip("-").replace("-", "_")

    def is_given(self, value: Any) -> bool:
        """Return whether `value` differs from the values that mean "not given"."""
        is_zero = type(value) is int and value == 0 == self.default
        return not (value is None or value != value or is_zero)  # noqa: PLR0124 - nan


def _words() -> dict[tuple[str, str], str]:
    """Return the text below each declaration of this file, by class and name."""
    groups = ast.parse(Path(__file__).read_bytes()).body
    return {
        (group.name, ast.unparse(field.targets[0])): " ".join(ast.literal_eval(words.value).split())
        for group in groups
        if isinstance(group, ast.ClassDef)
        for field, words in pairwise(group.body)
        if isinstance(field, ast.Assign) and isinstance(words, ast.Expr)
    }


_WORDS = _words()


def _declared(group: type, **changes: Any) -> tuple[Setting, ...]:
    """Return the settings that a class declares, with the changes common to them."""
    return tuple(
        replace(one, name=name, description=_WORDS[group.__name__, name].rstrip("."), **changes)
        for name, one in vars(group).items()
        if isinstance(one, Setting)
    )


class _Valve:
    diaphragm_area = Setting(_Of("model", "BENCH_VALVE.diaphragm_area"), (1e-6, 1e3))
    """Diaphragm area S_a [m²]."""
    pressure_reference = Setting(_Of("model", "BENCH_VALVE.pressure_reference"), (-1e9, 1e9))
    """Pressure at which the actuator exerts no force, P_ref [Pa]: 101325 for an absolute sensor, 0
    for a gauge sensor."""
    travel = Setting(_Of("model", "BENCH_VALVE.travel"))
    """Stem travel between its stops [m]; .inf: no stops. Above zero."""
    pressure_minimum = Setting(_Of("model", "BENCH_VALVE.pressure_minimum"))
    """Lowest pressure the sensor can read [Pa]; below it a sample is rejected. -.inf: none."""
    pressure_maximum = Setting(_Of("model", "BENCH_VALVE.pressure_maximum"))
    """Highest pressure the sensor can read [Pa]; above it a sample is rejected. .inf: none."""


class _Karnopp:
    mass = Setting(_Of("model", "LOW_FRICTION.mass"), (1e-6, 1e6))
    """Moving mass m [kg]."""
    viscous_friction = Setting(_Of("model", "LOW_FRICTION.viscous_friction"), (0.0, 1e9))
    """Viscous friction coefficient F_v [N·s/m]."""
    coulomb_friction = Setting(_Of("model", "LOW_FRICTION.coulomb_friction"), (0.0, 1e9))
    """Coulomb friction F_c [N], not above static_friction."""
    static_friction = Setting(_Of("model", "LOW_FRICTION.static_friction"), (0.0, 1e9))
    """Static friction F_s [N], not below coulomb_friction."""
    spring_constant = Setting(_Of("model", "LOW_FRICTION.spring_constant"), (0.0, 1e12))
    """Spring constant k [N/m]."""
    spring_preload = Setting(_Of("model", "LOW_FRICTION.spring_preload"), (-1e9, 1e9))
    """Spring force at the closed stop F_0 [N]."""
    limit_velocity = Setting(_Of("model", "LOW_FRICTION.limit_velocity"), (0.0, 1e3))
    """Speed DV at which the stem comes to rest [m/s]; 0: the exact limit."""


class _Identification:
    method = Setting(DEFAULT_METHOD, choices=METHOD_NAMES, option="--method", spell=current_name)
    """Identification method [-]: plant also fits the imperfections of a plant; bench fits the
    Karnopp model alone; published is the regression of the paper; signature needs two periods of a
    slow triangle in the window."""
    derivative_window = Setting(0, (0, 100_001), option="--derivative-window")
    """Length d of the derivative window [samples], odd; 0: 31 for the published estimate, and
    chosen from the noise of each record for the method signature."""
    timing_uncertainty = Setting(None, option="--timing-uncertainty")
    """Standard deviation of the total lag between the signals [s]: clocks, transmitters, the volume
    ahead of the diaphragm; unset: 0.04 for a plant without special measures, and 0 for the method
    bench; 0: the signals are known to be synchronous."""
    polynomial_order = Setting(IdentificationSettings.order, (2, 20), option="--order")
    """Order n of the derivative polynomial [-]."""
    position_bias = Setting(None, option="--position-bias")
    """Bias x̄ of the position [m], for the four-column form of the methods published and signature;
    unset: identify the preload."""
    assumed_mass = Setting(IdentificationSettings.assumed_mass, (1e-6, 1e6))
    """Mass assumed where the record does not determine it and none is stated [kg]."""


class _Survey:
    packing = Setting("ptfe", choices=PACKINGS, option="--packing")
    """Packing class [-], which sets the dead band limits of a first survey without a baseline:
    ptfe, watch from 10 % of the travel and bad from 20 %; graphite, 15 % and 30 %."""
    survey_watch = Setting(None, option="--survey-watch")
    """Dead band above which a first survey says watch, as a share of the travel [-]; unset: that of
    the packing."""
    survey_bad = Setting(None, option="--survey-bad")
    """Dead band above which a first survey says bad, as a share of the travel [-]; unset: that of
    the packing."""


class _Identifier:
    window = Setting(60.0, (0.1, 86400.0))
    """Length of the record that is buffered and identified [s]."""
    input_timeout = Setting(3.0, (0.1, 86400.0))
    """Time without a message after which an input is reported as silent [s]."""
    clock_tolerance = Setting(60.0, (0.0, 1e9))
    """Difference between stamps and the node's clock above which a fault is reported [s]; 0: never,
    as for recordings played without /clock."""
    identification_limit = Setting(600.0, (1.0, 86400.0))
    """Time after which an unfinished identification is reported as stuck [s]."""
    baseline_coulomb_friction = Setting(None)
    """Coulomb friction of the healthy valve [N], above zero; unset: unknown."""
    baseline_in_alarm = Setting(False)
    """Whether ~/set_baseline and ~/restore_baseline may change the baseline while the level is WARN
    or ERROR [-]."""
    warn_ratio = Setting(_Of("health", "FrictionLimits.warn_ratio"), (1.0, 1e3))
    """Ratio of friction to baseline that calls for maintenance [-]."""
    error_ratio = Setting(_Of("health", "FrictionLimits.error_ratio"), (1.0, 1e3))
    """Ratio of friction to baseline that is excessive [-]."""
    low_ratio = Setting(_Of("health", "FrictionLimits.low_ratio"), (0.0, 1.0))
    """Ratio of friction to baseline below which the packing may leak [-]."""
    save_folder = Setting("", read_only=True)
    """Folder that ~/save writes bags into [-]; empty: valve_friction_ros/saved under ROS_HOME, or
    under ~/.ros; a relative path is below valve_friction_ros there."""
    save_megabytes = Setting(1000.0, (0.001, 1e6), read_only=True)
    """Disk space that the bags of ~/save may take per valve [MB], and likewise the reports of
    ~/report; once it is used up, the service refuses."""
    report_folder = Setting("", read_only=True)
    """Folder that ~/report writes pages into [-]; empty: valve_friction_ros/reports under ROS_HOME,
    or under ~/.ros; a relative path is below valve_friction_ros there."""
    history_days = Setting(1100.0, (0.0, 36525.0), read_only=True)
    """Time for which the history is kept [days]; 0: forever."""
    period = Setting(0.0, (0.0, 31_557_600.0))
    """Time from one scheduled identification to the next [s]; 0: only on demand."""
    spring_change = Setting(_Of("health", "ValveLimits.spring_change"), (0.0, 1e3))
    """Relative change of the spring constant from the baseline that calls for maintenance [-]."""
    spring_failure = Setting(_Of("health", "ValveLimits.spring_failure"), (0.0, 1e3))
    """Relative change of the spring constant from the baseline that is a failure [-]."""
    preload_change = Setting(_Of("health", "ValveLimits.preload_change"), (0.0, 1e3))
    """Change of the preload from the baseline that is reported, as a share of the spring force over
    the travel [-]."""
    slip_change = Setting(_Of("health", "ValveLimits.slip_change"), (0.0, 1e3))
    """Growth of the slip jump over the baseline that is reported, as a share of the travel [-]."""
    viscous_factor = Setting(_Of("health", "ValveLimits.viscous_factor"), (0.0, 1e3))
    """Factor by which viscous friction rises or falls from the baseline that is reported [-]."""
    asymmetry_change = Setting(_Of("health", "ValveLimits.asymmetry_change"), (0.0, 1e3))
    """Change of the asymmetry of viscous friction, upward to downward, from the baseline that is
    reported, as a share [-]."""
    stop_change = Setting(_Of("health", "ValveLimits.stop_change"), (0.0, 1e3))
    """Shift of a travel stop from the baseline that is reported, as a share of the travel [-]."""
    noise_factor = Setting(_Of("health", "ValveLimits.noise_factor"), (0.0, 1e3))
    """Factor by which the noise of a sensor rises over the baseline that is reported [-]."""
    lag_change = Setting(_Of("health", "ValveLimits.lag_change"), (0.0, 1e3))
    """Change of the lag of the stem behind the pressure, from the baseline, that is reported
    [s]."""
    command_unit = Setting("m", choices=("m", "%"))
    """Unit of stem_command [-]: m, or % of the travel."""
    deviation_limit = Setting(0.0, (0.0, 100.0))
    """Median deviation of the resting stem from its command that raises a warning [% of the
    travel]; 0: none."""
    dead_time_limit = Setting(0.0, (0.0, 3600.0))
    """Median dead time T_d from a step of the command to the first movement that raises a warning
    [s]; 0: none."""
    t86_limit = Setting(0.0, (0.0, 3600.0))
    """Median T86, from a step of the command to 86.5 % of the move, that raises a warning [s]; 0:
    none."""
    webhook_url = Setting("", read_only=True)
    """Address to which each change of the level is posted [-], https, or http on this machine;
    empty: VALVE_FRICTION_WEBHOOK_URL from the environment, or nowhere. Put no secret in it:
    everybody on the ROS graph can read it. No token is sent there."""
    webhook_period = Setting(60.0, (0.0, 86400.0))
    """Shortest time between two posts [s]; the newest level is posted once it has passed."""
    webhook_digest = Setting(-1.0, (-1.0, 23.999))
    """Time of day at which a single post lists the alarms of all valves of the process [h], UTC;
    below 0: no digest."""
    counting_dead_band = Setting(_Of("usage", "DEFAULT_BAND"), (1e-6, 0.5))
    """Dead band for counting distance, reversals and breakaways, as a share of the travel [-];
    raised where the noise or resolution of the sensor demands more."""
    air_to = Setting("open", choices=("open", "close"))
    """What air does [-]: open, the seat is at position 0; close, the seat is at full travel."""
    travel_limit = Setting(0.0, (0.0, 1e9))
    """Stem travel over the life of a packing [m]; 0: no limit."""
    reversal_limit = Setting(0.0, (0.0, 1e12))
    """Reversals over the life of a packing [-]; 0: no limit."""
    alarm_recording = Setting(10.0, (0.0, 600.0))
    """Time after a rise of the level until the buffer, from before and after it, is saved [s]; 0:
    never."""
    alarm_folder = Setting("", read_only=True)
    """Folder of these recordings [-]; empty: valve_friction_ros/alarms under ROS_HOME, or under
    ~/.ros; a relative path is below valve_friction_ros there."""
    alarm_recordings = Setting(20, (1, 100_000), read_only=True)
    """Number of the latest recordings kept per valve [-]."""
    alarm_megabytes = Setting(200.0, (0.001, 1e6), read_only=True)
    """Disk space that the recordings may take per valve [MB]."""
    alarm_pause = Setting(600.0, (0.0, 31_557_600.0))
    """Time after a recording during which only a higher level is recorded [s]."""
    alarm_kind = Setting("all", choices=("all", *ALARM_KINDS))
    """Alarm that the next request concerns [-]; a request resets these four parameters."""
    alarm_who = Setting("")
    """Person who makes the next request on an alarm [-]; required."""
    alarm_text = Setting("")
    """Comment of that person [-], stored with the request."""
    alarm_hours = Setting(8.0, (0.0, 8784.0))
    """Time for which the next request shelves an alarm, at most 720, or takes it out of service
    [h]."""
    valve_tag = Setting("", read_only=True)
    """Tag of the valve, hardware_id of its diagnostics [-]; empty: the namespace, or the
    name of the node without one."""
    history_file = Setting(str(history_file()), read_only=True)
    """File in which identifications and baselines are stored [-]; empty: nowhere."""
    history_url = Setting("", read_only=True)
    """PostgreSQL server to which the history_file is sent, postgresql://user@host/database [-];
    empty: VALVE_FRICTION_HISTORY_URL from the environment, or none. Put no password here."""
    joint = Setting(_Of("streams.samples", "DEFAULT_JOINT"), read_only=True)
    """Name of the stem's joint in stem_state [-]; empty: the first joint."""
    estimate_topic = Setting(True, read_only=True)
    """Whether ~/estimate publishes what is known of the valve, latched for late subscribers [-];
    /diagnostics has the same every second."""
    result_topic = Setting(False, read_only=True)
    """Whether ~/result publishes the numbers of each identification in one stamped message [-]."""
    number_topics = Setting(False, read_only=True)
    """Whether each number, and the sweep, is published on a latched topic of its own [-]."""


class _Managed:
    lifecycle = Setting(False, read_only=True)
    """Whether the node waits until it is configured and activated, as with `ros2 lifecycle set`
    [-]; false: it is active from the start."""


class _Identifiers:
    valves = Setting([""], read_only=True)
    """Namespaces of the valves, one identifier per valve [-]."""
    identification_processes = Setting(2, (0, 64), read_only=True)
    """Largest number of worker processes that identify in parallel, which end when idle [-]; 0:
    threads of this process."""
    parameter_services = Setting(True, read_only=True)
    """Whether parameters of the valves can be read and changed at run time, and their alarms
    acknowledged by services [-]; off for more than 20 valves unless set, as it doubles the cost of
    starting a process."""


class _Simulator:
    position_noise = Setting(0.0, (0.0, 1.0))
    """Standard deviation of the stem sensor's noise [m]."""
    noise_seed = Setting(0, (0, 2**31 - 1), read_only=True)
    """Seed of the noise [-]."""
    joint = Setting(_Of("streams.samples", "DEFAULT_JOINT"), read_only=True)
    """Name of the stem's joint in stem_state [-]; empty: the first joint."""


class _StrokePlayer:
    file = Setting("")
    """CSV file with the columns time_s and pressure_pa, as plan-test writes it [-]; required."""
    file_minimum = Setting(0.0, (-1e9, 1e9))
    """Lowest pressure that may be set [Pa]."""
    file_maximum = Setting(0.0, (-1e9, 1e9))
    """Highest pressure that may be set [Pa]; required."""
    file_rate = Setting(1e12, (0.0, 1e12))
    """Largest rate of the pressure in the file [Pa/s]."""
    pressure_margin = Setting(_Of("planning.played_test", "PRESSURE_MARGIN"), (0.0, 1e9))
    """Margin by which the measured pressure may exceed these two limits [Pa]."""
    position_minimum = Setting(0.0, (-10.0, 10.0))
    """Stem position below which the test returns to its start [m]."""
    position_maximum = Setting(0.0, (-10.0, 10.0))
    """Stem position above which the test returns to its start [m]; required."""
    silence = Setting(1.0, (0.05, 60.0))
    """Time without a pressure or a stem position after which the test returns to its start [s]."""
    longest_test = Setting(3600.0, (1.0, 86400.0))
    """Longest duration of a test [s]."""
    sample_rate = Setting(20.0, (1.0, 1000.0))
    """Set points per second [Hz]."""
    joint = Setting(_Of("streams.samples", "DEFAULT_JOINT"))
    """Name of the stem's joint in stem_state [-]; empty: the first joint."""


class _PressureSource:
    excitation = Setting("square")
    """Signal: square, triangle, sine, isa_steps or file [-]."""
    low = Setting(_Of("model", "SquareWave.low"), (-1e9, 1e9))
    """Lowest pressure of the signal [Pa]."""
    high = Setting(_Of("model", "SquareWave.high"), (-1e9, 1e9))
    """Highest pressure of the signal [Pa]."""
    period = Setting(_Of("model", "SquareWave.period"), (1e-3, 1e6))
    """Period of square, triangle and sine; hold time of each isa_steps level [s]."""
    file = Setting("")
    """CSV file with the columns time_s and pressure_pa, for the excitation file [-]."""
    file_minimum = Setting(-1e9, (-1e9, 1e9))
    """Lowest pressure in the file [Pa]."""
    file_maximum = Setting(1e9, (-1e9, 1e9))
    """Highest pressure in the file [Pa]."""
    file_rate = Setting(1e12, (0.0, 1e12))
    """Largest rate of the pressure in the file [Pa/s]."""
    sample_rate = Setting(1000.0, (0.1, 1e5))
    """Samples per second of the signal [Hz]."""
    speed = Setting(1.0, (1e-3, 1e3))
    """Seconds of signal published per second of real time [-]."""
    converter_lag = Setting(_Of("model", "DEFAULT_LAG"), (0.0, 1e3))
    """Time constant of the V/P converter [s]."""
    pressure_noise = Setting(0.0, (0.0, 1e9))
    """Standard deviation of white noise on the pressure, which the stem feels too [Pa]."""
    time_jitter = Setting(0.0, (0.0, 1.0))
    """Largest deviation of a sample's time, either way; below half of a period [s]."""
    noise_seed = Setting(0, (0, 2**31 - 1))
    """Seed of the noise and the jitter [-]."""


class _Dashboard:
    host = Setting(_Of("dashboard.accounts", "Access.host"))
    """Address to listen on [-]; any other than loopback needs accounts."""
    host_names = Setting("")
    """Host names under which browsers reach it, besides its address, separated by commas [-]."""
    accounts_file = Setting("")
    """Accounts file, made with `valve_friction dashboard-account` [-]; empty: from the
    environment."""
    certificate_file = Setting("")
    """TLS certificate, PEM [-]; empty: no TLS."""
    key_file = Setting("")
    """Private key of the certificate, PEM [-]."""
    session_hours = Setting(_Of("dashboard.accounts", "Access.session_hours"), (0.1, 10000.0))
    """Time after which a session ends [h]."""
    session_file = Setting("")
    """File that keeps sessions across a restart [-]; empty: a restart ends them."""
    port = Setting(_Of("dashboard", "DashboardOptions.port"), (1, 65535))
    """Port to listen on [-]."""
    history_file = Setting(str(history_file()))
    """History file of the identifiers, which is read [-]; empty: none."""
    history_url = Setting("")
    """PostgreSQL server with the histories of the identifiers, read instead of the file [-]; empty:
    VALVE_FRICTION_HISTORY_URL from the environment. Put no password here."""
    time_zone = Setting(_Of("dashboard", "DashboardOptions.time_zone"))
    """Time zone, an IANA name such as Europe/Berlin [-]."""
    silence = Setting(_Of("dashboard", "DashboardOptions.silence"), (1.5, 86400.0))
    """Time without a message after which a valve is shown as silent [s]."""
    report_folder = Setting("")
    """Folder of the reports to offer [-]; empty: the default of the identifiers."""
    save_folder = Setting("")
    """Folder of the saved bags to offer [-]; empty: the default of the identifiers."""
    alarm_folder = Setting("")
    """Folder of the alarm recordings to offer [-]; empty: the default of the identifiers."""


VALVE = _declared(_Valve, is_assumed=True)
"""Description of a monitored valve; a simulated valve is by default that of the paper."""

KARNOPP = _declared(_Karnopp)
"""Friction and spring of a simulated valve."""

IDENTIFICATION = (
    *_declared(_Identification),
    *(
        Setting(
            getattr(IdentificationSettings, name),
            (0.0, MOST_UNCERTAIN),
            option=f"--{name.replace('_', '-')}",
            name=name,
            description=f"Relative standard uncertainty of {what} [-], 0.02 for 2 %: widens every "
            "interval",
        )
        for name, what in CALIBRATION.items()
    ),
    *(
        Setting(
            None,
            name=f"fixed.{name}",
            description=f"Known value of {name} [{UNITS.get(name, 'm/s')}]; it is then not "
            "identified; unset: unknown",
        )
        for name in FIXABLE
    ),
)
"""Settings of an identification by nodes and commands, for `identification_from`."""

SURVEY = _declared(_Survey)
"""Limits of a first survey in nodes, commands and valve files, for `survey_from`."""

_BY_DATA_SHEET = tuple(
    replace(
        one,
        initial=None,
        description=f"{one.description}, from the data sheet: compared with the record",
    )
    for one in KARNOPP
    if one.name in STATED
)
_MANAGED = _declared(_Managed)
_IDENTIFIER = (
    *VALVE,
    *_BY_DATA_SHEET,
    *IDENTIFICATION,
    *SURVEY,
    *_declared(_Identifier),
    *_MANAGED,
)

HOST = _declared(_Identifiers)
"""Parameters of the node `identifiers` itself."""

NODES: Mapping[str, tuple[Setting, ...]] = MappingProxyType(
    {
        "identifier": _IDENTIFIER,
        "identifiers": (*HOST, *_IDENTIFIER),
        "simulator": (*_declared(_Valve), *KARNOPP, *_declared(_Simulator)),
        "pressure_source": _declared(_PressureSource, read_only=True),
        "stroke_player": _declared(_StrokePlayer, read_only=True),
        "dashboard": (*_declared(_Dashboard, read_only=True), *_MANAGED),
    }
)
"""Parameters of each node; `identifiers` also has those of its identifiers."""

COLUMNS = "columns"
"""Section of a valve file that describes tables of samples."""

VALVE_KEYS = tuple(
    dict.fromkeys((*(one.name for one in VALVE), *FIXABLE, *(one.name for one in _IDENTIFIER)))
)
"""Keys of a valve file besides `COLUMNS`; commands ignore those that only the identifier uses."""

NODE_NAMES = frozenset(one.name for settings in NODES.values() for one in settings)
"""Names of the parameters of all nodes of this package."""

_OF_ROS = ("use_sim_time", "start_type_description_service")


def is_known(name: str) -> bool:
    """Return whether a node of this package, or rclpy on its behalf, reads a parameter."""
    return (
        name in NODE_NAMES or name in _OF_ROS or name.startswith((f"{COLUMNS}.", "qos_overrides"))
    )


def survey_from(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the given settings of `SURVEY` as arguments of `SurveyLimits.of_packing`."""
    return {
        one.name.removeprefix("survey_"): given[one.name]
        for one in SURVEY
        if given.get(one.name) is not None
    }


def identification_from(given: Mapping[str, Any], **others: Any) -> IdentificationSettings:
    """Build the settings of an identification from the given settings of `IDENTIFICATION`.

    `others` are fields without a setting, such as `stated`. Raises ValueError if values are
    impossible or incompatible.
    """
    fixed = {
        name.removeprefix("fixed."): value
        for name, value in given.items()
        if name.startswith("fixed.")
    }
    fields = {
        one.field: given[one.name]
        for one in IDENTIFICATION
        if one.name in given and one.name != "method" and "." not in one.name
    }
    return IdentificationSettings(**{**fields, "fixed": fixed, **others})
