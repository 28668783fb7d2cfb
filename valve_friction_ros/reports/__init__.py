"""Reports for people: pages that stand in one file; no ROS."""

from valve_friction_ros.reports.page import (
    Block,
    Column,
    Page,
    Paragraph,
    Picture,
    Section,
    Table,
    render,
)

__all__ = ["Block", "Column", "Page", "Paragraph", "Picture", "Section", "Table", "render"]
