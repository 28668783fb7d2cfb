# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The settings of the package, each declared once: its default, range, unit and description.

A declaration, with its words below it, makes the parameter of a node with its descriptor, the line
of ``--help`` and of the reference, the key of a valve file, and, where it names one, the option of
the commands that identify. A default that a value type has is taken from there when it is asked
for: this module imports nothing slow and no ROS.
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
    IdentificationSettings,
    current_name,
)
from valve_friction_ros.identification.units import UNITS
from valve_friction_ros.records.data_folder import history_file

ALARM_KINDS = (
    "friction_high",
    "friction_low",
    "stuck",
    "whole_valve",
    "data_quality",
    "positioner",
)
"""Names of a valve's alarms; those of `health.AlarmKind`."""

PACKINGS = ("ptfe", "graphite")
"""Classes of packing; those of `health.survey.PACKING_LIMITS`."""

_UNIT = re.compile(r" \[([^\]]+)\]")


class _Of(NamedTuple):
    """A default by its place below the package, such as a field of a value type."""

    module: str
    name: str

    def value(self) -> Any:
        return attrgetter(self.name)(import_module(f"valve_friction_ros.{self.module}"))


@dataclass(frozen=True, eq=False)
class Setting:
    """One setting.

    Attributes
    ----------
    initial : bool, int, float, str, list of str, or where to find it
        Default, which fixes the type. None: a number that is unset until somebody states it; a nan
        is taken for unset. The whole number 0 as a default stands for "not given".
    limits : tuple of float, optional
        Lowest and highest value. A number that may be nan or infinite has none, because ROS counts
        nan as outside any range; the value types check it all the same.
    read_only : bool
        It can only be given at start. Whoever reaches the ROS graph can change the others, so all
        addresses, folders and their room are among these.
    choices : tuple of str
        Values that a text may have; any, if empty.
    option : str
        Option of the commands that identify; none, if empty.
    is_assumed : bool
        The default is only assumed while nobody states a value, and the results say so.
    spell : callable
        Returns the present spelling of a text.
    name : str
        Name of the parameter, and key of a valve file.
    description : str
        What it means, with its unit in brackets, [-] for none.
    """

    initial: bool | float | str | list[str] | _Of | None
    limits: tuple[float, float] | None = None
    read_only: bool = False
    choices: tuple[str, ...] = ()
    option: str = ""
    is_assumed: bool = False
    spell: Callable[[str], str] = str
    name: str = ""
    description: str = ""

    @cached_property
    def _value(self) -> Any:
        return self.initial.value() if isinstance(self.initial, _Of) else self.initial

    @property
    def default(self) -> Any:
        """Value where none is given; None: unset."""
        return None if self.is_assumed else self._value

    @property
    def assumed(self) -> Any:
        """What is taken while the value is unset; None: nothing."""
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
        """Return False for what stands for "not given"."""
        is_zero = type(value) is int and value == 0 == self.default
        return not (value is None or value != value or is_zero)  # noqa: PLR0124 - nan


def _words() -> dict[tuple[str, str], str]:
    """Return what stands below each declaration of this file, by its class and name."""
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
    """Return the settings that a class declares, with what is common to them."""
    return tuple(
        replace(one, name=name, description=_WORDS[group.__name__, name].rstrip("."), **changes)
        for name, one in vars(group).items()
        if isinstance(one, Setting)
    )


class _Valve:
    diaphragm_area = Setting(_Of("model", "BENCH_VALVE.diaphragm_area"), (1e-6, 1e3))
    """Diaphragm area S_a [m²]."""
    pressure_reference = Setting(_Of("model", "BENCH_VALVE.pressure_reference"), (-1e9, 1e9))
    """Pressure without force P_ref [Pa]: 101325 for an absolute sensor, 0 for a gauge sensor."""
    travel = Setting(_Of("model", "BENCH_VALVE.travel"))
    """Stem travel between its stops [m]; .inf: no stops. Above zero."""
    pressure_minimum = Setting(_Of("model", "BENCH_VALVE.pressure_minimum"))
    """Lowest pressure the sensor can read [Pa]; below it a sample is rejected. -.inf: none."""
    pressure_maximum = Setting(_Of("model", "BENCH_VALVE.pressure_maximum"))
    """Highest pressure the sensor can read [Pa]; above it a sample is rejected. .inf: none."""


