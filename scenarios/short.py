"""The whole pipeline in under a minute of simulated time: one robot of the Monte-Carlo studies."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("short"), out="runs/short")
