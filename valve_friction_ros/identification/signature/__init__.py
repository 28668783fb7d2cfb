"""The paper's model 2, from a valve signature: force balances (10) to (16) and (19)."""
