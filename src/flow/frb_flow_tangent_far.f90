!> Longer steps of a block of bodies, one body per SIMD lane: the doublings of frb_flow_tangent_long, as many
!> as each lane needs, for steps too short for whole periods to be removed. A doubling reads one set of arrays
!> and writes another, because compilers make slow code of a store that depends on its lane. A body takes a
!> third of the time that it takes alone (AVX2: 75 to 90 ns instead of 230 to 300).
module frb_flow_tangent_far
    use frb_flow_limits, only: middle_limit, square_limit, sin_cos_limit
    use frb_flow_tangent_ends, only: lane_forms, lane_ends, set_forms, finish_lanes
    use frb_flow_tangent_lanes, only: lanes, lane_body, lane_orbits
    use frb_kinds, only: wp
    implicit none
    private

    public :: step_far

    !> Most doublings: 4^6 square_limit > period_limit, 4^3 middle_limit > square_limit.
    integer, parameter :: most_triples = 6, most_squares = 3

    !> Numbers that one loop computes and another one uses.
    type :: doubling_lanes
        real(wp) :: norm(lanes), delta(lanes), pmax(lanes), pmin(lanes)     !! |m|, |R - P|, larger, smaller
        real(wp) :: cn(lanes)                                       !! 1 or -1: c or d is cn-like
        real(wp) :: squares(lanes), triples(lanes), span(lanes)     !! doublings; square of the first time
        real(wp) :: z(lanes)                                        !! denominator of the triple
        real(wp) :: c(lanes)                                        !! the function of the triple for p
        real(wp) :: n1(lanes), n2(lanes), n3(lanes)                 !! momentum at mid-step
        real(wp) :: cosine(lanes), sine(lanes), along(lanes)        !! of the turn e about m
    end type doubling_lanes

    !> The triple at a part of the time, the integrals D and `own`, cosine and sine of the angle Theta about
    !> m up to a factor: see double_angle.
    type :: lane_triples
        real(wp), dimension(lanes) :: y, s, c, d, dd, own, ec, es       !! y = s^2; c: cn-like, d: dn-like
    end type lane_triples

