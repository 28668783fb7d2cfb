# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Reports for people: self-contained HTML pages; no ROS."""

from valve_friction_ros.reports.identification_report import (
    identification_report as identification_report,
    write_identification_report as write_identification_report,
)
from valve_friction_ros.reports.identified_record import (
    IdentifiedRecord as IdentifiedRecord,
    diagnosis_sentence as diagnosis_sentence,
)
from valve_friction_ros.reports.page import (
    Block as Block,
    Colour as Colour,
    Column as Column,
    Conclusion as Conclusion,
    Page as Page,
    PageTable as PageTable,
    Paragraph as Paragraph,
    Picture as Picture,
    Section as Section,
    render as render,
    require_report_file as require_report_file,
    write_report as write_report,
)
