"""The published campaign on the default twin."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("humanoids2024"), out="runs/humanoids2024")