class _Karnopp:
    mass = Setting(_Of("model", "LOW_FRICTION.mass"), (1e-6, 1e6))
    """Mass of the moving parts m [kg]."""
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
    """Method of identification [-]: plant, with the imperfections of a plant in the fit; bench,
    with the Karnopp model alone; published, the regression of the paper; signature, for two periods
    of a slow triangle in the window."""
    derivative_window = Setting(0, (0, 100_001), option="--derivative-window")
    """Length d of the derivative window [samples], odd; 0: 31 for the published estimate, and
    chosen from the noise of each record for the method signature."""
    timing_uncertainty = Setting(None, option="--timing-uncertainty")
    """Standard deviation of the whole lag between the signals [s]: clocks, transmitters, a volume
    before the diaphragm; unset: 0.04, a plant without special care, and 0 by the
    method bench; 0: the signals surely belong together."""
    polynomial_order = Setting(IdentificationSettings.order, (2, 20), option="--order")
    """Order n of the derivative polynomial [-]."""
    position_bias = Setting(None, option="--position-bias")
    """Bias x̄ of the position [m], for the four-column form of the methods published and signature;
    unset: identify the preload."""
    assumed_mass = Setting(IdentificationSettings.assumed_mass, (1e-6, 1e6))
    """Mass assumed where a record does not determine it, and mass is not stated [kg]."""


class _Survey:
    packing = Setting("ptfe", choices=PACKINGS, option="--packing")
    """Class of the packing [-], by which a first survey without a baseline judges the dead band:
    ptfe, watched from 10 % of the travel and bad from 20; graphite, 15 and 30."""
    survey_watch = Setting(None, option="--survey-watch")
    """Dead band from which a first survey says watch, as a share of the travel [-]; unset: that of
    the packing."""
    survey_bad = Setting(None, option="--survey-bad")
    """Dead band from which a first survey says bad, as a share of the travel [-]; unset: that of
    the packing."""


