"""Exact motion of a free rigid body, and splitting methods around it.

Conventions: ``m`` is angular momentum in body axes, ``q`` the attitude as a unit quaternion, scalar first, that takes
body axes to space. Any consistent units; angles in rad. States are numpy arrays of float64 that are changed in place,
without a copy.

>>> import numpy as np
>>> import frb_rigid_body as frb
>>> body = frb.RigidBody([0.6, 0.8, 1.0])
>>> m = np.array([1.8, 0.4, -0.9])
>>> q = np.array([1.0, 0.0, 0.0, 0.0])
>>> frb.flow(body, 10.0, m, q)
>>> print(m)
[ 1.76596251 -0.6954642   0.77955498]
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, NamedTuple, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _frb
from ._frb import FrbError, flow

__version__: str = _frb.version()
__all__ = ["FreeMotion", "FrbError", "HeavyTop", "RigidBodies", "RigidBody", "Trajectory", "flow", "flow_tangent",
           "integrate"]

Array = NDArray[np.float64]


class RigidBody(_frb.Bodies):
    """A rigid body: three principal moments, in any order, or an inertia tensor of shape (3, 3).

    With a tensor, momentum and attitude are in the axes of the tensor; off its diagonal it has the negative products
    of inertia. A linear rotor has the moments (I, I, 0). Raises FrbError unless the moments are positive, or the
    tensor symmetric and positive definite.
    """

    def __new__(cls, inertia: ArrayLike) -> RigidBody:
        numbers = np.ascontiguousarray(inertia, dtype=np.float64)
        if numbers.shape not in ((3,), (3, 3)):
            raise ValueError("inertia must have shape (3,) or (3, 3)")
        return super().__new__(cls, numbers.reshape(-1), numbers.size)

    @property
    def moments(self) -> Array:
        """Principal moments, in the order given, or in that of the columns of ``axes``."""
        return np.array(self._axes(0)[0])

    @property
    def axes(self) -> Array:
        """Rotation from principal axes to those of the body: its columns are the principal axes."""
        return np.array(self._axes(0)[1])

    def __repr__(self) -> str:
        return f"RigidBody(moments={self.moments.tolist()})"


class RigidBodies(_frb.Bodies):
    """n rigid bodies: moments of shape (n, 3), or inertia tensors of shape (n, 3, 3), each as in RigidBody."""

    def __new__(cls, inertia: ArrayLike) -> RigidBodies:
        numbers = np.ascontiguousarray(inertia, dtype=np.float64)
        if numbers.ndim not in (2, 3) or numbers.shape[1:] not in ((3,), (3, 3)):
            raise ValueError("inertia must have shape (n, 3) or (n, 3, 3)")
        width = 3**(numbers.ndim - 1)
        return super().__new__(cls, numbers.reshape(len(numbers), width), width)

    def __repr__(self) -> str:
        return f"RigidBodies({len(self)})"


class FreeMotion(_frb.Motion):
    """One free motion at many times, from its state at t = 0; ``period`` and ``precession`` are its own."""

    def __new__(cls, body: RigidBody, m: ArrayLike, q: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> FreeMotion:
        return super().__new__(cls, body, np.asarray(m, dtype=np.float64), np.asarray(q, dtype=np.float64))

    def at(self, t: ArrayLike) -> tuple[Array, Array]:
        """m and q at the time t, or of shape (n, 3) and (n, 4) at n times."""
        times = np.asarray(t, dtype=np.float64, order="C")
        m = np.empty((*times.shape, 3))
        q = np.empty((*times.shape, 4))
        self._at(times.reshape(-1, 1), m.reshape(-1, 3), q.reshape(-1, 4))
        return m, q


def flow_tangent(body: RigidBody, h: float, m: Array, q: Array) -> tuple[Array, Array]:
    """Advance one body as flow does, in place, and return the exact derivatives of the step.

    The first, (6, 6), is by (m, theta); variations theta of the attitude are rotation vectors in body axes,
    q + dq = q (1, theta/2). The second, (6, 3), is by the principal moments, their axes held.
    """
    transition = np.empty((6, 6))
    by_moments = np.empty((6, 3))
    _frb.flow_tangent(body, h, m, q, transition, by_moments)
    return transition, by_moments


@dataclass(frozen=True)
class HeavyTop:
    """The torque of a constant force, in space, at the point ``centre`` of the body: V = force . Q centre."""

    force: Sequence[float] = (0.0, 0.0, 1.0)
    centre: Sequence[float] = (0.0, 0.0, 1.0)


class Trajectory(NamedTuple):
    """States of a run: times (k,), momenta (k, 3), attitudes (k, 4)."""

    t: Array
    m: Array
    q: Array


Torque = Callable[[Array, float], Sequence[float]]


def integrate(body: RigidBody, torque: Union[HeavyTop, Torque], h: float, steps: int, m: ArrayLike, q: ArrayLike, *,
              scheme: str = "srkn14", every: int = 0, t: float = 0.0, compensated: bool = False) -> Trajectory:
    """Run a body under torque: ``steps`` steps of size ``h`` from the state m, q at time t; m and q are not changed.

    ``torque`` is a HeavyTop, or a function ``torque(q, t)`` that returns three numbers, in body axes. A function is
    slow, about a microsecond a call, and is called once for each stage of each step. Its exceptions are passed on.
    ``every`` > 0 returns the state at the start, after each ``every`` steps and at the end; 0: at the start and the
    end. ``compensated`` carries rounding errors over from step to step, at twice the time. q must be of norm one.
    """
    state_m = np.array(m, dtype=np.float64)
    state_q = np.array(q, dtype=np.float64)
    time = np.array([t], dtype=np.float64)
    rests = np.zeros(7) if compensated else None
    function = top = None
    if isinstance(torque, HeavyTop):
        top = np.concatenate([np.asarray(torque.force, dtype=np.float64), np.asarray(torque.centre, dtype=np.float64)])
    else:
        function = torque
    copied = np.empty(4)
    kept = [(t, state_m.copy(), state_q.copy())]
    done = 0
    while done < steps or done == 0:
        count = min(every, steps - done) if every > 0 else steps
        _frb.integrate(body, scheme, function, copied, top, h, count, state_m, state_q, time, rests)
        kept.append((time[0], state_m.copy(), state_q.copy()))
        done += count
        if count == 0:
            break
    times, momenta, attitudes = zip(*kept)
    return Trajectory(np.array(times), np.array(momenta), np.array(attitudes))
