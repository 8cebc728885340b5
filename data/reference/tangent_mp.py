"""Tangent map of the exact free rigid body step, arbitrary precision (mpmath): closed form, no orbit is special.

Notation of src/flow/short_formulas.inc.  m: body angular momentum, q: unit quaternion (scalar first, body to space),
I: moments in any order, h: time.  Variations of the attitude are rotation vectors in BODY axes:
    q + dq = q (1, dtheta/2)           (0 at the start gives dtheta' at the end)
Answer of step_tangent(I, m, q, h):
    m', q'                     state after h
    J   3x3   dm'     = J dm
    W   3x3   dtheta' = W dm + E dtheta,   E = R(q_step)^T
    E   3x3
    mI  3x3   dm'/dI_k     in column k      wI  3x3   dtheta'/dI_k in column k
    mh, wh    dm'/dh, dtheta'/dh            (= m' x a m', a m')
    wA  3x3   dtheta'/dA_23, dA_13, dA_12 (columns): off-diagonal elements of the inverse tensor A = I^-1 of a body
              whose axes turn away from these; together with wI the derivative by a whole tensor;  mA = m' x wA
In space axes: dtheta_space = R(q') dtheta, so W_space = R(q') W and E_space = 1.

The transcendental parts: s, c, d, H of the step and two integrals of the second kind more,
    D = int s^2,  A = int s^2/c^2,  B = int s^2/d^2   (0 to h/2),   A + B + D = s^3/(c d).
"""
import mpmath as mp

# ---------------------------------------------------------------- quaternions and 3x3 matrices (lists of rows)
def qmul(p, q):
    return [p[0]*q[0]-p[1]*q[1]-p[2]*q[2]-p[3]*q[3],
            p[0]*q[1]+q[0]*p[1]+p[2]*q[3]-p[3]*q[2],
            p[0]*q[2]+q[0]*p[2]+p[3]*q[1]-p[1]*q[3],
            p[0]*q[3]+q[0]*p[3]+p[1]*q[2]-p[2]*q[1]]
def rot(q):
    """matrix of the quaternion, any norm"""
    w, x, y, z = q
    n = w*w+x*x+y*y+z*z
    return [[(w*w+x*x-y*y-z*z)/n, 2*(x*y-w*z)/n, 2*(x*z+w*y)/n],
            [2*(x*y+w*z)/n, (w*w-x*x+y*y-z*z)/n, 2*(y*z-w*x)/n],
            [2*(x*z-w*y)/n, 2*(y*z+w*x)/n, (w*w-x*x-y*y+z*z)/n]]
def hat(v): return [[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]]
def cross(a, b): return [a[1]*b[2]-a[2]*b[1], a[2]*b[0]-a[0]*b[2], a[0]*b[1]-a[1]*b[0]]
def tr(A): return [list(r) for r in zip(*A)]
def mm(A, B): return [[sum(A[i][k]*B[k][j] for k in range(len(B))) for j in range(len(B[0]))] for i in range(len(A))]
def mv(A, v): return [sum(x*y for x, y in zip(r, v)) for r in A]
def lin(*terms):
    """sum of (factor, vector) pairs"""
    n = len(terms[0][1])
    return [sum(f*v[i] for f, v in terms) for i in range(n)]

# ---------------------------------------------------------------- the elliptic triple and its four integrals
def triple(P, R, nu, t):
    """s, c, d, H, D, E2 at t;  E2 = B when P >= R (c is cn-like), else A (d is cn-like): the regular one"""
    one, zero = mp.mpf(1), mp.mpf(0)
    first = P >= R
    p, r = (P, R) if first else (R, P)          # p: of the cn-like function
    def parts(s, cn, dn):
        if s == 0: return [zero]*3
        y = s**3/3
        return [y*mp.elliprj(cn*cn, dn*dn, 1, 1+nu*s*s), y*mp.elliprd(cn*cn, dn*dn, 1), y*mp.elliprd(1, cn*cn, dn*dn)]
    lam = mp.sqrt(p)
    if lam == 0: s, cn, dn = t, one, one
    elif r == p:
        s, cn = mp.tanh(lam*t)/lam, mp.sech(lam*t)
        dn = cn
    else:
        k2 = r/p
        K = mp.ellipk(k2)
        j = mp.nint(lam*t/(2*K))
        v = lam*t-2*K*j
        s, cn, dn = mp.ellipfun('sn', v, m=k2)/lam, mp.ellipfun('cn', v, m=k2), mp.ellipfun('dn', v, m=k2)
        X = parts(s, cn, dn)
        if j:
            X = lin((1, X), (2*j, parts(1/lam, zero, mp.sqrt(1-k2))))
            if int(j) % 2: s, cn = -s, -cn
        return [s]+([cn, dn] if first else [dn, cn])+X
    return [s]+([cn, dn] if first else [dn, cn])+parts(s, cn, dn)

