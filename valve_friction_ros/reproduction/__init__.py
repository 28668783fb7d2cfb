"""The published programme on the simulated bench, beside the numbers of the paper; no ROS."""
