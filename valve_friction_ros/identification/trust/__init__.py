"""How far a number can be trusted: intervals, verdicts, checks of the excitation."""