# ---------------------------------------------------------------- the step and its tangent, I1 <= I2 <= I3
def sorted_tangent(I, m, h):
    """I sorted. Answers m', q_step, J, W, E, dm'/da, dtheta'/da (a_k = 1/I_k) and dtheta'/d(A23, A13, A12) (columns)"""
    a = [1/x for x in I]
    al, be, ga = a[1]-a[2], a[0]-a[2], a[0]-a[1]
    m1, m2, m3 = m
    G2 = m1*m1+m2*m2+m3*m3
    G = mp.sqrt(G2)
    n = [x/G for x in m] if G else [mp.mpf(0)]*3
    Pt, Rt = be*m1*m1+al*m2*m2, ga*m2*m2+be*m3*m3
    P, R, nu = ga*Pt, al*Rt, ga*Rt
    if abs(al*m3*m3-ga*m1*m1)*be <= max(P, R)*mp.mpf(10)**(8-mp.mp.dps): R = P     # ellipfun has no digits there
    s, c, d, H, D, E2 = triple(P, R, nu, h/2)
    first = P >= R                              # c is the cn-like function

    # ---- the step
    y = s*s
    w = 1+nu*y
    D0 = c*c+be*ga*m1*m1*y if first else d*d+al*be*m3*m3*y
    p1, p2, p3 = m1*d-al*m2*m3*s*c, m2*c*d+be*m3*m1*s, m3*c-ga*m1*m2*s*d
    u1, u2, u3 = p1/D0, p2/D0, p3/D0            # momentum at mid-step
    psi = a[0]*h-2*be*nu*H                      # e turns by theta = psi G about m
    x, Y = ga*s*u2, be*s*u3                     # z ~ (d, 0, -x d, -Y)
    N = d*d*(1+x*x)+Y*Y                         # = (1 - al ga u2^2 s^2) w > 0
    Rz = rot([d, mp.mpf(0), -x*d, -Y])
    RzT = tr(Rz)
    me = mv(RzT, m)                             # momentum at the end
    half = psi*G/2
    qs = qmul([mp.cos(half)]+[mp.sin(half)*v for v in n], [v/mp.sqrt(N) for v in (d, mp.mpf(0), -x*d, -Y)])

    # ---- directions of change: m1 m2 m3 a1 a2 a3
    def unit(*pairs):
        e = [mp.mpf(0)]*6
        for k, v in pairs: e[k] += v
        return e
    d1, d2, d3, da1 = unit((0, 1)), unit((1, 1)), unit((2, 1)), unit((3, 1))
    dal, dbe, dga = unit((4, 1), (5, -1)), unit((3, 1), (5, -1)), unit((3, 1), (4, -1))
    dRt = lin((2*ga*m2, d2), (2*be*m3, d3), (m2*m2, dga), (m3*m3, dbe))
    dPt = lin((2*be*m1, d1), (2*al*m2, d2), (m1*m1, dbe), (m2*m2, dal))
    dP, dR = lin((ga, dPt), (Pt, dga)), lin((al, dRt), (Rt, dal))
    dPR = lin((be*ga*2*m1, d1), (-be*al*2*m3, d3), (ga*m1*m1-al*m3*m3, dbe), (be*m1*m1, dga), (-be*m3*m3, dal))

    # ---- gradients of x and of Y: explicit part, time shift X, and what is left of c, d
    ex2 = lin((c*d, d2), (s*m3*m1, dbe), (s*be*m3, d1), (s*be*m1, d3))
    ex3 = lin((c, d3), (-s*d*m1*m2, dga), (-s*d*ga*m1, d2), (-s*d*ga*m2, d1))
    if first: ex0 = lin((y*2*be*ga*m1, d1), (y*m1*m1*be, dga), (y*m1*m1*ga, dbe))
    else:     ex0 = lin((y*2*al*be*m3, d3), (y*m3*m3*be, dal), (y*m3*m3*al, dbe))
    ex = lin((ga*s/D0, ex2), (s*u2, dga), (-x/D0, ex0))
    eY = lin((be*s/D0, ex3), (s*u3, dbe), (-Y/D0, ex0))
    xt, Yt = ga*(c*d*u2+be*s*u3*u1), be*(c*d*u3-ga*s*u1*u2)
    hy, f = y/2, be*m3*s*c/D0                   # f = Y - Y_Euler
    if first:                                   # D, B = E2;  dP - dR = dPR
        X = lin((D/2, dP), (E2/2, dPR))
        g = lin((-hy*d, dP), (hy/d, dPR))       # d dP-part: delta d = -R s c X + g
        xd = ga*s*m2*c/D0
        gx = lin((1, ex), (xt, X), (xd, g))                                   # x_E = d x_d
        gY = lin((d, eY), (d*Yt+R*s*c*Y, X), (-f, g))                         # = d grad Y - Y grad d
    else:                                       # D, A = E2;  dR - dP = -dPR
        X = lin((D/2, dR), (-E2/2, dPR))
        g = lin((-hy*c, dR), (-hy/c, dPR))      # delta c = -P s d X + g
        xc = ga*s*m2*d/D0
        Yc = be*s*m3/D0
        gx = lin((1, ex), (xt, X), (xc, g))
        # delta Y - part: Y_E = Y - f; c Y_c = f, so -hy Y_E dR + (hy/c) Y_c (-dPR) ; minus Y * (-hy dR)
        gY = lin((d, eY), (d*Yt+R*s*c*Y, X), (hy*d*f, dR), (-(hy/c)*d*Yc, dPR))

    # ---- gradient of psi: no integral of the third kind but in the radial part
    if first: c2A, d2B = s**3*c/d-c*c*(D+E2), d*d*E2
    else:     c2A, d2B = c*c*E2, s**3*d/c-d*d*(D+E2)
    dpsi = lin((h, da1), (-be*ga*(D+d2B)/w, dRt), (-ga*Rt*(c2A+d2B)/w, dal),
               (-Rt*(be*D+(al+2*ga)*c2A+ga*d2B)/w, dga))
    if G:
        rad = -2*be*(nu/G2)*(c2A/w-H)
        dpsi = lin((1, dpsi), (rad*m1, d1), (rad*m2, d2), (rad*m3, d3))

    # ---- assembly: dtheta' = turn of e + m' dpsi - (2/N) [(-Y,d,0) d dx + (x,0,1) (d dY - Y dd)]
    b1, b2 = [-Y, d, mp.mpf(0)], [x, mp.mpf(0), mp.mpf(1)]
    Wall = [[me[i]*dpsi[k]-2/N*(b1[i]*d*gx[k]+b2[i]*gY[k]) for k in range(6)] for i in range(3)]
    Z = [[-2/N*(b1[i]*d*gx[k]+b2[i]*gY[k]) for k in range(6)] for i in range(3)]
    mall = mm(hat(me), Z)                       # m' x ...: psi drops out
    for i in range(3):
        for k in range(3): mall[i][k] += RzT[i][k]
    ne = mv(RzT, n)
    if G: sG, cG = mp.sin(2*half)/G, 2*mp.sin(half)**2/G
    else: sG, cG = psi, mp.mpf(0)
    S = mm(RzT, hat(n))
    for i in range(3):
        for k in range(3): Wall[i][k] += sG*RzT[i][k]+(psi-sG)*ne[i]*n[k]-cG*S[i][k]
    J, ma = [r[:3] for r in mall], [r[3:] for r in mall]
    W, wa = [r[:3] for r in Wall], [r[3:] for r in Wall]
    # ---- off-diagonal elements: a turn phi = e_k of the body's axes changes A_ij by a difference a_i - a_j, and
    #      dtheta' = (E - 1) phi - W (phi x m); divided by the difference before anything is evaluated
    wA = []
    for k in range(3):
        if k == 2:      # A12, / gamma
            vP, vPR, vR = -2*ga*m1*m2, -2*be*m1*m2, 2*m1*m2
            vx = s*(c*d*m1-be*m2*m3*s)/D0+(2*be*y*m1*m2*x/D0 if first else 0)
            vY = be*y*d*(m2*m2-m1*m1)/D0+(2*be*y*m1*m2*Y/D0 if first else 0)
            ro = lin((s*u2*d, [d, Y, -x*d]))
        elif k == 1:    # A13, / (-beta)
            vP, vPR, vR = -2*ga*m1*m3, -2*be*m1*m3, 2*m3*m1
            vx = -ga*y*(m3*m3-m1*m1)/D0+(2*ga*y*m1*m3*x/D0 if first else -2*al*y*m1*m3*x/D0)
            vY = s*(s*d*ga*m2*m3+c*m1)/D0+(2*ga*y*m1*m3*Y/D0 if first else -2*al*y*m1*m3*Y/D0)
            ro = lin((s*u3, [d, Y, -x*d]))
        else:           # A23, / alpha
            vP, vPR, vR = -2*ga*m2*m3, -2*be*m2*m3, 2*m2*m3
            vx, vY = (0, 0) if first else (-2*be*y*m2*m3*x/D0, -2*be*y*m2*m3*Y/D0)
            ro = lin((w*s*c/D0, [x*d*m2-Y*m3, d*m3, d*m2]))
        if first:
            vX, vg = (D*vP+E2*vPR)/2, hy*(vPR/d-d*vP)
            ax, aY = vx+xt*vX+xd*vg, d*vY+(d*Yt+R*s*c*Y)*vX-f*vg
        else:
            vRR = vP-vPR                        # of R
            vX, vg = (D*vRR-E2*vPR)/2, -hy*(vPR/c+c*vRR)
            ax, aY = vx+xt*vX+xc*vg, d*vY+(d*Yt+R*s*c*Y)*vX+hy*d*f*vRR-(hy/c)*d*Yc*vPR
        ps = -be*ga*(D+d2B)/w*vR
        wA.append([2/N*(ro[i]+b1[i]*d*ax+b2[i]*aY)-me[i]*ps for i in range(3)])
    return me, qs, J, W, tr(rot(qs)), ma, wa, tr(wA)

