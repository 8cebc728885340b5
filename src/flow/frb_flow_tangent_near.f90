!> Steps of a block of bodies that the series reach, one body per SIMD lane: see tangent_step_turn.inc. The
!> loops are short, so that a processor has several vectors in work. The shortest steps take rho and its
!> gradient from the polynomial of frb_flow_lanes, in a seventh less time.
module frb_flow_tangent_near
    use frb_flow_limits, only: plain_smallest
    use frb_flow_tangent_lanes, only: lanes, tiny, short, lane_body, lane_orbits, of_m, of_q, of_phi
    use frb_kinds, only: wp
    implicit none
    private

    public :: step_near

    !> Numbers that one loop computes and another one uses.
    type :: series_lanes
        real(wp), dimension(lanes) :: dd, aa, bb, third             !! D, A, B, H
        real(wp), dimension(lanes) :: nu, side                      !! of the form; 1: first, -1: mirror form
        real(wp), dimension(lanes) :: x1, x3, over_cc, over_dd, over_d0     !! middle_factors, middle_inverses
        real(wp), dimension(lanes) :: y, scd, l1, l2, l3                    !! middle_momentum
        real(wp), dimension(lanes) :: l11, l12, l13, l21, l22, l23, l31, l32, l33
        real(wp), dimension(lanes) :: psi, cotangent, slope         !! turn_rate
        real(wp), dimension(lanes) :: kappa, r1, r2, r3             !! kappa_1, grad rho
        real(wp), dimension(lanes) :: y1, y2, y3, yy, twice, e1, e2, e3     !! turn_of_middle; m'
        real(wp), dimension(lanes) :: w0                                    !! 1/sqrt(1 + |Y|^2) - 1
    end type series_lanes