class _Identifier:
    window = Setting(60.0, (0.1, 86400.0))
    """Length of the record that is kept and identified [s]."""
    input_timeout = Setting(3.0, (0.1, 86400.0))
    """Silence of an input after which it is reported [s]."""
    clock_tolerance = Setting(60.0, (0.0, 1e9))
    """Distance of stamps from the clock of the node from which it is reported [s]; 0: none, as for
    recordings that are played without /clock."""
    identification_limit = Setting(600.0, (1.0, 86400.0))
    """Time after which an identification that has not ended is reported as stuck [s]."""
    baseline_coulomb_friction = Setting(None)
    """Coulomb friction of the healthy valve [N], above zero; unset: not known."""
    baseline_in_alarm = Setting(False)
    """Whether ~/set_baseline and ~/restore_baseline may change the baseline in WARN or
    ERROR [-]."""
    warn_ratio = Setting(_Of("health", "FrictionLimits.warn_ratio"), (1.0, 1e3))
    """Friction over baseline worth maintenance [-]."""
    error_ratio = Setting(_Of("health", "FrictionLimits.error_ratio"), (1.0, 1e3))
    """Friction over baseline in excess [-]."""
    low_ratio = Setting(_Of("health", "FrictionLimits.low_ratio"), (0.0, 1.0))
    """Friction over baseline at which the packing may leak [-]."""
    save_folder = Setting("", read_only=True)
    """Folder that ~/save writes bags into [-]; empty: valve_friction_ros/saved under ROS_HOME, or
    under ~/.ros; a relative one is in valve_friction_ros there."""
    save_megabytes = Setting(1000.0, (0.001, 1e6), read_only=True)
    """Room that the bags of ~/save of a valve may take [MB], and as much the pages of ~/report;
    when it is full, both refuse."""
    report_folder = Setting("", read_only=True)
    """Folder that ~/report writes pages into [-]; empty: valve_friction_ros/reports under ROS_HOME,
    or under ~/.ros; a relative one is in valve_friction_ros there."""
    history_days = Setting(1100.0, (0.0, 36525.0), read_only=True)
    """Time for which they are kept [days]; 0: for ever."""
    period = Setting(0.0, (0.0, 31_557_600.0))
    """Time from one scheduled identification to the next [s]; 0: only on demand."""
    spring_change = Setting(_Of("health", "ValveLimits.spring_change"), (0.0, 1e3))
    """Change of the spring constant, as a share, worth maintenance [-], against the baseline."""
    spring_failure = Setting(_Of("health", "ValveLimits.spring_failure"), (0.0, 1e3))
    """Change of the spring constant, as a share, that is a failure [-], against the baseline."""
    preload_change = Setting(_Of("health", "ValveLimits.preload_change"), (0.0, 1e3))
    """Shift of the preload over the spring's force in the travel, reported [-], against the
    baseline."""
    slip_change = Setting(_Of("health", "ValveLimits.slip_change"), (0.0, 1e3))
    """Growth of the slip jump, as a share of the travel, reported [-], against the baseline."""
    viscous_factor = Setting(_Of("health", "ValveLimits.viscous_factor"), (0.0, 1e3))
    """Factor of the viscous friction, up or down, reported [-], against the baseline."""
    asymmetry_change = Setting(_Of("health", "ValveLimits.asymmetry_change"), (0.0, 1e3))
    """Change of viscous friction up against down, as a share, reported [-], against the
    baseline."""
    stop_change = Setting(_Of("health", "ValveLimits.stop_change"), (0.0, 1e3))
    """Shift of a travel stop, as a share of the travel, reported [-], against the baseline."""
    noise_factor = Setting(_Of("health", "ValveLimits.noise_factor"), (0.0, 1e3))
    """Factor of the noise of a sensor, reported [-], against the baseline."""
    lag_change = Setting(_Of("health", "ValveLimits.lag_change"), (0.0, 1e3))
    """Change of the lag of the stem behind the pressure, reported [s], against the baseline."""
    command_unit = Setting("m", choices=("m", "%"))
    """Unit of stem_command [-]: m, or % of the travel."""
    deviation_limit = Setting(0.0, (0.0, 100.0))
    """Median distance of the resting stem from its command that warns [% of the travel]; 0:
    none."""
    dead_time_limit = Setting(0.0, (0.0, 3600.0))
    """Median time from a step of the command to the first movement that warns [s]; 0: none."""
    t86_limit = Setting(0.0, (0.0, 3600.0))
    """Median time from a step of the command to 86.5 % of the move that warns [s]; 0: none."""
    webhook_url = Setting("", read_only=True)
    """Address that each change of the level is posted to [-], https, or http to this machine;
    empty: that of the environment, VALVE_FRICTION_WEBHOOK_URL, or nowhere. No secret belongs into
    it: everybody on the ROS graph can read it. No token is sent there."""
    webhook_period = Setting(60.0, (0.0, 86400.0))
    """Least time from one posted change of the level to the next [s]; then the newest level
    counts."""
    webhook_digest = Setting(-1.0, (-1.0, 23.999))
    """Time of day at which one post lists the alarms of all valves of the process [h], UTC; below
    0: no digest."""
    counting_dead_band = Setting(_Of("usage", "DEFAULT_BAND"), (1e-6, 0.5))
    """Dead band of travelled distance, reversals and breakaways, as a share of the travel [-];
    raised where the sensor's noise or resolution demands more."""
    air_to = Setting("open", choices=("open", "close"))
    """Where the seat is [-]: open, air opens the valve, at position 0; close, at the travel."""
    travel_limit = Setting(0.0, (0.0, 1e9))
    """Travelled distance of the life of a packing [m]; 0: no limit."""
    reversal_limit = Setting(0.0, (0.0, 1e12))
    """Reversals of the life of a packing [-]; 0: no limit."""
    alarm_recording = Setting(10.0, (0.0, 600.0))
    """Time from a rise of the level until the buffer before and after it is saved [s]; 0: never."""
    alarm_folder = Setting("", read_only=True)
    """Folder of these recordings [-]; empty: valve_friction_ros/alarms under ROS_HOME, or under
    ~/.ros; a relative one is in valve_friction_ros there."""
    alarm_recordings = Setting(20, (1, 100_000), read_only=True)
    """Recordings of a valve that are kept, the latest [-]."""
    alarm_megabytes = Setting(200.0, (0.001, 1e6), read_only=True)
    """Room that the recordings of a valve may take [MB]."""
    alarm_pause = Setting(600.0, (0.0, 31_557_600.0))
    """Time after a recording in which only a higher level is recorded [s]."""
    alarm_kind = Setting("all", choices=("all", *ALARM_KINDS))
    """Alarm that the next request is for [-]; a request sets these four back."""
    alarm_who = Setting("")
    """Person who makes the next request on an alarm [-]; none is taken without."""
    alarm_text = Setting("")
    """Words of that person [-], kept with the request."""
    alarm_hours = Setting(8.0, (0.0, 8784.0))
    """Time for which the next request shelves an alarm, up to 720, or has it out of service [h]."""
    valve_tag = Setting("", read_only=True)
    """Tag of the valve, hardware_id of its diagnostics [-]; empty: the namespace."""
    history_file = Setting(str(history_file()), read_only=True)
    """File in which identifications and baselines are kept [-]; empty: nowhere."""
    history_url = Setting("", read_only=True)
    """PostgreSQL server that the history_file is sent to, postgresql://user@host/database [-];
    empty: that of the environment, VALVE_FRICTION_HISTORY_URL, or none. No password belongs
    here."""
    joint = Setting(_Of("streams.samples", "DEFAULT_JOINT"), read_only=True)
    """Name of the stem's joint in stem_state [-]; empty: the first joint."""
    estimate_topic = Setting(True, read_only=True)
    """Whether ~/estimate tells a subscriber, also a late one, what is known of the valve [-];
    /diagnostics has the same each second."""
    result_topic = Setting(False, read_only=True)
    """Whether ~/result has the numbers of each identification in one stamped message [-]."""
    number_topics = Setting(False, read_only=True)
    """Whether each number, and the sweep, has a latched topic of its own [-]."""


