"""The dashboard as a node: what the graph says to its pages, and what they ask of it."""
