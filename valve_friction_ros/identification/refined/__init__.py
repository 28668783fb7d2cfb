"""The refined model: its simulated stem follows the measured one."""
