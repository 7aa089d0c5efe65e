"""A posture tour after jolts: where the slip of the base can be predicted, and where it cannot."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("jolts"), out="runs/jolts")
