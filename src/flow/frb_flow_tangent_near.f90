!> Short steps of a block of bodies, one body per SIMD lane: see tangent_step_momentum.inc and
!> tangent_step_turn.inc. The loops are short, so that a processor has several vectors in work.
module frb_flow_tangent_near
    use frb_flow_limits, only: plain_smallest
    use frb_flow_tangent_lanes, only: lanes, lane_body, lane_orbits, of_m, of_q, of_phi
    use frb_kinds, only: wp
    implicit none
    private

    public :: step_near

    !> Numbers that one loop computes and another one uses.
    type :: series_lanes
        real(wp), dimension(lanes) :: y, scd, dd, aa, bb, third     !! s^2, s c d; D, A, B, H
        real(wp), dimension(lanes) :: nu, side                      !! of the form; 1: first, -1: mirror form
        real(wp), dimension(lanes) :: inverse, over_c, over_d, over_cc, over_dd, f0, lp, lr    !! divide_once
        real(wp), dimension(lanes) :: e1, e2, e3, x1, x2, x3, s1, s2, s3    !! m'; momentum_at_end
        real(wp), dimension(lanes) :: j11, j12, j13, j21, j22, j23, j31, j32, j33   !! J - 1
        real(wp), dimension(lanes) :: psi, cotangent, slope         !! turn_rate
        real(wp), dimension(lanes) :: kappa, r1, r2, r3     !! kappa_1, grad rho (times 4 F/(1 + |Y|^2))
        real(wp), dimension(lanes) :: y1, y2, y3, twice, k1, k2, k3, h1, h2, h3     !! turn_factors
    end type series_lanes