class _Managed:
    lifecycle = Setting(False, read_only=True)
    """Whether the node waits to be configured and activated, as by `ros2 lifecycle set` [-]; false:
    it is active from its start."""


class _Identifiers:
    valves = Setting([""], read_only=True)
    """Namespaces of the valves, an identifier each [-]."""
    identification_processes = Setting(2, (0, 64), read_only=True)
    """Most processes beside this one that identify at once; they end when nobody asks [-]; 0:
    threads of it."""
    parameter_services = Setting(True, read_only=True)
    """Whether the parameters of the valves can be read and changed while they run, and their alarms
    answered by services [-]; not for more than 20 valves unless told: it doubles what a process
    costs at its start."""


class _Simulator:
    position_noise = Setting(0.0, (0.0, 1.0))
    """Standard deviation of the stem sensor's noise [m]."""
    noise_seed = Setting(0, (0, 2**31 - 1), read_only=True)
    """Seed of the noise [-]."""
    joint = Setting(_Of("streams.samples", "DEFAULT_JOINT"), read_only=True)
    """Name of the stem's joint in stem_state [-]; empty: the first joint."""


class _StrokePlayer:
    file = Setting("")
    """CSV file with the columns time_s and pressure_pa, as plan-test writes it [-]; needed."""
    file_minimum = Setting(0.0, (-1e9, 1e9))
    """Lowest pressure that may be set [Pa]."""
    file_maximum = Setting(0.0, (-1e9, 1e9))
    """Highest pressure that may be set [Pa]; needed."""
    file_rate = Setting(1e12, (0.0, 1e12))
    """Largest rate of the pressure in the file [Pa/s]."""
    pressure_margin = Setting(1e4, (0.0, 1e9))
    """How far the measured pressure may lie beyond these two [Pa]."""
    position_minimum = Setting(0.0, (-10.0, 10.0))
    """Position of the stem below which the test goes back [m]."""
    position_maximum = Setting(0.0, (-10.0, 10.0))
    """Position of the stem above which the test goes back [m]; needed."""
    silence = Setting(1.0, (0.05, 60.0))
    """Time without a pressure or a stem after which the test goes back [s]."""
    longest_test = Setting(3600.0, (1.0, 86400.0))
    """Longest time that a test may take [s]."""
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
    """Samples per second of signal [Hz]."""
    speed = Setting(1.0, (1e-3, 1e3))
    """Seconds of signal published in a second of real time [-]."""
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
    """Address that it listens at [-]; any but this machine's own needs accounts."""
    host_names = Setting("")
    """Names that browsers call it by, beside its address, separated by commas [-]."""
    accounts_file = Setting("")
    """File of accounts, by `valve_friction dashboard-account` [-]; empty: the environment's."""
    certificate_file = Setting("")
    """Certificate for TLS, in PEM [-]; empty: no TLS."""
    key_file = Setting("")
    """Key of the certificate, in PEM [-]."""
    session_hours = Setting(_Of("dashboard.accounts", "Access.session_hours"), (0.1, 10000.0))
    """Time after which a log-in ends [h]."""
    session_file = Setting("")
    """File in which log-ins survive a restart [-]; empty: they do not."""
    port = Setting(_Of("dashboard", "DashboardOptions.port"), (1, 65535))
    """Port that it listens at [-]."""
    history_file = Setting(str(history_file()))
    """File of the identifiers' history, which is read [-]; empty: none."""
    history_url = Setting("")
    """PostgreSQL server of the identifiers' histories, which is read in place of the file [-];
    empty: that of the environment, VALVE_FRICTION_HISTORY_URL. No password belongs here."""
    time_zone = Setting(_Of("dashboard", "DashboardOptions.time_zone"))
    """Zone of the times, an IANA name such as Europe/Berlin [-]."""
    silence = Setting(_Of("dashboard", "DashboardOptions.silence"), (1.5, 86400.0))
    """Time without a message after which a valve counts as silent [s]."""
    report_folder = Setting("")
    """Folder of the identifiers' reports, which it offers [-]; empty: the usual one."""
    save_folder = Setting("")
    """Folder of the identifiers' bags, which it offers [-]; empty: the usual one."""
    alarm_folder = Setting("")
    """Folder of the recordings of alarms, which it offers [-]; empty: the usual one."""


