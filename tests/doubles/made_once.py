"""What several workers need and takes seconds: the first that asks makes it, the others wait and read it."""

import fcntl
import pickle


def made_once(tmp_path_factory, worker_id, name, make):
    """make(folder) of this name; folder is the same for all workers of a session."""
    base = tmp_path_factory.getbasetemp()
    shared = base if worker_id == "master" else base.parent
    with (shared / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        kept = shared / f"{name}.pickle"
        if not kept.is_file():
            kept.write_bytes(pickle.dumps(make(shared / name)))
        return pickle.loads(kept.read_bytes())
