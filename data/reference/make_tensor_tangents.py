"""Derivatives of the step of bodies given by a tensor: exact double inputs, outputs to 22 digits.
group, tensor (11, 22, 33, 12, 13, 23), m(3), h | m'(3), q'(4) | J, W (3 x 3, row by row), dm' and dtheta' by the six
elements (3 x 6, row by row) | sensitivities of the four: Frobenius norm of the change when each of m, h moves by a
relative 2^-53 and each element of the tensor by 2^-53 of the largest, summed.
usage: make_tensor_tangents.py SEED PER_GROUP > file"""
import random, sys
import mpmath as mp
from tangent_mp import step_tangent, mm, mv, tr, cross
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
rnd = random.Random(int(sys.argv[1]))
mp.mp.dps = 45


def derivatives(x):
    """x: six elements, m, h -> m', q', J, W, mT, wT"""
    T = mp.matrix(3, 3)
    for (i, j), v in zip(PAIRS, x[:6]):
        T[i, j] = T[j, i] = v
    moments, R = mp.eigsy(T)
    R = [[R[i, j] for j in range(3)] for i in range(3)]
    if mp.det(mp.matrix(R)) < 0:
        R = [[r[0], r[1], -r[2]] for r in R]
    Rt = tr(R)
    I = [moments[k] for k in range(3)]
    s = step_tangent(I, mv(Rt, x[6:9]), (1, 0, 0, 0), x[9], 45)
    turn = lambda A: mm(R, mm(A, Rt))
    # dtheta' by the elements in principal axes, then in those of the tensor
    w = [[s['wI'][i][k] for k in range(3)] + [-s['wA'][i][3 - sum(PAIRS[k])]/(I[PAIRS[k][0]]*I[PAIRS[k][1]])
         for k in (3, 4, 5)] for i in range(3)]
    wT = [[mp.mpf(0)]*6 for _ in range(3)]
    for e, (i, j) in enumerate(PAIRS):
        change = [R[i][a]*R[j][b] + (R[j][a]*R[i][b] if i != j else 0) for a, b in PAIRS]
        theta = mv(R, [sum(w[r][k]*change[k] for k in range(6)) for r in range(3)])
        for r in range(3):
            wT[r][e] = theta[r]
    m = mv(R, s['m'])
    mT = tr([cross(m, c) for c in tr(wT)])
    q = [s['q'][0]] + mv(R, s['q'][1:])
    return m, q, turn(s['J']), turn(s['W']), mT, wT


def flat(A): return [x for r in A for x in r]
def norm(v): return mp.sqrt(sum(x*x for x in v))
def gauss(): return [rnd.gauss(0, 1) for _ in range(3)]


def rotation():
    w, x, y, z = [v/norm(q) for q in [[rnd.gauss(0, 1) for _ in range(4)]] for v in q]
    return [[float(v) for v in r] for r in
            [[1-2*(y*y+z*z), 2*(x*y-w*z), 2*(x*z+w*y)], [2*(x*y+w*z), 1-2*(x*x+z*z), 2*(y*z-w*x)],
             [2*(x*z-w*y), 2*(y*z+w*x), 1-2*(x*x+y*y)]]]


def tensor(I):
    R = rotation()
    return [float(sum(R[i][k]*I[k]*R[j][k] for k in range(3))) for i, j in PAIRS]


def cases(per):
    for _ in range(per):
        y = rnd.uniform(.5, 1)
        I = [rnd.uniform(1 - y, y), y, 1.0]
        yield 'general', tensor(I), gauss(), rnd.choice((-1, 1))*10**rnd.uniform(-3, 1)
        yield 'long', tensor(I), gauss(), 10**rnd.uniform(1, 4)
        yield 'symmetric', tensor(rnd.choice(([y, y, 1], [y, 1, 1], [y, y*(1 + 1e-12), 1]))), gauss(), 10**rnd.uniform(-2, 2)
        yield 'sphere', tensor([1, 1, 1]), gauss(), 10**rnd.uniform(-2, 1)
        yield 'nearly_diagonal', [I[0], I[1], I[2], 1e-9*rnd.gauss(0, 1), 0, 1e-12*rnd.gauss(0, 1)], gauss(), 10**rnd.uniform(-2, 1)
        yield 'diagonal', [I[2], I[0], I[1], 0, 0, 0], gauss(), 10**rnd.uniform(-2, 2)
        yield 'scale', [4096.0*x for x in tensor(I)], [1e-9*x for x in gauss()], 10**rnd.uniform(10, 14)
        yield 'rod', tensor([10**rnd.uniform(-3, -1), .9, 1]), gauss(), 10**rnd.uniform(-3, 0)


for group, T, m, h in cases(int(sys.argv[2])):
    x = [mp.mpf(float(v)) for v in (*T, *m, h)]
    base = derivatives(x)
    sens = [mp.mpf(0)]*4
    u = mp.mpf(2)**-53
    for k in range(10):
        step = u*(max(abs(v) for v in x[:6]) if k < 6 else abs(x[k]))
        if group == 'diagonal' and k in (3, 4, 5):
            continue
        z = list(x)
        z[k] += step
        other = derivatives(z)
        for n in range(4):
            sens[n] += norm([a - b for a, b in zip(flat(other[2 + n]), flat(base[2 + n]))])
    print(group, *['%.17g' % float(v) for v in x], *[mp.nstr(v, 22) for v in (*base[0], *base[1])],
          *[mp.nstr(v, 22) for A in base[2:] for v in flat(A)], *[mp.nstr(v, 6) for v in sens])
