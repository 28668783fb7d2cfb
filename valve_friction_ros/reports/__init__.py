"""Reports for people: pages that stand in one file; no ROS."""

from valve_friction_ros.reports.diagnosis_sentence import diagnosis_sentence
from valve_friction_ros.reports.identification_report import identification_report
from valve_friction_ros.reports.identified_record import IdentifiedRecord
from valve_friction_ros.reports.page import (
    Block,
    Colour,
    Column,
    Page,
    Paragraph,
    Picture,
    Section,
    Status,
    Table,
    render,
)
from valve_friction_ros.reports.report_file import require_report_file, write_report

__all__ = [
    "Block",
    "Colour",
    "Column",
    "IdentifiedRecord",
    "Page",
    "Paragraph",
    "Picture",
    "Section",
    "Status",
    "Table",
    "diagnosis_sentence",
    "identification_report",
    "render",
    "require_report_file",
    "write_report",
]
