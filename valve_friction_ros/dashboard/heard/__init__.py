"""The valves and their signals as they were heard."""
