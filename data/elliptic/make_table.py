#!/usr/bin/env python3
"""Reference values of the elliptic integrals and functions: make_table.py [SEED [PER_FUNCTION]] > table.txt

Every input is an exact double (17 digits); every value has 25 digits, from 60 to 700 by mpmath (RF, RC, RJ)
or by the arithmetic-geometric mean with arcsines, (17)-(19) of the paper in their textbook form (K, F, am).
One record a line, blanks between: name, number of inputs, the inputs, the value. Functions and inputs:

    rf x y z    rc x y    rj x y z p    rd x y z        Carlson's integrals
    k kc2                                               complete integral, first kind
    f phi kc2   am u kc2   sn u kc2   cn u kc2   dn u kc2
    pi phi n kc2    pid phi1 phi2 n kc2                 third kind, (22), from 0 and from phi1 to phi2
    gx p i   gw p i                                     node i (ascending) and weight of the p-point Gauss rule

kc2 is 1 - k**2.
"""
import random
import sys
import mpmath as mp

mp.mp.dps = 60
one = mp.mpf(1)


def carlson(name, args):
    a = [mp.mpf(x) for x in args]
    return {"rf": mp.elliprf, "rc": mp.elliprc, "rd": mp.elliprd, "rj": mp.elliprj}[name](*a)


def agm_sequence(kc2):
    rows = [(one, mp.sqrt(kc2))]
    while abs(rows[-1][0] - rows[-1][1]) > mp.mpf(10) ** (-mp.mp.dps + 5):
        a, b = rows[-1]
        rows.append(((a + b) / 2, mp.sqrt(a * b)))
    return rows


def big_k(kc2):
    return mp.pi / (2 * mp.agm(one, mp.sqrt(kc2)))


def big_f(phi, kc2):
    """F by Carlson's RF on the part within a half turn."""
    if kc2 == 0:
        return mp.asinh(mp.tan(phi))
    turns = mp.nint(phi / mp.pi)
    t = phi - turns * mp.pi
    s, c = mp.sin(t), mp.cos(t)
    return s * mp.elliprf(c * c, c * c + kc2 * s * s, one) + (2 * turns * big_k(kc2) if turns else 0)


def amplitude(u, kc2):
    if kc2 == 0:
        return 2 * mp.atan(mp.tanh(u / 2))
    rows = agm_sequence(kc2)
    n = len(rows) - 1
    phi = 2 ** n * rows[n][0] * u
    for i in range(n, 0, -1):
        a, b = rows[i - 1]
        c_over_a = (a - b) / (a + b)
        phi = (phi + mp.asin(c_over_a * mp.sin(phi))) / 2
    return phi


def big_pi(phi, n, kc2):
    turns = mp.nint(phi / mp.pi)
    t = phi - turns * mp.pi

    def part(s, c):
        dd = c * c + kc2 * s * s
        third = mp.elliprj(c * c, dd, one, c * c + (1 - n) * s * s)
        return s * mp.elliprf(c * c, dd, one) + n / 3 * s ** 3 * third
    value = part(mp.sin(t), mp.cos(t))
    if turns:
        value += 2 * turns * part(one, mp.mpf(0))
    return value


def gauss(points, i):
    """Node i and its weight, by the secant method on the Legendre polynomial."""
    start = -mp.cos(mp.pi * (i - mp.mpf(1) / 4) / (points + mp.mpf(1) / 2))
    x = mp.findroot(lambda t: mp.legendre(points, t), (start, start + mp.mpf(10) ** -6))
    slope = points * (x * mp.legendre(points, x) - mp.legendre(points - 1, x)) / (x * x - 1)
    return x, 2 / ((1 - x * x) * slope ** 2)


def value_of(name, args):
    if name in ("gx", "gw"):
        return gauss(int(args[0]), int(args[1]))[name == "gw"]
    if name in ("rf", "rc", "rj", "rd"):
        return carlson(name, args)
    a = [mp.mpf(x) for x in args]
    if name == "k":
        return big_k(a[0])
    if name == "f":
        return big_f(*a)
    if name in ("am", "sn", "cn", "dn"):
        phi = amplitude(*a)
        return {"am": phi, "sn": mp.sin(phi), "cn": mp.cos(phi),
                "dn": mp.sqrt(mp.cos(phi) ** 2 + a[1] * mp.sin(phi) ** 2)}[name]
    if name == "pi":
        return big_pi(*a)
    return big_pi(a[1], a[2], a[3]) - big_pi(a[0], a[2], a[3])


def digits_needed(name, args):
    """cn and dn can be as small as sqrt(kc2), 1 - n sin**2 as large as 1e300; RJ needs the digits of p."""
    if name in ("gx", "gw"):
        return 40
    if name == "rj" and abs(args[3]) < 1e-20 * max(args):
        return 700
    return 700 if min(args) < -1e20 or name not in ("rf", "rc", "rj", "rd") and args[-1] < 1e-15 else 60


