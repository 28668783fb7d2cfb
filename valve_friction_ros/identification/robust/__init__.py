"""The fit in which every imperfection of a plant takes part, with a stated prior."""
