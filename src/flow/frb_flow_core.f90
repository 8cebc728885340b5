!> The kernel of the free flow, first version: the closed form with increments, short steps by series,
!> longer ones by doubling, whole periods by the AGM.
module frb_flow_core
    use frb_inertia, only: rigid_body
    use frb_kinds, only: wp
    use frb_long_time, only: long_triple
    implicit none
    private

    public :: flow_core

    real(wp), parameter :: short_limit = 0.01_wp
    real(wp), parameter :: base_limit = 0.01_wp

contains

    subroutine flow_core(body, h, m, q, mode)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(in) :: mode
        real(wp) :: t, a, b, c, x1, x2, x3, m1, m2, m3, pt, rt, p, r
        integer :: i, j, k

        i = body%order(1)
        j = body%order(2)
        k = body%order(3)
        m1 = m(i)
        m2 = m(j)
        m3 = m(k)
        t = h/2
        a = body%alpha*t
        b = body%beta*t
        c = body%gamma*t
        x1 = m1*m1
        x2 = m2*m2
        x3 = m3*m3
        pt = b*x1 + a*x2
        rt = c*x2 + b*x3
        p = c*pt
        r = a*rt
        if (max(p, r) <= short_limit) then
            call short_step(body, t, m, q, mode)
        else
            call general_step(body, t, m, q, mode)
        end if
    end subroutine flow_core

    subroutine short_step(body, t, m, q, mode)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: t
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(in) :: mode
        real(wp) :: a, b, c, x1, x2, x3, m1, m2, m3, pt, rt, p, r, g2, sg
        real(wp) :: e1, e2, s, cd, s2, u, w, nn, y, s2n, den, d1, d2, d3, uw, y4
        real(wp) :: xx, dd0, g, v0, v2, v3, rr, kk, z0, z2, z3, phi, f, av, nv, mi, mo, ss
        real(wp) :: ev(3), ec, sc, x, hsum
        integer :: i, j, k, ax

        i = body%order(1)
        j = body%order(2)
        k = body%order(3)
        sg = body%parity
        m1 = m(i)
        m2 = m(j)
        m3 = m(k)
        a = body%alpha*t
        b = body%beta*t
        c = body%gamma*t
        x1 = m1*m1
        x2 = m2*m2
        x3 = m3*m3
        pt = b*x1 + a*x2
        rt = c*x2 + b*x3
        p = c*pt
        r = a*rt
        g2 = x1 + x2 + x3
        e1 = p + r
        e2 = p*r
        call series(e1, e2, s, cd)
        s2 = s*s
        u = p*s2
        w = r*s2
        uw = u*w
        nn = 1 - uw
        y = a*c*x2
        s2n = 2*s*cd
        y4 = y*s2n*s2n
        den = nn*nn - y4
        d1 = m1*(y4 - 2*w*(1 - u)*nn) - sg*a*m2*m3*s2n*(1 - 2*u + uw)
        d3 = m3*(y4 - 2*u*(1 - w)*nn) - sg*c*m1*m2*s2n*(1 - 2*w + uw)
        d2 = m2*(y4 + 8*uw - 2*(u + w)*(1 + uw)) + sg*b*m3*m1*s2n*nn
        if (mode > 0) then
            xx = m2*cd + sg*b*m3*m1*s
            dd0 = 1 - y*s2
            if (c*rt <= a*pt) then
                av = body%a(1); nv = c*rt; f = c; g = 1 - w; mi = m3; mo = m1; ss = 1
                ax = k
            else
                av = -body%a(3); nv = a*pt; f = a; g = 1 - u; mi = m1; mo = m3; ss = -1
                ax = i
            end if
            v0 = g*dd0
            v2 = -ss*f*s*g*xx
            v3 = -ss*b*s*(mi*cd - sg*f*mo*m2*s*g)
            rr = sqrt(v0*v0 + v2*v2 + v3*v3)
            kk = 1/(rr*(rr + v0))
            z0 = -(v2*v2 + v3*v3)*kk
            z2 = v2*(rr + v0)*kk
            z3 = v3*(rr + v0)*kk
            call third(u, w, nv*s2, hsum)
            phi = av*t - b*nv*s2*s*hsum
            x = g2*phi*phi
            if (x < 0.6_wp) then
                call sincos_small(x, sc, ec)
            else
                x = sqrt(x)
                sc = sin(x)/x
                ec = cos(x) - 1
            end if
            ev = ss*phi*sc*m
            call compose(q, ec, ev, z0, z2, z3, j, ax)
        end if
        m(i) = m1 + d1/den
        m(j) = m2 + d2/den
        m(k) = m3 + d3/den
    end subroutine short_step

    subroutine compose(q, ec, ev, z0, z2, z3, j, ax)
        real(wp), intent(inout) :: q(4)
        real(wp), intent(in) :: ec, ev(3), z0, z2, z3
        integer, intent(in) :: j, ax
        real(wp) :: z(3), w(4), q0(4)

        z = 0
        z(j) = z2
        z(ax) = z3
        w(1) = ec + z0 + ec*z0 - (ev(1)*z(1) + ev(2)*z(2) + ev(3)*z(3))
        w(2) = z(1) + ec*z(1) + ev(1) + ev(1)*z0 + (ev(2)*z(3) - ev(3)*z(2))
        w(3) = z(2) + ec*z(2) + ev(2) + ev(2)*z0 + (ev(3)*z(1) - ev(1)*z(3))
        w(4) = z(3) + ec*z(3) + ev(3) + ev(3)*z0 + (ev(1)*z(2) - ev(2)*z(1))
        q0 = q
        q(1) = q0(1) + (q0(1)*w(1) - q0(2)*w(2) - q0(3)*w(3) - q0(4)*w(4))
        q(2) = q0(2) + (q0(1)*w(2) + w(1)*q0(2) + q0(3)*w(4) - q0(4)*w(3))
        q(3) = q0(3) + (q0(1)*w(3) + w(1)*q0(3) + q0(4)*w(2) - q0(2)*w(4))
        q(4) = q0(4) + (q0(1)*w(4) + w(1)*q0(4) + q0(2)*w(3) - q0(3)*w(2))
    end subroutine compose

    pure subroutine sincos_small(x, sc, ec)
        real(wp), intent(in) :: x
        real(wp), intent(out) :: sc, ec
        sc = 1 - x*(1/6.0_wp - x*(1/120.0_wp - x*(1/5040.0_wp - x*(1/362880.0_wp - x*(1/39916800.0_wp &
              - x*(1/6227020800.0_wp - x*(1/1307674368000.0_wp)))))))
        ec = -x*(0.5_wp - x*(1/24.0_wp - x*(1/720.0_wp - x*(1/40320.0_wp - x*(1/3628800.0_wp &
              - x*(1/479001600.0_wp - x*(1/87178291200.0_wp)))))))
    end subroutine sincos_small

    pure subroutine series(e1, e2, s, cd)
        real(wp), intent(in) :: e1, e2
        real(wp), intent(out) :: s, cd
        real(wp) :: t2, t3, t4, t5, t6
        t2 = e1*e1 + 12*e2
        t3 = e1*(e1*e1 + 132*e2)
        t4 = e1*e1*(e1*e1 + 1224*e2) + 3024*e2*e2
        t5 = e1*(e1*e1*(e1*e1 + 11064*e2) + 132624*e2*e2)
        t6 = e1*e1*(e1*e1*(e1*e1 + 99636*e2) + 4095792*e2*e2) + 4390848*e2*e2*e2
        s = 1 + (-e1/6 + (t2/120 + (-t3/5040 + (t4/362880 + (-t5/39916800 + t6/6227020800.0_wp)))))
        cd = 1 + (-e1/2 + (t2/24 + (-t3/720 + (t4/40320 + (-t5/3628800 + t6/479001600.0_wp)))))
    end subroutine series

    pure subroutine third(u, w, nu, hsum)
        real(wp), intent(in) :: u, w, nu
        real(wp), intent(out) :: hsum
        real(wp) :: g, g1, g2, hk
        integer :: k
        hk = 1
        hsum = 1/3.0_wp
        g = 1
        g1 = 0
        do k = 0, 8
            g2 = (real(2*k + 1, wp)/(k + 1))*((u + w)/2)*g - (real(k, wp)/(k + 1))*u*w*g1
            g1 = g
            g = g2
            hk = g - nu*hk
            hsum = hsum + hk/(2*k + 5)
        end do
    end subroutine third

    subroutine general_step(body, t, m, q, mode)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: t
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(in) :: mode
        real(wp) :: a, b, c, x1, x2, x3, m1, m2, m3, pt, rt, p, r, nu, g2, sg
        real(wp) :: s, d0, n1, n2, n3, den, x, gg
        real(wp) :: f, av, ss, hsum, ec, es, cc, dd, dl, pm, s2, c2, d2, nn, am, bm, z0, z2, z3, wn, e0, e1, sx, cx
        integer :: i, j, k, ax, jj, kk
        logical :: cn_is_c

        i = body%order(1)
        j = body%order(2)
        k = body%order(3)
        sg = body%parity
        m1 = m(i)
        m2 = m(j)
        m3 = m(k)
        a = body%alpha*t
        b = body%beta*t
        c = body%gamma*t
        x1 = m1*m1
        x2 = m2*m2
        x3 = m3*m3
        pt = b*x1 + a*x2
        rt = c*x2 + b*x3
        p = c*pt
        r = a*rt
        g2 = x1 + x2 + x3
        gg = sqrt(g2)
        dl = b*(a*x3 - c*x1)
        cn_is_c = dl <= 0
        dl = abs(dl)
        pm = max(p, r)
        if (c*rt <= a*pt) then
            av = body%a(1); nu = c*rt; ss = 1
            ax = k
        else
            av = -body%a(3); nu = a*pt; ss = -1
            ax = i
        end if
        if (pm > 4.0_wp) then
            ! x: extra angle of whole periods
            call long_triple(pm, dl, nu, s, jj, x)
            ! s now holds reduced time fraction in units of t
        else
            s = 1
            x = 0
            jj = 0
        end if
        f = s*s*max(pm, nu)
        kk = 0
        do while (f > base_limit)
            f = f/4
            kk = kk + 1
        end do
        f = s*0.5_wp**kk
        call series((p + r)*f*f, p*r*f**4, s, x2)
        s = s*f
        cc = sqrt(1 - pm*s*s)
        dd = sqrt(1 - merge(r, p, cn_is_c)*s*s)
        call third(p*s*s, r*s*s, nu*s*s, hsum)
        f = gg*b*nu*s*s*s*hsum
        ec = cos(f)
        es = sin(f)
        do kk = kk, 1, -1
            nn = cc*cc + pm*s*s*dd*dd
            s2 = 2*s*cc*dd/nn
            c2 = (cc*cc - pm*s*s*dd*dd)/nn
            d2 = (cc*cc*dd*dd + dl*s*s)/nn
            am = 1 + nu*(s2*s2 - s*s*c2*d2)
            bm = b*gg*nu*s*s*s2
            f = ec*ec - es*es
            es = 2*ec*es
            ec = f
            f = 1/sqrt(am*am + bm*bm)
            am = am*f
            bm = bm*f
            f = ec*am - es*bm
            es = ec*bm + es*am
            ec = f
            f = 1/sqrt(ec*ec + es*es)
            ec = ec*f
            es = es*f
            s = s2
            cc = c2
            dd = d2
        end do
        if (mod(jj, 2) /= 0) then
            s = -s
            cc = -cc
        end if
        if (cn_is_c) then
            d0 = cc*cc + b*c*x1*s*s
        else
            d0 = cc*cc + a*b*x3*s*s
        end if
        if (cn_is_c) then
            c2 = cc; d2 = dd
        else
            c2 = dd; d2 = cc
        end if
        n1 = (m1*d2 - sg*a*m2*m3*s*c2)/d0
        n2 = (m2*c2*d2 + sg*b*m3*m1*s)/d0
        n3 = (m3*c2 - sg*c*m1*m2*s*d2)/d0
        if (cn_is_c) then
            den = c2*c2 + b*c*n1*n1*s*s
        else
            den = d2*d2 + a*b*n3*n3*s*s
        end if
        if (mode > 0) then
            wn = 1/sqrt(den*(1 + nu*s*s))
            if (ss > 0) then
                z0 = d2*wn
                z2 = -c*s*d2*n2*wn
                z3 = -b*s*n3*wn
            else
                z0 = c2*wn
                z2 = a*s*c2*n2*wn
                z3 = b*s*n1*wn
            end if
            x = gg*(av*t - b*nu*x)
            sx = sin(x); cx = cos(x)
            e0 = cx*ec + sx*es
            e1 = sx*ec - cx*es
            if (gg > 0) e1 = ss*e1/gg
            call compose(q, e0 - 1, e1*m, z0 - 1, z2, z3, j, ax)
        end if
        m(i) = m1 - sg*2*a*n2*n3*s*c2/den
        m(j) = m2 + sg*2*b*n3*n1*s/den
        m(k) = m3 - sg*2*c*n1*n2*s*d2/den
    end subroutine general_step

end module frb_flow_core
