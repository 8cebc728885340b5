!> Blocks of equal bodies with their derivatives, one body per SIMD lane, in loops of fixed length that the
!> compiler vectorises: what frb_flow_tangent_near and frb_flow_tangent_far share. The result of a body does
!> not depend on the others of its block. Each formula is called in one place: only then is it inlined.
!>
!> States are read as columns. The results are written to the caller's memory, each component as an array with
!> a constant distance between bodies: so a block may have its axes in any order. Half the time of short steps
!> goes into these stores; to gather a body's numbers first and to copy them takes longer (AVX2).
module frb_flow_tangent_lanes
    use frb_flow_lanes, only: limits, angle_as_size
    use frb_flow_limits, only: short_limit, small_turn_limit, period_limit, sin_cos_limit, plain_largest, &
        plain_smallest
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: lanes, of_m, of_q, of_phi, kinds, tiny, far, lane_body, lane_orbits, load_lanes, keep_lanes

    integer, parameter :: lanes = 32    !! bodies in a block
    !> From one component of m, of q, of transition in the first lane of a block to that in the last.
    integer, parameter :: of_m = 3*lanes - 2, of_q = 4*lanes - 3, of_phi = 36*lanes - 35

    !> The kinds of steps: by the first terms of series, by series, by doublings, or not in lanes.
    integer, parameter :: tiny = 1, near = 2, far = 3, kinds = 3
    real(wp), parameter :: no_lane = 4.0_wp

    !> The body in axes of cyclic order, the middle moment second, times t = h/2. Where the moments ascend in
    !> an odd order, these axes have them descend, and a, b, g are negative.
    type :: lane_body
        integer :: order(3)         !! its axes in those of the body
        real(wp) :: a, b, g         !! alpha t, beta t, gamma t
        real(wp) :: first, last     !! a1 t, a3 t
        real(wp) :: rate            !! the larger of them
        real(wp) :: rho(14)         !! polynomial_of_rho
    end type lane_body

    !> The orbits of a block. A lane whose step is not served stands still.
    type :: lane_orbits
        real(wp) :: kind(lanes)
        real(wp) :: m1(lanes), m2(lanes), m3(lanes)     !! momentum in cyclic axes
        real(wp) :: p(lanes), r(lanes)                  !! P t^2, R t^2
        real(wp) :: q(lanes, 4)                         !! attitude in body axes
    end type lane_orbits

