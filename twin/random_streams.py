"""Random streams by name: the same root seed and name give the same numbers, whatever else was sampled before."""

import zlib

import numpy as np


def generator(seed: int, *names: str) -> np.random.Generator:
    """Generator of the stream `names` under a root seed.

    The spawn key is the CRC-32 of each name, so that streams depend neither on order, nor on threads.
    """
    key = tuple(zlib.crc32(name.encode()) for name in names)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
