"""A robot sampled from all that is plausible of the real one's base, calibrated like the others."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("reality"), out="runs/reality")
