"""Online identification of control-valve friction with the Karnopp model.

The layers, arrows only downwards::

    nodes, commands  →  reports, figures, fleet, reproduction  →  history, health, streams, records
        →  identification  →  signals, model

Everything below ``nodes`` works without ROS: import it from a notebook.
All quantities are in SI units unless a name says otherwise.
"""

__version__ = "0.1.0"
