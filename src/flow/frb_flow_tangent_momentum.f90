!> The derivative of the momentum of one body alone, for steps that the series reach. It needs neither the
!> turn nor one of the two mirror forms: with the triple s, c, d at half the step, chi = s c d, everything in
!> units of the half step,
!>
!>     N = (d^2 m1 - a m2 m3 chi, c^2 d^2 m2 + b m3 m1 chi, c^2 m3 - g m1 m2 chi)
!>     m' + m = Q N,   Q = 2 W/V,   W = D0 c^2 d^2,   V = D0 W - a g s^2 N2^2,   D0 = 1 - a g m2^2 s^2
!>
!> (the sum of the steps forth and back from the momentum at the middle). Its derivative at s held, c and d
!> algebraic, and a shift of the time along the flow, as in short_gradients, are
!>
!>     J = Q dN/dm + N (dQ/dm)^T - 1 - f (A grad P + B grad R)^T,   f = m' x a m'
!>
!> All that is close to 1 is formed as a change of 1. One division serves 1/(c^2 d^2 V). This takes three
!> quarters of the time of J by the formulas of frb_flow_tangent_one.
module frb_flow_tangent_momentum
    use frb_flow_limits, only: tiny_limit, short_limit, middle_limit
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    implicit none
    private

    public :: short_jacobian

