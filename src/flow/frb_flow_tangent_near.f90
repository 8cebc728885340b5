!> Steps of a block of bodies that the series reach, one body per SIMD lane: see tangent_step_turn.inc. The
!> loops are short, so that a processor has several vectors in work.
!>
!> A processor stores one number a cycle, and computes meanwhile. So the zeros of a transition (zero14: row 1,
!> column 4) are stored by loops that compute much and store little; J, W and E column by column, between the
!> computations; and the states last. In all, the shortest steps take a tenth less time (AVX2).
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
        real(wp), dimension(lanes) :: over_cc, over_dd, over_d0             !! middle_inverses
        real(wp), dimension(lanes) :: x1, x2, x3, z, y, scd, l1, l2, l3     !! middle_factors, middle_momentum
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
        if (kind /= tiny) then
            call choose_forms(body, of, it)
            if (kind == short) then
                call find_short_series(of, it)
            else
                call find_middle_series(of, it)
            end if
            call find_angles(body, of, it)
            call find_factors(body, of, it, phi(26), phi(27))
        else
            call find_tiny_rates(body, of, it, phi(19), phi(20), phi(21), phi(25))
            call find_tiny_series(body, of, it, phi(26), phi(27))
        end if
        call find_middles(body, of, it, phi(31), phi(32))
        if (kind /= tiny) then
            call find_rates(body, of, it, phi(19), phi(20), phi(21), phi(25))
        end if
        call find_momenta(body, of, it, phi(33))
        call find_norms(kind, it)
        call set_turns(body, of, it, phi(j(1, 1)), phi(j(2, 1)), phi(j(3, 1)), phi(j(1, 2)), phi(j(2, 2)), &
                       phi(j(3, 2)), phi(j(1, 3)), phi(j(2, 3)), phi(j(3, 3)), &
                       phi(w(1, 1)), phi(w(2, 1)), phi(w(3, 1)), phi(w(1, 2)), phi(w(2, 2)), &
                       phi(w(3, 2)), phi(w(1, 3)), phi(w(2, 3)), phi(w(3, 3)), &
                       phi(e(1, 1)), phi(e(2, 1)), phi(e(3, 1)), phi(e(1, 2)), phi(e(2, 2)), &
                       phi(e(3, 2)), phi(e(1, 3)), phi(e(2, 3)), phi(e(3, 3)))
        associate (o => body%order)
            call set_states(it, of%q(:, 1), of%q(:, 1 + o(1)), of%q(:, 1 + o(2)), of%q(:, 1 + o(3)), &
                            m(o(1)), m(o(2)), m(o(3)), q(1), q(1 + o(1)), q(1 + o(2)), q(1 + o(3)))
        end associate
    end subroutine step_near

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
    pure subroutine find_factors(body, of, it, zero25, zero35)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp), intent(inout), dimension(of_phi) :: zero25, zero35
        real(wp) :: p, r, m2
        integer :: l

        do l = 1, lanes
            p = of%p(l)
            r = of%r(l)
            m2 = of%m2(l)
            call middle_factors(p, r, it%dd(l), it%aa(l), it%bb(l), it%x1(l), it%x3(l))
            call middle_inverses(p, r, ((body%a*body%g)*m2)*m2, 1 + middle_square(it%x1(l), it%x3(l)), &
                                 it%over_cc(l), it%over_dd(l), it%over_d0(l))
            zero25(36*l - 35) = 0.0_wp
            zero35(36*l - 35) = 0.0_wp
        end do
    end subroutine find_factors

    !> Integrals and factors by the first terms of their series.
    pure subroutine find_tiny_series(body, of, it, zero25, zero35)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp), intent(inout), dimension(of_phi) :: zero25, zero35
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
            zero25(36*l - 35) = 0.0_wp
            zero35(36*l - 35) = 0.0_wp
        end do
    end subroutine find_tiny_series

    !> L.
    pure subroutine find_middles(body, of, it, zero16, zero26)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp), intent(inout), dimension(of_phi) :: zero16, zero26
        real(wp) :: x1, x3
        integer :: l

        do l = 1, lanes
            x1 = it%x1(l)
            x3 = it%x3(l)
            call middle_momentum(body%a, body%b, body%g, of%m1(l), of%m2(l), of%m3(l), of%p(l), &
                                 it%over_d0(l), x1, it%x2(l), x3, it%z(l), it%y(l), it%scd(l), &
                                 it%l1(l), it%l2(l), it%l3(l))
            it%x1(l) = x1
            it%x3(l) = x3
            zero16(36*l - 35) = 0.0_wp
            zero26(36*l - 35) = 0.0_wp
        end do
    end subroutine find_middles

    !> The turn Y, and the momenta at the end.
    pure subroutine find_momenta(body, of, it, zero36)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp), intent(inout), dimension(of_phi) :: zero36
        real(wp) :: d1, d2, d3
        integer :: l

        do l = 1, lanes
            call turn_of_middle(body%a, body%b, body%g, it%l1(l), it%l2(l), it%l3(l), it%kappa(l), it%y(l), &
                                it%scd(l), it%y1(l), it%y2(l), it%y3(l), it%yy(l), it%twice(l), d1, d2, d3)
            it%e1(l) = of%m1(l) + d1
            it%e2(l) = of%m2(l) + d2
            it%e3(l) = of%m3(l) + d3
            zero36(36*l - 35) = 0.0_wp
        end do
    end subroutine find_momenta

    !> The inverse norms of the turns (1, Y), less 1. A series in place of a root and a division saves 2 % of
    !> the time of short steps.
    pure subroutine find_norms(kind, it)
        integer, intent(in) :: kind
        type(series_lanes), intent(inout) :: it
        real(wp) :: yy
        integer :: l

        if (kind == tiny) then
            do l = 1, lanes
                it%w0(l) = tiny_norm(it%yy(l))
            end do
        else if (kind == short) then
            do l = 1, lanes
                it%w0(l) = small_norm(it%yy(l))
            end do
        else
            do l = 1, lanes
                yy = it%yy(l)
                it%w0(l) = -yy/(sqrt(1 + yy) + (1 + yy))
            end do
        end if
    end subroutine find_norms

    !> 1/sqrt(1 + square) - 1 for square <= tan(x)^2, x^2 = small_turn_limit: the next term is below 1e-17 of
    !> the first.
    pure function small_norm(square) result(change)
        real(wp), intent(in) :: square
        real(wp) :: change
        real(wp) :: x2, x4

        x2 = square*square
        x4 = x2*x2
        change = x2*((((3/8.0_wp - square*(5/16.0_wp)) + x2*(35/128.0_wp - square*(63/256.0_wp))) &
                      + x4*((231/1024.0_wp - square*(429/2048.0_wp)) &
                            + x2*(6435/32768.0_wp - square*(12155/65536.0_wp)))) &
                     + (x4*x4)*((46189/262144.0_wp - square*(88179/524288.0_wp)) &
                                + x2*(676039/4194304.0_wp))) - 0.5_wp*square
    end function small_norm

    !> The derivative of L; W, E, and J = E + m'^ W.
    pure subroutine set_turns(body, of, it, j11, j21, j31, j12, j22, j32, j13, j23, j33, &
                              w11, w21, w31, w12, w22, w32, w13, w23, w33, &
                              e11, e21, e31, e12, e22, e32, e13, e23, e33)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(in) :: it
        real(wp), intent(inout), dimension(of_phi) :: j11, j21, j31, j12, j22, j32, j13, j23, j33
        real(wp), intent(inout), dimension(of_phi) :: w11, w21, w31, w12, w22, w32, w13, w23, w33
        real(wp), intent(inout), dimension(of_phi) :: e11, e21, e31, e12, e22, e32, e13, e23, e33
        real(wp) :: twice, k1, k2, k3, m1, m2, m3, y1, y2, y3, l1, l2, l3, x1, x2, x3
        real(wp) :: l11, l21, l31, l12, l22, l32, l13, l23, l33, z11, z21, z31, z12, z22, z32, z13, z23, z33
        integer :: l

        do l = 1, lanes
            l1 = it%l1(l)
            l2 = it%l2(l)
            l3 = it%l3(l)
            call middle_by_momentum(body%a, body%b, body%g, of%m1(l), of%m2(l), of%m3(l), of%p(l), of%r(l), &
                                    it%y(l), it%aa(l), it%bb(l), it%over_cc(l), it%over_dd(l), &
                                    it%over_d0(l), it%x1(l), it%x2(l), it%x3(l), it%z(l), l1, l2, l3, &
                                    l11, l12, l13, l21, l22, l23, l31, l32, l33)
            m1 = it%e1(l)
            m2 = it%e2(l)
            m3 = it%e3(l)
            y1 = it%y1(l)
            y2 = it%y2(l)
            y3 = it%y3(l)
            twice = it%twice(l)
            call turn_at_end(twice, y1, y2, y3, z11, z12, z13, z21, z22, z23, z31, z32, z33)
            k1 = twice*it%kappa(l)
            k2 = twice*(it%kappa(l) - body%g)
            k3 = twice*(it%kappa(l) - body%b)
            e11(36*l - 35) = z11
            e21(36*l - 35) = z21
            e31(36*l - 35) = z31
            call turn_by_momentum(k1, k2, k3, y1, y2, y3, l1, l2, l3, twice*it%r1(l), l11, l21, l31, &
                                  x1, x2, x3)
            w11(36*l - 35) = x1
            w21(36*l - 35) = x2
            w31(36*l - 35) = x3
            call momentum_by_turn(m1, m2, m3, x1, x2, x3, z11, z21, z31)
            j11(36*l - 35) = z11
            j21(36*l - 35) = z21
            j31(36*l - 35) = z31
            e12(36*l - 35) = z12
            e22(36*l - 35) = z22
            e32(36*l - 35) = z32
            call turn_by_momentum(k1, k2, k3, y1, y2, y3, l1, l2, l3, twice*it%r2(l), l12, l22, l32, &
                                  x1, x2, x3)
            w12(36*l - 35) = x1
            w22(36*l - 35) = x2
            w32(36*l - 35) = x3
            call momentum_by_turn(m1, m2, m3, x1, x2, x3, z12, z22, z32)
            j12(36*l - 35) = z12
            j22(36*l - 35) = z22
            j32(36*l - 35) = z32
            e13(36*l - 35) = z13
            e23(36*l - 35) = z23
            e33(36*l - 35) = z33
            call turn_by_momentum(k1, k2, k3, y1, y2, y3, l1, l2, l3, twice*it%r3(l), l13, l23, l33, &
                                  x1, x2, x3)
            w13(36*l - 35) = x1
            w23(36*l - 35) = x2
            w33(36*l - 35) = x3
            call momentum_by_turn(m1, m2, m3, x1, x2, x3, z13, z23, z33)
            j13(36*l - 35) = z13
            j23(36*l - 35) = z23
            j33(36*l - 35) = z33
        end do
    end subroutine set_turns

    !> The states at the end.
    pure subroutine set_states(it, b0, b1, b2, b3, n1, n2, n3, a0, a1, a2, a3)
        type(series_lanes), intent(in) :: it
        real(wp), intent(in), dimension(lanes) :: b0, b1, b2, b3        !! attitudes at the start
        real(wp), intent(inout), dimension(of_m) :: n1, n2, n3
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
            n1(3*l - 2) = it%e1(l)
            n2(3*l - 2) = it%e2(l)
            n3(3*l - 2) = it%e3(l)
        end do
    end subroutine set_states

    include 'lane_rates.inc'

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
