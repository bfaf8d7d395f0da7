"""One independent random stream per case, seed and purpose."""

import hashlib

import numpy as np


def stream(study_seed: int, case: str, seed: int, purpose: str) -> np.random.Generator:
    """Return the generator of one purpose, e.g. ``"noise"``, of one seed of one case.

    Its seed sequence is a child of the study's seed, with a spawn key made of the names
    and numbers alone: no other case or seed, and no order of jobs, can change it.
    """
    key = (*_words(case), seed, *_words(purpose))
    return np.random.default_rng(np.random.SeedSequence(study_seed, spawn_key=key))


def _words(name: str) -> tuple[int, ...]:
    digest = hashlib.sha256(name.encode()).digest()[:16]
    return tuple(int.from_bytes(digest[i : i + 4], "big") for i in range(0, 16, 4))