def step_tangent(I, m, q, h, dps=60):
    """see the head of the file; I in any order, q any quaternion (q' keeps its norm)"""
    with mp.workdps(dps+15):
        I, m, q, h = [mp.mpf(v) for v in I], [mp.mpf(v) for v in m], [mp.mpf(v) for v in q], mp.mpf(h)
        p = sorted(range(3), key=lambda i: I[i])
        even = p in ([0, 1, 2], [1, 2, 0], [2, 0, 1])
        sg = [1, 1, 1 if even else -1]          # sorted axes right-handed: an odd sorting turns the last one round
        me, qs, J, W, E, ma, wa, wA = sorted_tangent([I[i] for i in p], [g*m[i] for g, i in zip(sg, p)], h)
        def back(v):
            o = [None]*3
            for k, i in enumerate(p): o[i] = sg[k]*v[k]
            return o
        def back2(A, cols=True):
            o = [[None]*3 for _ in range(3)]
            for k, i in enumerate(p):
                for l, j in enumerate(p): o[i][j] = sg[k]*A[k][l]*(sg[l] if cols else 1)
            return o
        M, Q = back(me), [qs[0]]+back(qs[1:])
        J, W, E = back2(J), back2(W), back2(E)
        mI, wI = back2(ma, False), back2(wa, False)
        for i in range(3):
            for k in range(3):
                mI[i][k] *= -1/I[k]**2
                wI[i][k] *= -1/I[k]**2
        wO = [[None]*3 for _ in range(3)]       # columns: A23, A13, A12 of the caller's axes
        for k in range(3):
            j, l = p[(k+1) % 3], p[(k+2) % 3]   # sorted column k belongs to the pair of the other two axes
            f = sg[(k+1) % 3]*sg[(k+2) % 3]
            for i in range(3): wO[p[i]][p[k]] = sg[i]*f*wA[i][k]
        om = [v/w for v, w in zip(M, I)]
        return dict(m=M, q=qmul(q, Q), J=J, W=W, E=E, mI=mI, wI=wI, mh=cross(M, om), wh=om, wA=wO, mA=mm(hat(M), wO))

if __name__ == "__main__":
    r = step_tangent((0.6, 0.8, 1), (1.8, 0.4, -0.9), (1, 0, 0, 0), 10, 50)
    for k, v in r.items(): print(k, mp.nstr(mp.matrix(v), 18), sep="\n")
