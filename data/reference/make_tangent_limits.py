"""Inputs next to the places where methods fail, for make_tangent_cases.py: group I1 I2 I3 m1 m2 m3 h.
usage: make_tangent_limits.py SEED > file"""
import random, sys
rnd = random.Random(int(sys.argv[1]))


def unit(v):
    n = sum(x*x for x in v)**.5
    return [x/n for x in v]


def direction():
    return unit([rnd.gauss(0, 1) for _ in range(3)])


def triangle():
    y = rnd.uniform(0.5, 1)
    return [rnd.uniform(1 - y, y), y, 1.0]


def add(group, moments, m, h):
    print(group, *[repr(float(x)) for x in (*moments, *m, h)])


for k in (2, 4, 6, 8, 10, 12, 14, 16, 30, 60):
    d = 10.0**-k
    r = rnd.uniform(.2, .7)
    add("off_separatrix", [2, 3, 6], [r*(1 + d), rnd.uniform(.3, 1), r], rnd.uniform(5, 60))
    I = triangle()
    add("unstable_axis", I, [d*rnd.gauss(0, 1), 1, d*rnd.gauss(0, 1)], 10**rnd.uniform(1, 2.5))
    add("unstable_axis", I, [d*rnd.gauss(0, 1), -1, 0], 10**rnd.uniform(3, 5))
    add("stable_axes", triangle(), [1, d*rnd.gauss(0, 1), d*rnd.gauss(0, 1)], 10**rnd.uniform(-1, 2))
    add("stable_axes", triangle(), [d*rnd.gauss(0, 1), d*rnd.gauss(0, 1), 1], 10**rnd.uniform(-1, 2))
    y = rnd.uniform(.3, 1)
    add("symmetry", [y*(1 - d), y, 1], direction(), 10**rnd.uniform(-1, 2))
    add("symmetry", [y, 1 - d, 1], direction(), 10**rnd.uniform(-1, 2))
    add("sphere", [1 - d, 1 - d*rnd.random(), 1], direction(), 10**rnd.uniform(-1, 2))
    add("small_m", triangle(), [d*x for x in direction()], 10**rnd.uniform(-1, 1))
    add("plane", triangle(), unit([rnd.gauss(0, 1), d, rnd.gauss(0, 1)]), 10**rnd.uniform(-1, 2))
for x in (1, 3, 10, 30, 60, 100, 130, 200, 400, 600):       # lambda h: (1/3) (1/2 - 1/3)**.5 (1/3 - 1/6)**.5 ...
    lam = ((1/2 - 1/3)*(1/3 - 1/6))**.5
    add("on_unstable_axis", [2, 3, 6], [0, rnd.choice((-1, 1)), 0], rnd.choice((-1, 1))*x/lam)
    r = rnd.choice((.5, .25, .375))
    add("on_separatrix", [2, 3, 6], [r, .75*rnd.choice((-1, 1)), r*rnd.choice((-1, 1))], x/lam)
    add("rods", sorted([10**rnd.uniform(-6, -2), 10**rnd.uniform(-1, 0), 1]), direction(), 10**rnd.uniform(-6, 0))
    add("discs", [rnd.uniform(.5, .51), rnd.uniform(.51, .52), 1], direction(), 10**rnd.uniform(-1, 3))
