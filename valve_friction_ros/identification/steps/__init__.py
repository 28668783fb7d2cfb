"""Step responses, and validation on another record."""
