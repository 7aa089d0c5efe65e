"""One 20 s swing of a randomised robot - for synthetic datasets by the thousand."""

from scenarios import load, run

if __name__ == "__main__":
    run(load("swing20"), out="runs/swing20")