contains

    !> Advances the lanes of a block, of which all that are served have short steps.
    pure subroutine step_near(body, of, m, q, phi)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        real(wp), intent(inout) :: m(3*lanes), q(4*lanes), phi(36*lanes)
        type(series_lanes) :: it
        integer :: j(3, 3), w(3, 3), e(3, 3), k

        do k = 1, 3
            j(:, k) = body%order + 6*(body%order(k) - 1)
        end do
        w = j + 3
        e = j + 21
        call find_series(body, of, it)
        call find_inverses(body, of, it)
        call find_angles(body, of, it)
        associate (o => body%order)
            call find_momenta(body, of, it, m(o(1)), m(o(2)), m(o(3)))
            call find_jacobians(body, of, it, &
                                phi(j(1, 1)), phi(j(2, 1)), phi(j(3, 1)), phi(j(1, 2)), phi(j(2, 2)), &
                                phi(j(3, 2)), phi(j(1, 3)), phi(j(2, 3)), phi(j(3, 3)))
            call find_rates(body, of, it)
            call find_turns(body, of, it)
            call set_attitudes(it, q(1), q(1 + o(1)), q(1 + o(2)), q(1 + o(3)), &
                               phi(e(1, 1)), phi(e(2, 1)), phi(e(3, 1)), phi(e(1, 2)), phi(e(2, 2)), &
                               phi(e(3, 2)), phi(e(1, 3)), phi(e(2, 3)), phi(e(3, 3)))
            call set_turns(it, phi(w(1, 1)), phi(w(2, 1)), phi(w(3, 1)), phi(w(1, 2)), phi(w(2, 2)), &
                           phi(w(3, 2)), phi(w(1, 3)), phi(w(2, 3)), phi(w(3, 3)))
        end associate
    end subroutine step_near

    !> The triple and the integrals; of the two forms the one with the smaller nu.
    pure subroutine find_series(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: p, r, x2, nu, mirror
        integer :: l

        do l = 1, lanes
            p = of%p(l)
            r = of%r(l)
            call short_series(p + r, p*r, it%y(l), it%scd(l))
            call short_integrals(p + r, p*r, p, r, it%dd(l), it%aa(l), it%bb(l))
            x2 = of%m2(l)*of%m2(l)
            nu = body%g*(body%g*x2 + body%b*(of%m3(l)*of%m3(l)))
            mirror = body%a*(body%a*x2 + body%b*(of%m1(l)*of%m1(l)))
            it%side(l) = merge(1.0_wp, -1.0_wp, nu <= mirror)
            nu = min(nu, mirror)
            it%nu(l) = nu
            it%third(l) = short_third_kind(p + r, p*r, nu)
        end do
    end subroutine find_series

    !> All inverses of the momentum and its derivative.
    pure subroutine find_inverses(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        integer :: l

        do l = 1, lanes
            call divide_once(body%a*body%g, of%m2(l), of%p(l), of%r(l), it%y(l), it%scd(l), it%aa(l), &
                             it%bb(l), it%inverse(l), it%over_c(l), it%over_d(l), it%over_cc(l), &
                             it%over_dd(l), it%f0(l), it%lp(l), it%lr(l))
        end do
    end subroutine find_inverses

    !> Momenta at the end.
    pure subroutine find_momenta(body, of, it, n1, n2, n3)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp), intent(inout), dimension(of_m) :: n1, n2, n3
        real(wp) :: m1, m2, m3, d1, d2, d3
        integer :: l

        do l = 1, lanes
            m1 = of%m1(l)
            m2 = of%m2(l)
            m3 = of%m3(l)
            call momentum_at_end(body%a, body%b, body%g, m1, m2, m3, of%p(l), of%r(l), it%y(l), it%scd(l), &
                                 it%inverse(l), d1, d2, d3, it%x1(l), it%x2(l), it%x3(l), &
                                 it%s1(l), it%s2(l), it%s3(l))
            m1 = m1 + d1
            m2 = m2 + d2
            m3 = m3 + d3
            it%e1(l) = m1
            it%e2(l) = m2
            it%e3(l) = m3
            n1(3*l - 2) = m1
            n2(3*l - 2) = m2
            n3(3*l - 2) = m3
        end do
    end subroutine find_momenta

    !> J.
    pure subroutine find_jacobians(body, of, it, t11, t21, t31, t12, t22, t32, t13, t23, t33)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp), intent(inout), dimension(of_phi) :: t11, t21, t31, t12, t22, t32, t13, t23, t33
        real(wp) :: j11, j12, j13, j21, j22, j23, j31, j32, j33
        integer :: l

        do l = 1, lanes
            call jacobian_at_end(body%a, body%b, body%g, of%m1(l), of%m2(l), of%m3(l), it%e1(l), it%e2(l), &
                                 it%e3(l), it%x1(l), it%x2(l), it%x3(l), it%s1(l), it%s2(l), it%s3(l), &
                                 it%y(l), it%scd(l), it%aa(l), it%bb(l), it%inverse(l), it%over_c(l), &
                                 it%over_d(l), it%over_cc(l), it%over_dd(l), &
                                 j11, j12, j13, j21, j22, j23, j31, j32, j33)
            it%j11(l) = j11
            it%j12(l) = j12
            it%j13(l) = j13
            it%j21(l) = j21
            it%j22(l) = j22
            it%j23(l) = j23
            it%j31(l) = j31
            it%j32(l) = j32
            it%j33(l) = j33
            t11(36*l - 35) = 1 + j11
            t21(36*l - 35) = j21
            t31(36*l - 35) = j31
            t12(36*l - 35) = j12
            t22(36*l - 35) = 1 + j22
            t32(36*l - 35) = j32
            t13(36*l - 35) = j13
            t23(36*l - 35) = j23
            t33(36*l - 35) = 1 + j33
        end do
    end subroutine find_jacobians

    !> x cot x of the angle.
    pure subroutine find_angles(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: first, last, psi, gg
        integer :: l

        first = body%first
        last = -body%last
        do l = 1, lanes
            gg = of%m1(l)*of%m1(l) + (of%m2(l)*of%m2(l) + of%m3(l)*of%m3(l))
            psi = merge(first, last, it%side(l) > 0.0_wp) - body%b*(it%nu(l)*it%third(l))
            it%psi(l) = psi
            call small_cotangent((gg*psi)*psi, it%cotangent(l), it%slope(l))
        end do
    end subroutine find_angles

    !> kappa_1 and grad rho.
    pure subroutine find_rates(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: alpha, b, gamma, m1, m2, m3, a, g, gg, m31, pp, rr, aa, bb, over_cc, over_dd
        real(wp) :: kappa, by_gg, by_rt, rt
        integer :: l
        logical :: one

        alpha = body%a
        b = body%b
        gamma = body%g
        do l = 1, lanes
            one = it%side(l) > 0.0_wp
            m1 = of%m1(l)
            m2 = of%m2(l)
            m3 = of%m3(l)
            gg = max(m1*m1 + (m2*m2 + m3*m3), plain_smallest**2)
            a = merge(alpha, gamma, one)
            g = merge(gamma, alpha, one)
            m31 = merge(m3, m1, one)
            pp = merge(of%p(l), of%r(l), one)
            rr = merge(of%r(l), of%p(l), one)
            aa = merge(it%aa(l), it%bb(l), one)
            bb = merge(it%bb(l), it%aa(l), one)
            over_cc = merge(it%over_cc(l), it%over_dd(l), one)
            over_dd = merge(it%over_dd(l), it%over_cc(l), one)
            rt = g*(m2*m2) + b*(m31*m31)
            call turn_rate(a, b, g, gg, rt, pp, rr, it%nu(l), it%y(l), it%scd(l), aa, bb, it%dd(l), &
                           it%third(l), over_cc, over_dd, it%psi(l), it%cotangent(l), it%slope(l), kappa, &
                           by_gg, by_rt)
            it%kappa(l) = merge(kappa, b - kappa, one)
            by_gg = (2*it%side(l))*by_gg
            by_rt = (2*it%side(l))*by_rt
            it%r1(l) = (by_gg + b*merge(0.0_wp, by_rt, one))*m1
            it%r2(l) = (by_gg + g*by_rt)*m2
            it%r3(l) = (by_gg + b*merge(by_rt, 0.0_wp, one))*m3
        end do
    end subroutine find_rates

    !> The turn Y, and the factors of W.
    pure subroutine find_turns(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: f0, f
        integer :: l

        do l = 1, lanes
            f0 = it%f0(l)
            f = f0*(of%m2(l) + it%e2(l))
            f = f0*small_root((body%a*body%g)*(f*f))
            call turn_factors(body%a, body%b, body%g, of%m1(l), of%m2(l), of%m3(l), it%e1(l), it%e2(l), &
                              it%e3(l), it%j21(l), it%j22(l), it%j23(l), it%kappa(l), f, it%lp(l), it%lr(l), &
                              it%y1(l), it%y2(l), it%y3(l), it%twice(l), it%k1(l), it%k2(l), it%k3(l), &
                              it%h1(l), it%h2(l), it%h3(l))
            f = (2*it%twice(l))*f
            it%r1(l) = f*it%r1(l)
            it%r2(l) = f*it%r2(l)
            it%r3(l) = f*it%r3(l)
        end do
    end subroutine find_turns

    !> Attitudes at the end, and E.
    pure subroutine set_attitudes(it, a0, a1, a2, a3, t11, t21, t31, t12, t22, t32, t13, t23, t33)
        type(series_lanes), intent(in) :: it
        real(wp), intent(inout), dimension(of_q) :: a0, a1, a2, a3
        real(wp), intent(inout), dimension(of_phi) :: t11, t21, t31, t12, t22, t32, t13, t23, t33
        real(wp) :: y1, y2, y3, w0, q0, q1, q2, q3
        integer :: l

        do l = 1, lanes
            y1 = it%y1(l)
            y2 = it%y2(l)
            y3 = it%y3(l)
            w0 = small_norm(y1*y1 + (y2*y2 + y3*y3))
            q0 = a0(4*l - 3)
            q1 = a1(4*l - 3)
            q2 = a2(4*l - 3)
            q3 = a3(4*l - 3)
            call turn(w0, y1 + w0*y1, y2 + w0*y2, y3 + w0*y3, q0, q1, q2, q3)
            a0(4*l - 3) = q0
            a1(4*l - 3) = q1
            a2(4*l - 3) = q2
            a3(4*l - 3) = q3
            call turn_at_end(it%twice(l), y1, y2, y3, &
                             t11(36*l - 35), t12(36*l - 35), t13(36*l - 35), t21(36*l - 35), t22(36*l - 35), &
                             t23(36*l - 35), t31(36*l - 35), t32(36*l - 35), t33(36*l - 35))
        end do
    end subroutine set_attitudes

    !> W, the derivative of the attitude by the momentum.
    pure subroutine set_turns(it, t11, t21, t31, t12, t22, t32, t13, t23, t33)
        type(series_lanes), intent(in) :: it
        real(wp), intent(inout), dimension(of_phi) :: t11, t21, t31, t12, t22, t32, t13, t23, t33
        real(wp) :: w11, w12, w13, w21, w22, w23, w31, w32, w33
        integer :: l

        do l = 1, lanes
            call turn_by_momentum(it%k1(l), it%k2(l), it%k3(l), it%y1(l), it%y2(l), it%y3(l), it%e1(l), &
                                  it%e2(l), it%e3(l), it%r1(l), it%r2(l), it%r3(l), &
                                  it%h1(l), it%h2(l), it%h3(l), &
                                  it%j11(l), it%j12(l), it%j13(l), it%j21(l), it%j22(l), it%j23(l), &
                                  it%j31(l), it%j32(l), it%j33(l), &
                                  w11, w12, w13, w21, w22, w23, w31, w32, w33)
            t11(36*l - 35) = w11
            t21(36*l - 35) = w21
            t31(36*l - 35) = w31
            t12(36*l - 35) = w12
            t22(36*l - 35) = w22
            t32(36*l - 35) = w32
            t13(36*l - 35) = w13
            t23(36*l - 35) = w23
            t33(36*l - 35) = w33
        end do
    end subroutine set_turns

    include 'series_formulas.inc'

    include 'short_coefficients.inc'

    include 'short_third_kind.inc'

    include 'tangent_short_integrals.inc'

    include 'tangent_step_momentum.inc'

    include 'tangent_step_turn.inc'

    include 'turn_formulas.inc'

end module frb_flow_tangent_near
