"""A tennis racket thrown with a spin about its middle axis turns over, again and again: the angle between its face and
the axis of the throw, and the momentum on its sphere. Needs `pip install ./src/python matplotlib`; writes racket.svg,
or the file named on the command line."""
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import frb_rigid_body as frb

racket = frb.RigidBody([3.0, 5.0, 7.0])
motion = frb.FreeMotion(racket, [0.0, 2.0, 0.01])
t = np.linspace(0.0, 2*motion.period, 2000)
m, q = motion.at(t)

# The middle axis of the racket seen from space, and the momentum, which stays: their angle.
w, x, y, z = q.T
middle = np.stack([2*(x*y - w*z), 1 - 2*(x*x + z*z), 2*(y*z + w*x)])
fixed = np.array([0.0, 2.0, 0.01])
angle = np.degrees(np.arccos(np.clip(fixed @ middle/np.linalg.norm(fixed), -1, 1)))
flips = np.count_nonzero(np.diff(np.sign(m[:, 1])))

figure, (over, ball) = plt.subplots(1, 2, figsize=(9, 3.5), gridspec_kw={"width_ratios": [2, 1]})
over.plot(t, angle, color="tab:blue")
over.set(xlabel="time", ylabel="middle axis to momentum [deg]", yticks=[0, 90, 180],
         title=f"{flips} flips in two periods of {motion.period:.1f}")
ball.plot(m[:, 0], m[:, 1], color="tab:orange")
ball.set(xlabel="$m_1$", ylabel="$m_2$", aspect="equal", title="momentum in the body")
figure.tight_layout()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "racket.svg")
print(f"period {motion.period:.12f}, {flips} flips")
