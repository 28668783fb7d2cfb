"""A plant of many hosts on one machine: network namespaces on a bridge, and what is cut there."""
