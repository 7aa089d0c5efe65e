"""Versions of what decides the figures of a run."""

import platform

PACKAGES = ("tiago-twin", "mujoco", "pin", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Of the interpreter and of every package, by name."""
    from importlib.metadata import version

    return {"python": platform.python_version(), **{package: version(package) for package in PACKAGES}}
