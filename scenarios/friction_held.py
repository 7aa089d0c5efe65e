"""Drive trains of the other form: links that friction keeps inside their backlash, a hysteretic mesh."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("friction_held"), out="runs/friction_held")
