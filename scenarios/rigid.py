"""The base on wheels without springs."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("rigid"), out="runs/rigid")
