"""Results of the Python package: the lines of client.f90, bit for bit; then the input that it refuses."""
import struct
import sys

import numpy as np

import frb_rigid_body as frb


def say(what, numbers):
    for number in np.ravel(numbers):
        print(what, struct.pack(">d", number).hex().upper())


def refused(status, call, *arguments, kind=frb.FrbError, **keywords):
    try:
        call(*arguments, **keywords)
    except kind as error:
        assert status is None or error.status == status, error
        assert str(error) and str(error) == error.args[0] and "unknown status" not in str(error), error
    else:
        sys.exit(f"{call} {arguments} was not refused")


start, none, n = np.array([1.8, 0.4, -0.9]), np.array([1.0, 0.0, 0.0, 0.0]), 40
tensor = np.array([[0.9, 0.1, 0.05], [0.1, 0.8, -0.02], [0.05, -0.02, 0.7]])
body, turned = frb.RigidBody([0.6, 0.8, 1.0]), frb.RigidBody(tensor)
m, q = start.copy(), none.copy()
frb.flow(body, 10.0, m, q)
say("flow", m)
say("flow", q)
frb.flow(turned, -0.3, m)
say("momentum", m)
# The tensors of all bodies: a diagonal one is the same body as its moments.
bodies = frb.RigidBodies([np.diag([0.6, 0.8, 1.0]) if i % 3 else tensor for i in range(n)])
many_m, many_q = np.tile(start, (n, 1)), np.tile(none, (n, 1))
many_m[:, 0] += 0.1*np.arange(n)
# Columns of a wider array: nothing is copied.
wide = np.hstack([many_q, many_m])
frb.flow(bodies, 0.25, wide[:, 4:], wide[:, :4])
frb.flow(bodies, 0.25, many_m, many_q)
assert (wide == np.hstack([many_q, many_m])).all()
frb.flow(body, 0.25, many_m, many_q)
say("batch", many_m)
say("batch", many_q)
motion = frb.FreeMotion(body, start)
say("period", motion.period)
say("precession", motion.precession)
state = motion.at([-3.7, 1000.0])
say("motion", state[0])
say("motion", state[1])
first = frb.FreeMotion(body, start).at(-3.7)
assert (first[0] == state[0][0]).all() and first[1].shape == (4,)
m, q = start.copy(), none.copy()
frb.flow(body, 10.0, m, q)
frb.flow(turned, -0.3, m)
run = frb.integrate(body, frb.HeavyTop(), 0.1, 100, m, q, every=30)
say("top", run.m[-1])
say("top", run.q[-1])
assert run.t.shape == (5,) and run.m.shape == (5, 3) and (run.m[0] == m).all()
m, q = run.m[-1].copy(), run.q[-1].copy()
transition, by_moments = frb.flow_tangent(turned, 2.0, m, q)
say("tangent", m)
say("tangent", q)
say("tangent", transition)
say("tangent", by_moments)
m, q = run.m[0], run.q[0]


def torque(q, t):
    """That of the same top: u x e3 with u = Q^T e3."""
    return [2*(q[2]*q[3] + q[0]*q[1]), -2*(q[1]*q[3] - q[0]*q[2]), 0.0]


slow = frb.integrate(body, torque, 0.1, 100, m, q, compensated=True)
assert abs(slow.m[-1] - run.m[-1]).max() < 1e-11 and abs(slow.t[-1] - 10) < 1e-12

refused(1, frb.RigidBody, [1.0, -1.0, 1.0])
refused(2, frb.RigidBody, -np.eye(3))
refused(5, frb.flow, body, float("nan"), m, q)
refused(3, frb.flow, body, 1.0, m*np.nan, q)
refused(5, frb.flow_tangent, body, float("inf"), m, q)
refused(6, frb.flow_tangent, bodies, 1.0, m, q)
refused(6, frb.flow, bodies, 1.0, m, q)
refused(6, frb.flow, body, 1.0, many_m, q)
refused(7, frb.integrate, body, frb.HeavyTop(), 0.1, 1, m, q, scheme="rk4")
refused(6, frb.integrate, body, frb.HeavyTop(), 0.1, -1, m, q)
refused(None, frb.flow, body, 1.0, [1.0, 2.0, 3.0], kind=TypeError)
refused(None, frb.flow, None, 1.0, m, kind=TypeError)
refused(None, frb.flow, body, 1.0, m.astype(np.float32), kind=ValueError)
refused(None, frb.flow, body, 1.0, many_m.T.copy(), kind=ValueError)
refused(None, frb.flow, body, 1.0, np.asfortranarray(many_m), kind=ValueError)
refused(None, frb.flow, body, 1.0, many_m[::-1], kind=ValueError)
refused(None, frb.RigidBody, [1.0, 2.0], kind=ValueError)
refused(None, frb.integrate, body, lambda q, t: [0.0], 0.1, 1, m, q, kind=ValueError)
refused(None, frb.integrate, body, lambda q, t: 1/0, 0.1, 1, m, q, kind=ZeroDivisionError)
