"""ROS 2 nodes: they translate messages and parameters, nothing else."""
