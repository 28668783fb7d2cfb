"""The demonstration: a simulated valve whose friction grows."""
