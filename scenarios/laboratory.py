"""The paper's campaign with everything an instrument gets wrong."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("laboratory"), out="runs/laboratory")
