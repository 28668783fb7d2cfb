"""A history on a PostgreSQL server: its address, connections to it, and its tables."""
