"""The parts of the speed benchmark: a module each, found by its name.

A part is a module with a docstring, whose first line is its title, and a function
``measure(settings: Settings) -> Iterable[Row]`` that yields a row as soon as it is measured.
"""
