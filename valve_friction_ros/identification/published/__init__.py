"""The published method, model 1 of the paper.

Derivatives (Appendix A), regression (3) to (7), sweep (8) with (17) and (18), breakaway (9).
"""
