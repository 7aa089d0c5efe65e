"""Other loads in the hand than the calibration saw, and a push."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("payload"), out="runs/payload")
