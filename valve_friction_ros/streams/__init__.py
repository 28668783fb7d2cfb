# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Streams of samples: arrivals, buffers, data quality and the uniform record; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.streams.data_quality import (
        DataFault as DataFault,
        DataQuality as DataQuality,
        FaultKind as FaultKind,
        LossCounter as LossCounter,
        Losses as Losses,
    )
    from valve_friction_ros.streams.record_buffer import (
        Intake as Intake,
        RecordBuffer as RecordBuffer,
        SampleFault as SampleFault,
        Signal as Signal,
        Snapshot as Snapshot,
    )
    from valve_friction_ros.streams.samples import (
        COLUMNS as COLUMNS,
        DAY as DAY,
        END_OF_TIME as END_OF_TIME,
        Arrivals as Arrivals,
        Kind as Kind,
        Samples as Samples,
        nanoseconds as nanoseconds,
        rows_arrived as rows_arrived,
        uniform_recording as uniform_recording,
    )
    from valve_friction_ros.wording import (
        utc as utc,
        utc_day as utc_day,
        utc_minute as utc_minute,
        utc_second as utc_second,
    )
else:
    __getattr__ = names_on_demand(__name__)