contains

    !> Advances m by 2 t and forms `jacobian`. `done` is .false., and nothing is changed, when the step is too
    !> long for the series. All numbers plain.
    pure subroutine short_jacobian(body, t, m, jacobian, done)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t
        real(wp), intent(inout) :: m(3), jacobian(3, 3)
        logical, intent(out) :: done
        real(wp) :: a, b, g, m1, m2, m3, p, r, y, chi, dd, aa, bb, s1, s2, s3, k
        integer :: i1, i2, i3

        i1 = body%order(1)
        i2 = body%order(2)
        i3 = body%order(3)
        m1 = m(i1)
        m2 = m(i2)
        m3 = body%parity*m(i3)      ! sorted axes are right-handed: see short_formulas.inc
        a = body%alpha*t
        b = body%beta*t
        g = body%gamma*t
        s1 = m1*m1
        s2 = m2*m2
        s3 = m3*m3
        k = (a*g)*s2
        p = (b*g)*s1 + k
        r = k + (a*b)*s3
        done = max(p, r) <= middle_limit
        if (.not. done) return
        if (max(p, r) <= tiny_limit) then
            call tiny_series(p + r, p*r, y, chi)
            call tiny_integrals(p + r, p*r, p, r, dd, aa, bb)
        else if (max(p, r) <= short_limit) then
            call short_series(p + r, p*r, y, chi)
            call short_integrals(p + r, p*r, p, r, dd, aa, bb)
        else
            call middle_series(p + r, p*r, y, chi)
            call middle_integrals(p*y, r*y, dd, aa, bb)
            k = y*sqrt(y)
            aa = k*aa
            bb = k*bb
        end if
        call step_momentum(a, b, g, p, r, y, chi, aa, bb, m1, m2, m3, i1, i2, i3, body%parity, m, jacobian)
    end subroutine short_jacobian

    !> m at the end of the step, and J in the axes of the body.
    pure subroutine step_momentum(a, b, g, p, r, y, chi, aa, bb, m1, m2, m3, i1, i2, i3, parity, m, jacobian)
        real(wp), intent(in) :: a, b, g, p, r, y, chi, aa, bb, m1, m2, m3, parity
        integer, intent(in) :: i1, i2, i3
        real(wp), intent(inout) :: m(3), jacobian(3, 3)
        real(wp) :: ag, u, w, uw, cc, c2, d2, d0, ww, vv, over, over_v, kappa, q, qm, n1, n2, n3, c1, cm, c3
        real(wp) :: a23, b31, g12, p1, z2, r3, e1, e2, e3, v, t1, t2, t3, q1, q2, q3, f1, f2, f3
        real(wp) :: n11, n12, n13, n21, n22, n23, n31, n32, n33

        ag = a*g
        u = p*y
        w = r*y
        uw = u*w
        c2 = 1 - u
        d2 = 1 - w
        cc = c2*d2
        a23 = a*(m2*m3)
        b31 = b*(m3*m1)
        g12 = g*(m1*m2)
        ! N - m
        c1 = -(m1*w + a23*chi)
        cm = b31*chi - m2*((u + w) - uw)
        c3 = -(m3*u + g12*chi)
        n1 = m1 + c1
        n2 = m2 + cm
        n3 = m3 + c3
        d0 = 1 - ag*(m2*m2)*y
        ww = d0*cc
        vv = d0*ww - (ag*y)*(n2*n2)
        over = 1/(cc*vv)
        over_v = over*cc
        qm = (2*(ag*y))*(ww*(m2*m2) + n2*n2)*over_v       ! Q - 2
        ! The momentum comes first: the next step waits for it.
        f1 = m1 + (qm*n1 + 2*c1)
        f2 = m2 + (qm*n2 + 2*cm)
        f3 = m3 + (qm*n3 + 2*c3)
        m(i1) = f1
        m(i2) = f2
        m(i3) = parity*f3
        q = 2 + qm
        kappa = (0.5_wp*chi)*(over*vv)
        ! Gradients: (p1, z2, 0) and (0, z2, r3) of p and r, times s^2; (e1, e2, e3) of c^2 d^2, which times
        ! kappa is that of chi.
        p1 = (2*y)*(b*g*m1)
        z2 = (2*y)*(ag*m2)
        r3 = (2*y)*(a*b*m3)
        e1 = -d2*p1
        e2 = -z2*(c2 + d2)
        e3 = -c2*r3
        t1 = a23*kappa
        t2 = m2 + b31*kappa
        t3 = g12*kappa
        ! Gradients of N - m.
        n11 = -(w + t1*e1)
        n12 = -((a*m3)*chi + (m1*z2 + t1*e2))
        n13 = -((a*m2)*chi + (m1*r3 + t1*e3))
        n21 = (b*m3)*chi + t2*e1
        n22 = t2*e2 - ((u + w) - uw)
        n23 = (b*m1)*chi + t2*e3
        n31 = -((g*m2)*chi + (m3*p1 + t3*e1))
        n32 = -((g*m1)*chi + (m3*z2 + t3*e2))
        n33 = -(u + t3*e3)
        ! Gradient of Q = (2 dW - Q dV)/V.
        v = (2*(ag*y))*n2
        q1 = d0*e1
        q2 = d0*e2 - cc*z2
        q3 = d0*e3
        over = 2 - q*d0
        q1 = (over*q1 + (q*v)*n21)*over_v
        q2 = (over*q2 + q*(ww*z2 + (v + v*n22)))*over_v
        q3 = (over*q3 + (q*v)*n23)*over_v
        ! The shift of the time.
        t1 = 2*(aa*(b*g*m1))
        t2 = 2*((aa + bb)*(ag*m2))
        t3 = 2*(bb*(a*b*m3))
        e1 = a*(f2*f3)
        e2 = -b*(f3*f1)
        e3 = g*(f1*f2)
        jacobian(i1, i1) = 1 + ((qm + q*n11) + (n1*q1 + e1*t1))
        jacobian(i1, i2) = q*n12 + (n1*q2 + e1*t2)
        jacobian(i1, i3) = parity*(q*n13 + (n1*q3 + e1*t3))
        jacobian(i2, i1) = q*n21 + (n2*q1 + e2*t1)
        jacobian(i2, i2) = 1 + ((qm + q*n22) + (n2*q2 + e2*t2))
        jacobian(i2, i3) = parity*(q*n23 + (n2*q3 + e2*t3))
        jacobian(i3, i1) = parity*(q*n31 + (n3*q1 + e3*t1))
        jacobian(i3, i2) = parity*(q*n32 + (n3*q2 + e3*t2))
        jacobian(i3, i3) = 1 + ((qm + q*n33) + (n3*q3 + e3*t3))
    end subroutine step_momentum

    include 'series_formulas.inc'

    include 'tiny_formulas.inc'

    include 'middle_formulas.inc'

    include 'tangent_short_integrals.inc'

    include 'tangent_middle_formulas.inc'

end module frb_flow_tangent_momentum
