"""Bags of ROS 2 in and out, MCAP and SQLite3; no ROS."""