contains

    !> Loads the states of a block as columns, and finds how far their steps reach. Lanes whose numbers are
    !> not plain are not served.
    pure subroutine load_lanes(body, m, q, it, many)
        type(lane_body), intent(in) :: body
        real(wp), intent(in) :: m(3, lanes), q(4, lanes)
        type(lane_orbits), intent(inout) :: it
        integer, intent(out) :: many(kinds)         !! number of lanes of each kind
        real(wp) :: x(lanes, 3), smallest(lanes), n1, n2, n3, q0, q1, q2, q3, size_m, size_q
        integer(int64) :: plain
        integer :: l

        plain = 0
        do l = 1, lanes
            n1 = m(1, l)
            n2 = m(2, l)
            n3 = m(3, l)
            q0 = q(1, l)
            q1 = q(2, l)
            q2 = q(3, l)
            q3 = q(4, l)
            size_m = 0.25_wp*abs(n1) + (0.25_wp*abs(n2) + 0.25_wp*abs(n3))
            size_q = (0.25_wp*abs(q0) + 0.25_wp*abs(q1)) + (0.25_wp*abs(q2) + 0.25_wp*abs(q3))
            size_m = merge(plain_largest, size_m, ieee_is_nan(size_m))      ! comparing a NaN raises a flag
            size_q = merge(plain_largest, size_q, ieee_is_nan(size_q))
            size_q = merge(min(size_m, size_q), 0.0_wp, max(size_m, size_q) < plain_largest)
            plain = plain + merge(1_int64, 0_int64, size_q > plain_smallest)
            smallest(l) = size_q
            x(l, 1) = n1
            x(l, 2) = n2
            x(l, 3) = n3
            it%q(l, 1) = q0
            it%q(l, 2) = q1
            it%q(l, 3) = q2
            it%q(l, 4) = q3
        end do
        if (plain < lanes) then
            do l = 1, lanes
                if (smallest(l) > plain_smallest) cycle
                x(l, :) = 0.0_wp
                it%q(l, :) = 1.0_wp
            end do
        end if
        associate (o => body%order)
            call find_reach(body, x(:, o(1)), x(:, o(2)), x(:, o(3)), it, many)
        end associate
    end subroutine load_lanes

    !> The orbits of momenta in cyclic axes, and the kinds of their steps.
    pure subroutine find_reach(body, x1, x2, x3, it, many)
        type(lane_body), intent(in) :: body
        real(wp), intent(in), dimension(lanes) :: x1, x2, x3
        type(lane_orbits), intent(inout) :: it
        integer, intent(out) :: many(kinds)
        real(wp) :: n1, n2, n3, ab, ag, bg, k, p, r, gg, largest, square, kind
        real(wp) :: most_tiny, most_near        !! largest squares of a half angle of the series
        integer(int64) :: firsts, series, doublings
        integer :: l

        ab = body%a*body%b
        ag = body%a*body%g
        bg = body%b*body%g
        largest = body%rate*body%rate
        ! By |m| alone, p and r being at most |m|^2 times the larger of bg and ab: so bodies with momenta of
        ! one size are of one kind, and their blocks need only one.
        k = max(ab, bg)
        most_tiny = limits(1)/angle_as_size
        if (most_tiny*k > limits(1)*largest) most_tiny = limits(1)*largest/k
        most_near = small_turn_limit
        if (small_turn_limit*k > short_limit*largest) most_near = short_limit*largest/k
        firsts = 0
        series = 0
        doublings = 0
        do l = 1, lanes
            n1 = x1(l)
            n2 = x2(l)
            n3 = x3(l)
            k = ag*(n2*n2)
            p = bg*(n1*n1) + k
            r = k + ab*(n3*n3)
            gg = n1*n1 + (n2*n2 + n3*n3)
            square = largest*gg             ! of the largest half angle
            kind = merge(real(far, wp), no_lane, max(p, r) <= period_limit)
            kind = merge(kind, no_lane, square <= sin_cos_limit**2)
            kind = merge(real(near, wp), kind, square <= most_near)
            kind = merge(real(tiny, wp), kind, square <= most_tiny)
            kind = merge(kind, no_lane, gg > 0.0_wp)
            it%kind(l) = kind
            it%m1(l) = n1
            it%m2(l) = n2
            it%m3(l) = n3
            it%p(l) = p
            it%r(l) = r
            firsts = firsts + merge(1_int64, 0_int64, kind <= tiny)
            series = series + merge(1_int64, 0_int64, kind <= near)
            doublings = doublings + merge(1_int64, 0_int64, kind <= far)
        end do
        many = int([firsts, series - firsts, doublings - series])
    end subroutine find_reach

    !> The lanes of a kind; the others stand still.
    pure subroutine keep_lanes(kind, it, kept, here)
        integer, intent(in) :: kind
        type(lane_orbits), intent(in) :: it
        type(lane_orbits), intent(inout) :: kept
        logical, intent(out) :: here(lanes)

        here = abs(it%kind - kind) <= 0
        kept%kind = it%kind
        kept%m1 = merge(it%m1, 0.0_wp, here)
        kept%m2 = merge(it%m2, 0.0_wp, here)
        kept%m3 = merge(it%m3, 0.0_wp, here)
        kept%p = merge(it%p, 0.0_wp, here)
        kept%r = merge(it%r, 0.0_wp, here)
        kept%q = it%q
    end subroutine keep_lanes

end module frb_flow_tangent_lanes
