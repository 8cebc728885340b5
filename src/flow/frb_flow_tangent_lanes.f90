!> Blocks of equal bodies with their derivatives, one body per SIMD lane, in loops of fixed length that the
!> compiler vectorises: what frb_flow_tangent_near and frb_flow_tangent_far share. The result of a body does
!> not depend on the others of its block. Each formula is called in one place: only then is it inlined.
!>
!> Components of the states are read and written in the caller's memory, each as an array with a constant
!> distance between bodies. So a block may have its axes in any order.
module frb_flow_tangent_lanes
    use frb_flow_limits, only: short_limit, small_turn_limit, period_limit, sin_cos_limit, plain_largest, &
        plain_smallest
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: lanes, of_m, of_q, of_phi, near, far, lane_body, lane_orbits, load_lanes, keep_lanes

    integer, parameter :: lanes = 32    !! bodies in a block
    !> From one component of m, of q, of transition in the first lane of a block to that in the last.
    integer, parameter :: of_m = 3*lanes - 2, of_q = 4*lanes - 3, of_phi = 36*lanes - 35

    !> The kinds of steps: by series, by doublings, or not in lanes.
    real(wp), parameter :: near = 1.0_wp, far = 2.0_wp, no_lane = 3.0_wp

    !> The body in axes of cyclic order, the middle moment second, times t = h/2. Where the moments ascend in
    !> an odd order, these axes have them descend, and a, b, g are negative.
    type :: lane_body
        integer :: order(3)         !! its axes in those of the body
        real(wp) :: a, b, g         !! alpha t, beta t, gamma t
        real(wp) :: first, last     !! a1 t, a3 t
        real(wp) :: largest         !! the larger of their squares
    end type lane_body

    !> The orbits of a block. A lane whose step is not served stands still.
    type :: lane_orbits
        real(wp) :: kind(lanes)
        real(wp) :: m1(lanes), m2(lanes), m3(lanes)     !! momentum in cyclic axes
        real(wp) :: p(lanes), r(lanes)                  !! P t^2, R t^2
    end type lane_orbits

contains

    !> Loads the momenta of a block, and finds how far their steps reach. Lanes whose numbers are not plain
    !> are not served.
    pure subroutine load_lanes(body, m1, m2, m3, q, it, nears, fars)
        type(lane_body), intent(in) :: body
        real(wp), intent(in) :: m1(of_m), m2(of_m), m3(of_m), q(4*lanes)
        type(lane_orbits), intent(inout) :: it
        integer, intent(out) :: nears, fars         !! number of lanes of these kinds
        real(wp) :: n1, n2, n3, size_m, size_q, least, most, ab, ag, bg, k, p, r, reach, square, kind
        real(wp) :: most_near       !! largest square of a half angle of the series
        integer(int64) :: series, doublings
        integer :: l

        ab = body%a*body%b
        ag = body%a*body%g
        bg = body%b*body%g
        ! By |m| alone, p and r being at most |m|^2 times the larger of bg and ab: so bodies with momenta of
        ! one size are of one kind, and their blocks need only one.
        most_near = small_turn_limit
        k = max(ab, bg)
        if (small_turn_limit*k > short_limit*body%largest) most_near = short_limit*body%largest/k
        series = 0
        doublings = 0
        do l = 1, lanes
            n1 = m1(3*l - 2)
            n2 = m2(3*l - 2)
            n3 = m3(3*l - 2)
            size_m = 0.25_wp*abs(n1) + (0.25_wp*abs(n2) + 0.25_wp*abs(n3))
            size_q = (0.25_wp*abs(q(4*l - 3)) + 0.25_wp*abs(q(4*l - 2))) &
                     + (0.25_wp*abs(q(4*l - 1)) + 0.25_wp*abs(q(4*l)))
            size_m = merge(plain_largest, size_m, ieee_is_nan(size_m))      ! comparing a NaN raises a flag
            size_q = merge(plain_largest, size_q, ieee_is_nan(size_q))
            least = min(size_m, size_q)
            most = max(size_m, size_q)
            least = merge(least, 0.0_wp, most < plain_largest)
            n1 = merge(n1, 0.0_wp, least > plain_smallest)
            n2 = merge(n2, 0.0_wp, least > plain_smallest)
            n3 = merge(n3, 0.0_wp, least > plain_smallest)
            k = ag*(n2*n2)
            p = bg*(n1*n1) + k
            r = k + ab*(n3*n3)
            square = body%largest*(n1*n1 + (n2*n2 + n3*n3))     ! of the largest half angle
            reach = max(p, r)
            kind = merge(far, no_lane, reach <= period_limit)
            kind = merge(kind, no_lane, square <= sin_cos_limit**2)
            kind = merge(near, kind, square <= most_near)
            kind = merge(kind, no_lane, least > plain_smallest)
            it%kind(l) = kind
            it%m1(l) = n1
            it%m2(l) = n2
            it%m3(l) = n3
            it%p(l) = p
            it%r(l) = r
            series = series + merge(1_int64, 0_int64, kind <= near)
            doublings = doublings + merge(0_int64, 1_int64, abs(kind - far) > 0.0_wp)
        end do
        nears = int(series)
        fars = int(doublings)
    end subroutine load_lanes

    !> The lanes of a kind; the others stand still.
    pure subroutine keep_lanes(kind, it, kept, here)
        real(wp), intent(in) :: kind
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
    end subroutine keep_lanes

end module frb_flow_tangent_lanes
