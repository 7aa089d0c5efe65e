"""20 postures and one unseen swing of a randomised robot, under a minute - for Monte-Carlo studies."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("short"), out="runs/short")