contains

    !> Advances the lanes of a block.
    pure subroutine step_far(body, orbits, m, q, transition)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: orbits
        real(wp), intent(inout) :: m(3*lanes), q(4*lanes), transition(36*lanes)
        type(lane_forms) :: of
        type(lane_ends) :: ends
        type(doubling_lanes) :: it
        type(lane_triples) :: at(2)     ! a doubling reads one and writes the other
        integer :: i, now               ! number of the present one

        call set_forms(body, orbits, of)
        call count_halvings(body%b, of, it)
        call find_first_parts(body%b, of, it, at(1))
        now = 1
        do i = nint(maxval(it%squares)), 1, -1
            call double_squares(it, at(now), at(3 - now))
            call finish_doubling(i, it%squares, body%b, of%nu, it%norm, it%z, at(now), at(3 - now))
            now = 3 - now
        end do
        do i = nint(maxval(it%triples)), 1, -1
            call double_triples(it, at(now), at(3 - now))
            call finish_doubling(i, it%triples, body%b, of%nu, it%norm, it%z, at(now), at(3 - now))
            now = 3 - now
        end do
        call find_momenta(body%b, of, it, at(now), ends)
        call find_turns(body%b, of, it, at(now), ends)
        call find_columns(body%b, of, it, at(now), ends)
        call finish_lanes(body, orbits, of, ends, m, q, transition)
    end subroutine step_far

    !> The number of doublings of each lane, and the square of the part of the time before them.
    pure subroutine count_halvings(b, of, it)
        real(wp), intent(in) :: b
        type(lane_forms), intent(in) :: of
        type(doubling_lanes), intent(inout) :: it
        real(wp) :: span, triples, squares, pmax, delta
        integer :: l, n

        do l = 1, lanes
            delta = orbit_difference(of%a(l), b, of%g(l), of%m1(l), of%m3(l))
            pmax = max(of%p(l), of%r(l))
            it%pmax(l) = pmax
            it%pmin(l) = min(of%p(l), of%r(l))
            it%delta(l) = abs(delta)
            it%cn(l) = merge(1.0_wp, -1.0_wp, delta <= 0.0_wp)
            span = 1.0_wp
            triples = 0.0_wp
            squares = 0.0_wp
            do n = 1, most_triples
                triples = triples + merge(1.0_wp, 0.0_wp, pmax*span > square_limit)
                span = span*merge(0.25_wp, 1.0_wp, pmax*span > square_limit)
            end do
            do n = 1, most_squares
                squares = squares + merge(1.0_wp, 0.0_wp, pmax*span > middle_limit)
                span = span*merge(0.25_wp, 1.0_wp, pmax*span > middle_limit)
            end do
            it%triples(l) = triples
            it%squares(l) = squares
            it%span(l) = span
        end do
    end subroutine count_halvings

    !> The triple and the integrals at the time that the series reach; cosine and sine of the part of half the
    !> angle about m that grows with the time.
    pure subroutine find_first_parts(b, of, it, at)
        real(wp), intent(in) :: b
        type(lane_forms), intent(in) :: of
        type(doubling_lanes), intent(inout) :: it
        type(lane_triples), intent(inout) :: at
        real(wp) :: span, y, s, s3, dd, own, other, theta
        integer :: l

        do l = 1, lanes
            span = it%span(l)
            call middle_series((of%p(l) + of%r(l))*span, of%p(l)*of%r(l)*(span*span), y, s)
            y = y*span
            s = sqrt(y)
            s3 = y*s
            call middle_integrals(it%pmax(l)*y, it%pmin(l)*y, dd, other, own)
            at%y(l) = y
            at%s(l) = s
            at%dd(l) = s3*dd
            at%own(l) = s3*own
            at%c(l) = sqrt(1 - it%pmax(l)*y)
            at%d(l) = sqrt(1 - it%pmin(l)*y)
        end do
        do l = 1, lanes
            y = at%y(l)
            s = sqrt(of%gg(l))
            it%norm(l) = s
            theta = (b*s)*of%nu(l)*(y*at%s(l)*middle_third_kind(it%pmax(l)*y, it%pmin(l)*y, of%nu(l)*y))
            call base_angle(theta, at%ec(l), at%es(l))
            call sin_cos(max(-sin_cos_limit, min(sin_cos_limit, s*of%rate(l))), it%sine(l), it%cosine(l))
        end do
    end subroutine find_first_parts

    !> The triple at twice the time, by double_square.
    pure subroutine double_squares(it, from, to)
        type(doubling_lanes), intent(inout) :: it
        type(lane_triples), intent(in) :: from
        type(lane_triples), intent(inout) :: to
        real(wp) :: y, c, d, z
        integer :: l

        do l = 1, lanes
            y = from%y(l)
            z = 1.0_wp
            call double_square(it%pmax(l), it%pmin(l), y, c, d, z)
            to%s(l) = sqrt(y)
            to%c(l) = c
            to%d(l) = d
            it%z(l) = z
        end do
    end subroutine double_squares

    !> The triple at twice the time, by double_triple.
    pure subroutine double_triples(it, from, to)
        type(doubling_lanes), intent(inout) :: it
        type(lane_triples), intent(in) :: from
        type(lane_triples), intent(inout) :: to
        real(wp) :: s, c, d, z
        integer :: l

        do l = 1, lanes
            s = from%s(l)
            c = from%c(l)
            d = from%d(l)
            z = 1.0_wp
            call double_triple(it%pmax(l), it%delta(l), s, c, d, z)
            to%s(l) = s
            to%c(l) = c
            to%d(l) = d
            it%z(l) = z
        end do
    end subroutine double_triples

    !> The angle at twice the time, divided by its size, the triple divided by its denominator z, and the
    !> integrals; lanes with less than i doublings of a kind left stay as they were.
    pure subroutine finish_doubling(i, left, b, nu, norm, z, from, to)
        integer, intent(in) :: i
        real(wp), intent(in) :: left(lanes)     !! doublings of this kind
        real(wp), intent(in) :: b, nu(lanes), norm(lanes), z(lanes)
        type(lane_triples), intent(in) :: from
        type(lane_triples), intent(inout) :: to
        real(wp) :: s, c, d, over, dd, own, ec, es
        integer :: l

        do l = 1, lanes
            ec = from%ec(l)
            es = from%es(l)
            call double_angle(nu(l), b*norm(l), from%y(l), 1.0_wp, to%s(l), to%c(l)*to%d(l), z(l), ec, es)
            over = 1/z(l)
            s = to%s(l)*over
            c = to%c(l)*over
            d = to%d(l)*over
            over = 1/(abs(ec) + abs(es))
            ec = ec*over
            es = es*over
            dd = from%dd(l)
            own = from%own(l)
            call double_integrals(from%s(l), from%d(l), s, d, dd, own)
            to%y(l) = merge(s*s, from%y(l), left(l) >= i)
            to%s(l) = merge(s, from%s(l), left(l) >= i)
            to%c(l) = merge(c, from%c(l), left(l) >= i)
            to%d(l) = merge(d, from%d(l), left(l) >= i)
            to%dd(l) = merge(dd, from%dd(l), left(l) >= i)
            to%own(l) = merge(own, from%own(l), left(l) >= i)
            to%ec(l) = merge(ec, from%ec(l), left(l) >= i)
            to%es(l) = merge(es, from%es(l), left(l) >= i)
        end do
    end subroutine finish_doubling

    !> Momentum at mid-step and at the end; from here on c belongs to p and d to r.
    pure subroutine find_momenta(b, of, it, at, ends)
        real(wp), intent(in) :: b
        type(lane_forms), intent(in) :: of
        type(doubling_lanes), intent(inout) :: it
        type(lane_triples), intent(in) :: at
        type(lane_ends), intent(inout) :: ends
        real(wp) :: n1, n2, n3, n0, d1, d2, d3, over, c, d
        logical :: c_is_cn
        integer :: l

        do l = 1, lanes
            c_is_cn = it%cn(l) > 0.0_wp
            c = merge(at%c(l), at%d(l), c_is_cn)
            d = merge(at%d(l), at%c(l), c_is_cn)
            it%c(l) = c
            ends%d(l) = d
            call long_momentum(c_is_cn, it%delta(l), of%a(l), b, of%g(l), of%gg(l), at%s(l), c, d, 1.0_wp, &
                               of%m1(l), of%m2(l), of%m3(l), n1, n2, n3, n0, d1, d2, d3)
            ends%e1(l) = of%m1(l) + d1
            ends%e2(l) = of%m2(l) + d2
            ends%e3(l) = of%m3(l) + d3
            over = 1/n0
            it%n1(l) = n1*over
            it%n2(l) = n2*over
            it%n3(l) = n3*over
        end do
    end subroutine find_momenta

    !> The turn e z, less 1.
    pure subroutine find_turns(b, of, it, at, ends)
        real(wp), intent(in) :: b
        type(lane_forms), intent(in) :: of
        type(doubling_lanes), intent(inout) :: it
        type(lane_triples), intent(in) :: at
        type(lane_ends), intent(inout) :: ends
        real(wp) :: over, cosine, along, v0, v2, v3, w0, w1, w2, w3
        integer :: l

        do l = 1, lanes
            over = 1/sqrt(at%ec(l)*at%ec(l) + at%es(l)*at%es(l))
            cosine = (it%cosine(l)*at%ec(l) + it%sine(l)*at%es(l))*over
            along = (it%sine(l)*at%ec(l) - it%cosine(l)*at%es(l))*over/it%norm(l)
            it%cosine(l) = cosine
            it%along(l) = along
            ends%sine(l) = 2*along*cosine
            ends%versine(l) = 2*along*along
        end do
        do l = 1, lanes
            cosine = it%cosine(l)
            along = it%along(l)
            call long_direction(b, of%g(l), at%s(l), ends%d(l), 1.0_wp, 1.0_wp, it%n2(l), it%n3(l), v0, &
                                v2, v3)
            call join_turns(cosine, along, of%m1(l), of%m2(l), of%m3(l), v0, v2, v3, w1, w2, w3)
            w0 = cosine*v0 - along*(of%m2(l)*v2 + of%m3(l)*v3)
            over = 1/sqrt(w0*w0 + (w1*w1 + w2*w2 + w3*w3))
            ends%w0(l) = w0*over - 1
            ends%w1(l) = w1*over
            ends%w2(l) = w2*over
            ends%w3(l) = w3*over
        end do
    end subroutine find_turns

    !> R^T - 1, the columns of K, the shift of the time, the covector k m + g.
    pure subroutine find_columns(b, of, it, at, ends)
        real(wp), intent(in) :: b
        type(lane_forms), intent(in) :: of
        type(doubling_lanes), intent(in) :: it
        type(lane_triples), intent(in) :: at
        type(lane_ends), intent(inout) :: ends
        real(wp) :: x, yy, twice, over_d0, x1, x2, x3, y1, y2, y3, s, c, d
        logical :: c_is_cn
        integer :: l

        do l = 1, lanes
            c_is_cn = it%cn(l) > 0.0_wp
            s = at%s(l)
            c = it%c(l)
            d = ends%d(l)
            call phase_terms(c_is_cn, of%a(l), b, of%g(l), of%m1(l), of%m3(l), it%n2(l), it%n3(l), s, c, d, &
                             x, yy, twice, over_d0)
            call long_gradients(c_is_cn, of%a(l), b, of%g(l), of%m1(l), of%m2(l), of%m3(l), it%n1(l), &
                                it%n2(l), it%n3(l), s, c, d, at%dd(l), at%own(l), over_d0, x1, x2, x3, y1, &
                                y2, y3, ends%t1(l), ends%t2(l), ends%t3(l))
            call turn_matrix(d, x, yy, twice, ends%r11(l), ends%r12(l), ends%r13(l), ends%r22(l), &
                             ends%r23(l), ends%r33(l))
            ends%x(l) = x
            ends%yy(l) = yy
            ends%x1(l) = (twice*d)*x1
            ends%x2(l) = (twice*d)*x2
            ends%x3(l) = (twice*d)*x3
            ends%y1(l) = twice*y1
            ends%y2(l) = twice*y2
            ends%y3(l) = twice*y3
            call long_covector(c_is_cn, of%a(l), b, of%g(l), of%m1(l), of%m2(l), of%m3(l), of%gg(l), &
                               it%delta(l), of%nu(l), s, c, d, at%dd(l), at%own(l), &
                               2*(of%rate(l) - it%along(l)*it%cosine(l)), ends%f1(l), ends%f2(l), ends%f3(l))
        end do
    end subroutine find_columns

    include 'all_doublings.inc'

    include 'middle_polynomials.inc'

    include 'tangent_turn_formulas.inc'

    include 'tangent_middle_formulas.inc'

    include 'tangent_long_formulas.inc'

    include 'tangent_phase_formulas.inc'

end module frb_flow_tangent_far
