"""Heins's calibration of base, arm and tool."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("heins2022"), out="runs/heins2022")
