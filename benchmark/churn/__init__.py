"""Nodes that stream while clients, and whole participants, come and go by the thousands."""
