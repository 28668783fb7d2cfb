# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Streams of samples: what arrives, what is buffered, and the uniform record of both; no ROS."""

from valve_friction_ros.streams.data_quality import (
    DataFault,
    DataQuality,
    FaultKind,
    LossCounter,
    Losses,
)
from valve_friction_ros.streams.record_buffer import (
    Intake,
    RecordBuffer,
    SampleFault,
    Signal,
    Snapshot,
)
from valve_friction_ros.streams.samples import (
    COLUMNS,
    DAY,
    Arrivals,
    Kind,
    Samples,
    nanoseconds,
    rows_arrived,
    uniform_recording,
)
from valve_friction_ros.wording import utc, utc_day, utc_minute, utc_second

__all__ = [
    "COLUMNS",
    "DAY",
    "Arrivals",
    "DataFault",
    "DataQuality",
    "FaultKind",
    "Intake",
    "Kind",
    "LossCounter",
    "Losses",
    "RecordBuffer",
    "SampleFault",
    "Samples",
    "Signal",
    "Snapshot",
    "nanoseconds",
    "rows_arrived",
    "uniform_recording",
    "utc",
    "utc_day",
    "utc_minute",
    "utc_second",
]
