"""What can be wrong with what a user gave: scenario files, overrides, names, output folders."""


class ScenarioError(Exception):
    """Input that cannot be used as it is: what was found, where, and what to do, one finding a line."""