contains

    !> Advances the lanes of a block, of which all that are served have steps of one kind, `far` excluded.
    pure subroutine step_near(kind, body, of, m, q, phi)
        integer, intent(in) :: kind
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
        if (kind /= tiny) call choose_forms(body, of, it)
        if (kind == tiny) then
            call find_tiny_series(body, of, it)
        else
            if (kind == short) then
                call find_short_series(of, it)
            else
                call find_middle_series(of, it)
            end if
            call find_factors(body, of, it)
        end if
        call find_middles(body, of, it)
        if (kind == tiny) then
            call find_tiny_rates(body, of, it)
        else
            call find_angles(body, of, it)
            call find_rates(body, of, it)
        end if
        associate (o => body%order)
            call find_momenta(body, of, it, m(o(1)), m(o(2)), m(o(3)))
            call find_norms(kind, it)
            call set_attitudes(it, of%q(:, 1), of%q(:, 1 + o(1)), of%q(:, 1 + o(2)), of%q(:, 1 + o(3)), &
                               q(1), q(1 + o(1)), q(1 + o(2)), q(1 + o(3)))
            call set_turns(body, it, phi(j(1, 1)), phi(j(2, 1)), phi(j(3, 1)), phi(j(1, 2)), phi(j(2, 2)), &
                           phi(j(3, 2)), phi(j(1, 3)), phi(j(2, 3)), phi(j(3, 3)), &
                           phi(w(1, 1)), phi(w(2, 1)), phi(w(3, 1)), phi(w(1, 2)), phi(w(2, 2)), &
                           phi(w(3, 2)), phi(w(1, 3)), phi(w(2, 3)), phi(w(3, 3)), &
                           phi(e(1, 1)), phi(e(2, 1)), phi(e(3, 1)), phi(e(1, 2)), phi(e(2, 2)), &
                           phi(e(3, 2)), phi(e(1, 3)), phi(e(2, 3)), phi(e(3, 3)))
        end associate
    end subroutine step_near

    !> Of the two mirror forms the one with the smaller nu.
    pure subroutine choose_forms(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: x2, nu, mirror
        integer :: l

        do l = 1, lanes
            x2 = of%m2(l)*of%m2(l)
            nu = body%g*(body%g*x2 + body%b*(of%m3(l)*of%m3(l)))
            mirror = body%a*(body%a*x2 + body%b*(of%m1(l)*of%m1(l)))
            it%side(l) = merge(1.0_wp, -1.0_wp, nu <= mirror)
            it%nu(l) = min(nu, mirror)
        end do
    end subroutine choose_forms

    !> The integrals.
    pure subroutine find_short_series(of, it)
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: p, r
        integer :: l

        do l = 1, lanes
            p = of%p(l)
            r = of%r(l)
            call short_integrals(p + r, p*r, p, r, it%dd(l), it%aa(l), it%bb(l))
            it%third(l) = short_third_kind(p + r, p*r, it%nu(l))
        end do
    end subroutine find_short_series

    !> The same by more terms.
    pure subroutine find_middle_series(of, it)
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: p, r, y, scd, s3, dd, aa, bb
        integer :: l

        do l = 1, lanes
            p = of%p(l)
            r = of%r(l)
            call middle_series(p + r, p*r, it%y(l), scd)
        end do
        do l = 1, lanes
            y = it%y(l)
            p = of%p(l)*y
            r = of%r(l)*y
            s3 = y*sqrt(y)
            call middle_integrals(p, r, dd, aa, bb)
            it%dd(l) = s3*dd
            it%aa(l) = s3*aa
            it%bb(l) = s3*bb
            it%third(l) = s3*middle_third_kind(p, r, it%nu(l)*y)
        end do
    end subroutine find_middle_series

    !> The factors of L from the integrals.
    pure subroutine find_factors(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: p, r, m2
        integer :: l

        do l = 1, lanes
            p = of%p(l)
            r = of%r(l)
            m2 = of%m2(l)
            call middle_factors(p, r, it%dd(l), it%aa(l), it%bb(l), it%x1(l), it%x3(l))
            call middle_inverses(p, r, ((body%a*body%g)*m2)*m2, 1 + middle_square(it%x1(l), it%x3(l)), &
                                 it%over_cc(l), it%over_dd(l), it%over_d0(l))
        end do
    end subroutine find_factors

    !> Integrals and factors by the first terms of their series.
    pure subroutine find_tiny_series(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: p, r, m2, dd
        integer :: l

        do l = 1, lanes
            p = of%p(l)
            r = of%r(l)
            m2 = of%m2(l)
            call tiny_integrals(p + r, p*r, p, r, dd, it%aa(l), it%bb(l))
            call middle_factors(p, r, dd, it%aa(l), it%bb(l), it%x1(l), it%x3(l))
            call tiny_inverses(p, r, ((body%a*body%g)*m2)*m2, 1 + middle_square(it%x1(l), it%x3(l)), &
                               it%over_cc(l), it%over_dd(l), it%over_d0(l))
        end do
    end subroutine find_tiny_series

    !> L and its derivative.
    pure subroutine find_middles(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: m1, m2, m3, p, r, aa, bb, y, over_d0, x1, x2, x3, z, l1, l2, l3
        integer :: l

        do l = 1, lanes
            m1 = of%m1(l)
            m2 = of%m2(l)
            m3 = of%m3(l)
            p = of%p(l)
            r = of%r(l)
            aa = it%aa(l)
            bb = it%bb(l)
            x1 = it%x1(l)
            x3 = it%x3(l)
            over_d0 = it%over_d0(l)
            call middle_momentum(body%a, body%b, body%g, m1, m2, m3, p, over_d0, x1, x2, x3, z, y, &
                                 it%scd(l), l1, l2, l3)
            call middle_by_momentum(body%a, body%b, body%g, m1, m2, m3, p, r, y, aa, bb, it%over_cc(l), &
                                    it%over_dd(l), over_d0, x1, x2, x3, z, l1, l2, l3, &
                                    it%l11(l), it%l12(l), it%l13(l), it%l21(l), it%l22(l), it%l23(l), &
                                    it%l31(l), it%l32(l), it%l33(l))
            it%y(l) = y
            it%l1(l) = l1
            it%l2(l) = l2
            it%l3(l) = l3
        end do
    end subroutine find_middles

    !> The turn Y, and momenta at the end.
    pure subroutine find_momenta(body, of, it, n1, n2, n3)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp), intent(inout), dimension(of_m) :: n1, n2, n3
        real(wp) :: d1, d2, d3
        integer :: l

        do l = 1, lanes
            call turn_of_middle(body%a, body%b, body%g, it%l1(l), it%l2(l), it%l3(l), it%kappa(l), it%y(l), &
                                it%scd(l), it%y1(l), it%y2(l), it%y3(l), it%yy(l), it%twice(l), d1, d2, d3)
            d1 = of%m1(l) + d1
            d2 = of%m2(l) + d2
            d3 = of%m3(l) + d3
            it%e1(l) = d1
            it%e2(l) = d2
            it%e3(l) = d3
            n1(3*l - 2) = d1
            n2(3*l - 2) = d2
            n3(3*l - 2) = d3
        end do
    end subroutine find_momenta

    !> kappa_1 and grad rho by the polynomial of frb_flow_lanes.
    pure subroutine find_tiny_rates(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: m1, m2, m3, x1, x2, x3, a2, u, e, f0, f1, f2, f3, by_u, by_e
        integer :: l

        a2 = body%first - body%g
        associate (c => body%rho, rate => body%rate)
            do l = 1, lanes
                m1 = of%m1(l)
                m2 = of%m2(l)
                m3 = of%m3(l)
                x1 = m1*m1
                x2 = m2*m2
                x3 = m3*m3
                u = rate*(rate*(x1 + (x2 + x3)))
                e = rate*(body%first*x1 + (a2*x2 + body%last*x3))
                f0 = c(1) + u*(c(2) + u*(c(3) + u*c(4)))
                f1 = c(5) + u*(c(6) + u*(c(7) + u*c(8)))
                f2 = c(9) + u*(c(10) + u*c(11))
                f3 = c(12) + u*c(13)
                by_u = (c(1) + u*(2*c(2) + u*(3*c(3) + u*(4*c(4))))) &
                       + e*((c(6) + u*(2*c(7) + u*(3*c(8)))) + e*((c(10) + u*(2*c(11))) + e*c(13)))
                by_e = f1 + e*(2*f2 + e*(3*f3 + e*(4*c(14))))
                it%kappa(l) = body%first + rate*(u*f0 + e*(f1 + e*(f2 + e*(f3 + e*c(14)))))
                by_u = ((2*rate)*rate)*(rate*by_u)
                by_e = ((2*rate)*rate)*by_e
                it%r1(l) = (by_u + body%first*by_e)*m1
                it%r2(l) = (by_u + a2*by_e)*m2
                it%r3(l) = (by_u + body%last*by_e)*m3
            end do
        end associate
    end subroutine find_tiny_rates

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

    !> The norms of the turns (1, Y), less 1, inverse.
    pure subroutine find_norms(kind, it)
        integer, intent(in) :: kind
        type(series_lanes), intent(inout) :: it
        real(wp) :: yy
        integer :: l

        if (kind == tiny) then
            do l = 1, lanes
                it%w0(l) = tiny_norm(it%yy(l))
            end do
        else
            do l = 1, lanes
                yy = it%yy(l)
                it%w0(l) = -yy/(sqrt(1 + yy) + (1 + yy))
            end do
        end if
    end subroutine find_norms

    !> Attitudes at the end.
    pure subroutine set_attitudes(it, b0, b1, b2, b3, a0, a1, a2, a3)
        type(series_lanes), intent(in) :: it
        real(wp), intent(in), dimension(lanes) :: b0, b1, b2, b3        !! at the start
        real(wp), intent(inout), dimension(of_q) :: a0, a1, a2, a3
        real(wp) :: y1, y2, y3, w0, q0, q1, q2, q3
        integer :: l

        do l = 1, lanes
            y1 = it%y1(l)
            y2 = it%y2(l)
            y3 = it%y3(l)
            w0 = it%w0(l)
            q0 = b0(l)
            q1 = b1(l)
            q2 = b2(l)
            q3 = b3(l)
            call turn(w0, y1 + w0*y1, y2 + w0*y2, y3 + w0*y3, q0, q1, q2, q3)
            include 'put_attitude.inc'
        end do
    end subroutine set_attitudes

    !> W, E, and J = E + m' x W.
    pure subroutine set_turns(body, it, j11, j21, j31, j12, j22, j32, j13, j23, j33, &
                              w11, w21, w31, w12, w22, w32, w13, w23, w33, &
                              e11, e21, e31, e12, e22, e32, e13, e23, e33)
        type(lane_body), intent(in) :: body
        type(series_lanes), intent(in) :: it
        real(wp), intent(inout), dimension(of_phi) :: j11, j21, j31, j12, j22, j32, j13, j23, j33
        real(wp), intent(inout), dimension(of_phi) :: w11, w21, w31, w12, w22, w32, w13, w23, w33
        real(wp), intent(inout), dimension(of_phi) :: e11, e21, e31, e12, e22, e32, e13, e23, e33
        real(wp) :: twice, m1, m2, m3, x11, x21, x31, x12, x22, x32, x13, x23, x33
        real(wp) :: z11, z21, z31, z12, z22, z32, z13, z23, z33
        integer :: l

        do l = 1, lanes
            m1 = it%e1(l)
            m2 = it%e2(l)
            m3 = it%e3(l)
            twice = it%twice(l)
            call turn_at_end(twice, it%y1(l), it%y2(l), it%y3(l), &
                             z11, z12, z13, z21, z22, z23, z31, z32, z33)
            call turn_by_momentum(twice*it%kappa(l), twice*(it%kappa(l) - body%g), &
                                  twice*(it%kappa(l) - body%b), it%y1(l), it%y2(l), it%y3(l), &
                                  it%l1(l), it%l2(l), it%l3(l), twice*it%r1(l), twice*it%r2(l), &
                                  twice*it%r3(l), it%l11(l), it%l12(l), it%l13(l), it%l21(l), it%l22(l), &
                                  it%l23(l), it%l31(l), it%l32(l), it%l33(l), &
                                  x11, x12, x13, x21, x22, x23, x31, x32, x33)
            e11(36*l - 35) = z11
            e21(36*l - 35) = z21
            e31(36*l - 35) = z31
            e12(36*l - 35) = z12
            e22(36*l - 35) = z22
            e32(36*l - 35) = z32
            e13(36*l - 35) = z13
            e23(36*l - 35) = z23
            e33(36*l - 35) = z33
            w11(36*l - 35) = x11
            w21(36*l - 35) = x21
            w31(36*l - 35) = x31
            w12(36*l - 35) = x12
            w22(36*l - 35) = x22
            w32(36*l - 35) = x32
            w13(36*l - 35) = x13
            w23(36*l - 35) = x23
            w33(36*l - 35) = x33
            j11(36*l - 35) = z11 + (m2*x31 - m3*x21)
            j21(36*l - 35) = z21 + (m3*x11 - m1*x31)
            j31(36*l - 35) = z31 + (m1*x21 - m2*x11)
            j12(36*l - 35) = z12 + (m2*x32 - m3*x22)
            j22(36*l - 35) = z22 + (m3*x12 - m1*x32)
            j32(36*l - 35) = z32 + (m1*x22 - m2*x12)
            j13(36*l - 35) = z13 + (m2*x33 - m3*x23)
            j23(36*l - 35) = z23 + (m3*x13 - m1*x33)
            j33(36*l - 35) = z33 + (m1*x23 - m2*x13)
        end do
    end subroutine set_turns

    include 'short_coefficients.inc'

    include 'short_third_kind.inc'

    include 'middle_formulas.inc'

    include 'middle_polynomials.inc'

    include 'middle_third_kind.inc'

    include 'tangent_tiny_integrals.inc'

    include 'tangent_short_integrals.inc'

    include 'tangent_middle_formulas.inc'

    include 'tangent_step_turn.inc'

    include 'norm_formulas.inc'

    include 'turn_formulas.inc'

end module frb_flow_tangent_near
