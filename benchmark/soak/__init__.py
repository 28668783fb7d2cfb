"""A month of a plant in an hour, with all that happens to plants; each sample is accounted for."""
