"""The base on linear wheels: the form of suspension that the paper identifies."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("anchored"), out="runs/anchored")
