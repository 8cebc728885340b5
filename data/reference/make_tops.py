"""End values of heavy tops to 25 digits, by Taylor series in 50-digit arithmetic (needs mpmath).

    m' = m x I^-1 m + u x c,   u = Q(q)^T f,   q' = q (0, I^-1 m)/2,   q(0) = 1

One line per top: name, t, m(t), q(t). The right-hand side is polynomial, so the coefficients of the series follow
from Cauchy products; the step and the order leave errors below 1e-40. Nothing of the library is used.
"""
from mpmath import mp, mpf

mp.dps = 50
ORDER = 60

TOPS = [
    ('papers_top', '20', ['1', '1.0126869887825154', '3.3062374224730378'],
     ['-0.34790957088547336', '-0.19822914599675923', '-0.91633189192763642'],
     ['9.5586303547238536e-5', '4.8777318247201465e-4', '-8.6772148817192390e-4']),
    ('asymmetric_top', '10', ['0.6', '0.8', '1.0'], ['1.8', '0.4', '-0.9'], ['0', '0', '1']),
    ('flat_top', '10', ['0.345', '0.653', '1.0'], ['1.8', '0.4', '-0.9'], ['0', '0', '1']),
]


def double(text):
    """The double-precision number the library reads from this text."""
    return mpf(float(text))


def product(x, y, k):
    return sum((x[i] * y[k - i] for i in range(k + 1)), mpf(0))


def series(m0, q0, a, f, order):
    m = [[v] for v in m0]
    q = [[v] for v in q0]
    w = [[a[j] * m[j][0]] for j in range(3)]
    for k in range(order):
        qq = [[product(q[i], q[j], k) if j >= i else None for j in range(4)] for i in range(4)]
        # Rows of Q in terms of q, for norm one: u = Q^T f.
        rot = [[qq[0][0] + qq[1][1] - qq[2][2] - qq[3][3], 2 * (qq[1][2] - qq[0][3]), 2 * (qq[1][3] + qq[0][2])],
               [2 * (qq[1][2] + qq[0][3]), qq[0][0] - qq[1][1] + qq[2][2] - qq[3][3], 2 * (qq[2][3] - qq[0][1])],
               [2 * (qq[1][3] - qq[0][2]), 2 * (qq[2][3] + qq[0][1]), qq[0][0] - qq[1][1] - qq[2][2] + qq[3][3]]]
        u = [sum(rot[i][j] * f[i] for i in range(3)) for j in range(3)]
        torque = [u[1], -u[0], mpf(0)]                      # u x e3
        dm = [product(m[1], w[2], k) - product(m[2], w[1], k) + torque[0],
              product(m[2], w[0], k) - product(m[0], w[2], k) + torque[1],
              product(m[0], w[1], k) - product(m[1], w[0], k) + torque[2]]
        dq = [-product(q[1], w[0], k) - product(q[2], w[1], k) - product(q[3], w[2], k),
              product(q[0], w[0], k) + product(q[2], w[2], k) - product(q[3], w[1], k),
              product(q[0], w[1], k) + product(q[3], w[0], k) - product(q[1], w[2], k),
              product(q[0], w[2], k) + product(q[1], w[1], k) - product(q[2], w[0], k)]
        for j in range(3):
            m[j].append(dm[j] / (k + 1))
            w[j].append(a[j] * m[j][-1])
        for j in range(4):
            q[j].append(dq[j] / (2 * (k + 1)))
    return m, q


def value(c, h):
    total = mpf(0)
    for x in reversed(c):
        total = total * h + x
    return total


for name, t, moments, m0, f in TOPS:
    a = [1 / double(v) for v in moments]
    m = [double(v) for v in m0]
    q = [mpf(1), mpf(0), mpf(0), mpf(0)]
    f = [double(v) for v in f]
    steps = int(t) * 10
    for _ in range(steps):
        cm, cq = series(m, q, a, f, ORDER)
        m = [value(c, mpf(t) / steps) for c in cm]
        q = [value(c, mpf(t) / steps) for c in cq]
    print(name, t, *[mp.nstr(v, 25) for v in m + q])