VALVE = _declared(_Valve, is_assumed=True)
"""What describes a valve that is watched; one that is simulated is by default the paper's."""

KARNOPP = _declared(_Karnopp)
"""The friction and the spring of a simulated valve."""

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
            description=f"Known value of {name} [{UNITS.get(name, 'm/s')}], then not identified; "
            "unset: not known",
        )
        for name in FIXABLE
    ),
)
"""What nodes and commands identify with: what `identification_from` takes."""

SURVEY = _declared(_Survey)
"""Limits of a first survey, of nodes, commands and valve files: what `survey_from` takes."""

_BY_DATA_SHEET = tuple(
    replace(
        one,
        initial=None,
        description=f"{one.description}, by the data sheet: compared with what a record shows",
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
"""What the node `identifiers` has beside the parameters of its identifiers."""

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
"""The parameters of each node; `identifiers` has those of its identifiers too."""

COLUMNS = "columns"
"""The section of a valve file about tables of samples."""

VALVE_KEYS = tuple(
    dict.fromkeys((*(one.name for one in VALVE), *FIXABLE, *(one.name for one in _IDENTIFIER)))
)
"""Keys of a valve file beside `COLUMNS`; commands have no use for those of the identifier only."""

NODE_NAMES = frozenset(one.name for settings in NODES.values() for one in settings)
"""Parameters that a node of this package has."""

_OF_ROS = ("use_sim_time", "start_type_description_service")


def is_known(name: str) -> bool:
    """Return whether a node of this package, or rclpy for it, reads a parameter."""
    return (
        name in NODE_NAMES or name in _OF_ROS or name.startswith((f"{COLUMNS}.", "qos_overrides"))
    )


def survey_from(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return what `SurveyLimits.of_packing` takes of the settings of `SURVEY` that are given."""
    return {
        one.name.removeprefix("survey_"): given[one.name]
        for one in SURVEY
        if given.get(one.name) is not None
    }


def identification_from(given: Mapping[str, Any], **others: Any) -> IdentificationSettings:
    """Build the settings of an identification from those of `IDENTIFICATION` that are given.

    `others` are fields that are no settings of their own, as `stated`. Raises ValueError if they
    are impossible, or do not go together.
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
