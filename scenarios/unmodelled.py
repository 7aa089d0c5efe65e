"""A robot that differs from every model of the pipeline in form, seen again on another day."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("unmodelled"), out="runs/unmodelled")