def main():
    rng = random.Random(int(sys.argv[1]) if len(sys.argv) > 1 else 903)
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 40
    half_pi = 1.5707963267948966

    def wide(low, high):
        return 10.0 ** rng.uniform(low, high)

    def argument():
        return rng.choice([lambda: rng.random(), lambda: wide(-3, 3), lambda: wide(-20, 20), lambda: wide(-300, 300)])()

    def complement():
        return rng.choice([lambda: rng.random(), lambda: rng.random(), lambda: wide(-18, 0), lambda: wide(-300, 0),
                           lambda: 1 - wide(-16, -1), lambda: 1.0])()

    def angle():
        return rng.choice([lambda: rng.uniform(-half_pi, half_pi), lambda: half_pi - wide(-15, -1),
                           lambda: wide(-30, 0)])()

    def many_turns():
        return rng.choice([lambda: rng.uniform(-10, 10), lambda: wide(0, 6)])()

    def characteristic():
        return rng.choice([lambda: rng.random(), lambda: 1 - wide(-12, 0), lambda: -wide(-3, 3),
                           lambda: -wide(-20, 20), lambda: 0.0])()

    jobs = []
    for _ in range(count):
        jobs.append(("rf", [argument(), argument(), argument()]))
        jobs.append(("rc", [argument(), rng.choice([1, 1, -1]) * argument()]))
        jobs.append(("rj", [argument(), argument(), argument(), argument()]))
        x = [rng.random(), 0.01 + rng.random(), 1.0]
        jobs.append(("rj", x + [wide(-3, 1)]))
        jobs.append(("rd", [argument(), argument(), argument()]))
        jobs.append(("k", [complement()]))
        jobs.append(("f", [angle(), complement()]))
        jobs.append(("f", [many_turns(), rng.random()]))
        u, kc2 = rng.choice([lambda: rng.uniform(-10, 10), lambda: wide(-9, 3)])(), complement()
        jobs += [(name, [u, kc2]) for name in ("am", "sn", "cn", "dn")]
        jobs.append(("pi", [angle(), characteristic(), complement()]))
        jobs.append(("pi", [rng.uniform(0, half_pi), rng.random(), rng.random()]))
        jobs.append(("pid", [many_turns(), many_turns(), rng.uniform(-3, 0.95), rng.random()]))
    # edges
    tiny, huge = 5e-324, 1.7976931348623157e308
    least = 2.2250738585072014e-308
    jobs += [("rf", a) for a in ([0.0, 1.0, 1.0], [0.0, 1.0, 2.0], [1.0, 1.0, 1.0], [tiny, tiny, huge],
                                 [0.0, tiny, huge], [huge, huge, huge], [tiny, tiny, tiny], [0.0, huge, huge],
                                 [1.0, 1.0, tiny], [2.0, 3.0, 4.0])]
    jobs += [("rc", a) for a in ([0.0, 0.25], [2.25, 2.0], [0.25, -2.0], [1.0, 1.0], [huge, tiny], [tiny, huge],
                                 [huge, -huge], [huge, -tiny], [tiny, -huge], [1.0, 1.1], [1.0, 0.9],
                                 [1.0, 1.0000000000000002], [0.0, tiny], [0.0, huge], [1.0, least])]
    jobs += [("rj", a) for a in ([0.0, 1.0, 2.0, 3.0], [2.0, 3.0, 4.0, 5.0], [1.0, 1.0, 1.0, 1.0],
                                 [0.0, 1.0, 1.0, 1e-300], [0.0, 1.0, 1.0, 1e300], [huge, huge, huge, huge],
                                 [0.0, huge, huge, huge], [1e-200, 1e-200, 1e-200, 1e-200], [0.0, tiny, huge, 1.0],
                                 [huge, 1.0, tiny, 1.0], [1.0, 1.0, 1.0, tiny], [1.0, 2.0, 3.0, huge],
                                 [0.5, 1.0, 1.0, 0.25], [2.0, 3.0, 4.0, -0.5], [2.0, 3.0, 4.0, -5.0],
                                 [0.0, 1.0, 2.0, -1.0], [0.5, 0.75, 1.0, -0.3])]
    jobs += [("rd", a) for a in ([0.0, 2.0, 1.0], [2.0, 3.0, 4.0], [0.0, 1.0, 1.0], [0.0, huge, huge],
                                 [huge, 0.0, 1e-100])]
    jobs += [("k", [x]) for x in (1.0, 0.5, tiny, least, 1e-16, 1 - 2.0 ** -53, 0.75)]
    jobs += [("f", a) for a in ([half_pi, 0.5], [half_pi, 1e-30], [half_pi, 1e-40], [half_pi, 0.0], [1.5, 0.0],
                                [0.5, tiny], [1.0, 1.0], [-half_pi, 0.3], [1e-300, 0.5], [4e9, 0.5], [1e15, 0.5])]
    jobs += [(name, a) for a in ([700.0, 0.0], [-0.3, 0.0], [1e-9, 0.5], [20.0, 0.0], [20.0, 1e-14],
                                 [400.0, tiny], [186.0, 1e-160], [1.0, 1.0], [1e-300, 0.0], [3e9, 0.4])
             for name in ("am", "sn", "cn", "dn")]
    jobs += [("pi", a) for a in ([half_pi, 0.3, 0.5], [half_pi, 0.0, 0.5], [half_pi, -2.0, 0.5], [0.5, 0.999, 0.1],
                                 [1.2, -1e300, 0.5], [1.0, 2.0 ** -1074, 0.5], [0.5, 2.0, 0.5], [half_pi, -1e10, 1e-10],
                                 [1.0, -5.0, 1.0], [1.0, -1.0, 0.3], [1.0, 1.0, 0.5], [half_pi, 1 - 1e-13, 1e-12])]
    jobs += [(name, [points, i]) for points in (1, 2, 3, 5, 8, 10, 11, 24, 64)
             for i in range(1, points + 1, 1 if points < 11 else 7) if 2 * i != points + 1 for name in ("gx", "gw")]
    for name, args in jobs:
        mp.mp.dps = digits_needed(name, args)
        value = value_of(name, args)
        if value != 0 and not mp.mpf(10) ** -307 < abs(value) < mp.mpf(2) ** 1023:
            continue
        print(name, len(args), *[repr(float(x)) for x in args], mp.nstr(mp.re(value), 25))


if __name__ == "__main__":
    main()
