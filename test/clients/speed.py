"""Times of the Python package, by hand on a quiet machine: us for a call of one body, ns a body at a million.

The Fortran figures beside them: test/packages/speed, steps.
"""
import time

import numpy as np
import frb_rigid_body as frb

body = frb.RigidBody([1.0, 1.5, 2.2])


def least(runs, calls, m, q):
    """Seconds of a call, the least of several runs."""
    best = 1e9
    for _ in range(runs):
        start = time.perf_counter()
        for _ in range(calls):
            frb.flow(body, 1e-3, m, q)
        best = min(best, (time.perf_counter() - start) / calls)
    return best


one = least(20, 10000, np.array([0.6, 0.5, 0.8]), np.array([1.0, 0.0, 0.0, 0.0]))
n = 1000000
momenta = np.random.default_rng(1).normal(size=(n, 3))
momenta /= np.linalg.norm(momenta, axis=1)[:, None]
attitudes = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
many = least(10, 1, momenta, attitudes)
print(f"one body {one * 1e6:.2f} us, a million bodies {many * 1e9 / n:.1f} ns each")
