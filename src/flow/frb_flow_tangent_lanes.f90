!> Blocks of equal bodies with their derivatives, one body per SIMD lane, in loops of fixed length that the
!> compiler vectorises: what frb_flow_tangent_near and frb_flow_tangent_far share. The result of a body does
!> not depend on the others of its block. Each formula is called in one place: only then is it inlined.
!>
!> States are read as columns. The results are written to the caller's memory, each component as an array with
!> a constant distance between bodies: so a block may have its axes in any order. To gather a body's numbers
!> first and to copy them takes longer (AVX2).
module frb_flow_tangent_lanes
    use frb_flow_lanes, only: angle_as_size
    use frb_flow_limits, only: short_limit, middle_limit, small_turn_limit, middle_turn_limit, period_limit, &
        sin_cos_limit, largest_bits, smallest_bits
    use frb_kinds, only: wp
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: lanes, of_m, of_q, of_phi, kinds, tiny, short, middle, far
    public :: lane_body, lane_orbits, reach_of_kinds, load_lanes, keep_lanes

    integer, parameter :: lanes = 32    !! bodies in a block
    !> From one component of m, of q, of transition in the first lane of a block to that in the last.
    integer, parameter :: of_m = 3*lanes - 2, of_q = 4*lanes - 3, of_phi = 36*lanes - 35

    !> The kinds of steps: by the first terms of series, by short or middle series, by doublings.
    integer, parameter :: tiny = 1, short = 2, middle = 3, far = 4, kinds = 4
    real(wp), parameter :: tiny_size = 8.0e-5_wp    !! largest size, see frb_flow_lanes, of the first terms
    real(wp), parameter :: no_lane = 5.0_wp     !! not in lanes

    !> The body in axes of cyclic order, the middle moment second, times t = h/2. Where the moments ascend in
    !> an odd order, these axes have them descend, and a, b, g are negative.
    type :: lane_body
        integer :: order(3)         !! its axes in those of the body
        real(wp) :: a, b, g         !! alpha t, beta t, gamma t
        real(wp) :: first, last     !! a1 t, a3 t
        real(wp) :: rate            !! the larger of them
        real(wp) :: rho(14)         !! polynomial_of_rho
        real(wp) :: most(0:far)     !! reach_of_kinds
    end type lane_body

    !> The orbits of a block.
    type :: lane_orbits
        real(wp) :: kind(lanes)
        real(wp) :: m1(lanes), m2(lanes), m3(lanes)     !! momentum in cyclic axes
        real(wp) :: gg(lanes)                           !! |m|^2
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
        real(wp) :: x(lanes, 3), n1, n2, n3, q0, q1, q2, q3, size_m, size_q
        integer(int64) :: above, below, plain(lanes), all_plain     !! >= 0: plain
        integer :: l

        all_plain = 0
        do l = 1, lanes
            n1 = m(1, l)
            n2 = m(2, l)
            n3 = m(3, l)
            q0 = q(1, l)
            q1 = q(2, l)
            q2 = q(3, l)
            q3 = q(4, l)
            size_m = 0.125_wp*abs(n1) + (0.125_wp*abs(n2) + 0.125_wp*abs(n3))
            size_q = (0.125_wp*abs(q0) + 0.125_wp*abs(q1)) + (0.125_wp*abs(q2) + 0.125_wp*abs(q3))
            above = ior(transfer(size_m, above) - smallest_bits, transfer(size_q, above) - smallest_bits)
            below = largest_bits - transfer(size_m + size_q, below)
            plain(l) = ior(above, below)
            all_plain = ior(all_plain, plain(l))
            x(l, 1) = n1
            x(l, 2) = n2
            x(l, 3) = n3
            it%q(l, 1) = q0
            it%q(l, 2) = q1
            it%q(l, 3) = q2
            it%q(l, 4) = q3
        end do
        if (all_plain < 0) then
            do l = 1, lanes
                if (plain(l) >= 0) cycle
                x(l, :) = 0.0_wp
                it%q(l, :) = 1.0_wp
            end do
        end if
        associate (o => body%order)
            call find_reach(body, x(:, o(1)), x(:, o(2)), x(:, o(3)), it, many)
        end associate
    end subroutine load_lanes

    !> The orbits of momenta in cyclic axes, and the kinds of their steps. The extremes of |m| tell whether
    !> all are of one kind: 3 % less time for short steps.
    pure subroutine find_reach(body, x1, x2, x3, it, many)
        type(lane_body), intent(in) :: body
        real(wp), intent(in), dimension(lanes) :: x1, x2, x3
        type(lane_orbits), intent(inout) :: it
        integer, intent(out) :: many(kinds)
        real(wp) :: n1, n2, n3, ab, ag, bg, k, gg
        real(wp) :: least, largest                      !! squares of a body's largest half angle
        integer(int64) :: bits, lowest, highest         !! bit patterns of |m|^2: they ascend with it
        integer :: l

        ab = body%a*body%b
        ag = body%a*body%g
        bg = body%b*body%g
        lowest = huge(lowest)
        highest = 0
        do l = 1, lanes
            n1 = x1(l)
            n2 = x2(l)
            n3 = x3(l)
            k = ag*(n2*n2)
            gg = n1*n1 + (n2*n2 + n3*n3)
            it%m1(l) = n1
            it%m2(l) = n2
            it%m3(l) = n3
            it%gg(l) = gg
            it%p(l) = bg*(n1*n1) + k
            it%r(l) = k + ab*(n3*n3)
            bits = transfer(gg, bits)
            lowest = min(lowest, bits)
            highest = max(highest, bits)
        end do
        least = (body%rate*body%rate)*transfer(lowest, least)
        largest = (body%rate*body%rate)*transfer(highest, largest)
        many = 0
        do l = tiny, far
            if (least > body%most(l - 1) .and. largest <= body%most(l)) then
                many(l) = lanes
                it%kind = real(l, wp)
                return
            end if
        end do
        call find_kinds(body, it, many)
    end subroutine find_reach

    !> The kinds of the steps of a block that may need several, lane by lane.
    pure subroutine find_kinds(body, it, many)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(inout) :: it
        integer, intent(out) :: many(kinds)
        real(wp) :: square              !! that of the largest half angle
        real(wp) :: kind
        integer(int64) :: to_tiny, to_short, to_middle, to_far      !! lanes up to each kind
        integer :: l

        to_tiny = 0
        to_short = 0
        to_middle = 0
        to_far = 0
        do l = 1, lanes
            square = (body%rate*body%rate)*it%gg(l)
            kind = merge(real(far, wp), no_lane, max(it%p(l), it%r(l)) <= period_limit)
            kind = merge(kind, no_lane, square <= sin_cos_limit**2)
            kind = merge(real(middle, wp), kind, square <= body%most(middle))
            kind = merge(real(short, wp), kind, square <= body%most(short))
            kind = merge(real(tiny, wp), kind, square <= body%most(tiny))
            kind = merge(kind, no_lane, it%gg(l) > 0.0_wp)
            it%kind(l) = kind
            to_tiny = to_tiny + merge(1_int64, 0_int64, kind <= tiny)
            to_short = to_short + merge(1_int64, 0_int64, kind <= short)
            to_middle = to_middle + merge(1_int64, 0_int64, kind <= middle)
            to_far = to_far + merge(1_int64, 0_int64, kind <= far)
        end do
        many = int([to_tiny, to_short - to_tiny, to_middle - to_short, to_far - to_middle])
    end subroutine find_kinds

    !> The largest square of a half angle, to which each kind of steps reaches; the first number is 0. By |m|
    !> alone, as p and r are at most |m|^2 times the larger of bg and ab: so bodies with momenta of one size
    !> are of one kind, and their blocks need only one. The far kind reaches beyond its number where p and r
    !> are smaller than that: find_kinds decides. The factor 0.999 is for rounding.
    pure function reach_of_kinds(body) result(most)
        type(lane_body), intent(in) :: body
        real(wp) :: most(0:far)
        real(wp), parameter :: of_triple(tiny:far) = [tiny_size, short_limit, middle_limit, &
                                                      0.999_wp*period_limit]
        real(wp) :: k, square
        integer :: l

        k = max(body%a*body%b, body%b*body%g)
        square = body%rate*body%rate
        most = [0.0_wp, tiny_size/angle_as_size, small_turn_limit, middle_turn_limit, sin_cos_limit**2]
        do l = tiny, far
            if (most(l)*k > of_triple(l)*square) most(l) = of_triple(l)*square/k
        end do
    end function reach_of_kinds

    !> The lanes of other kinds stand still, their momenta become 0.
    pure subroutine keep_lanes(kind, it)
        integer, intent(in) :: kind
        type(lane_orbits), intent(inout) :: it
        real(wp) :: factor(lanes)

        factor = merge(1.0_wp, 0.0_wp, nint(it%kind) == kind)
        it%m1 = factor*it%m1
        it%m2 = factor*it%m2
        it%m3 = factor*it%m3
        it%gg = factor*it%gg
        it%p = factor*it%p
        it%r = factor*it%r
    end subroutine keep_lanes

end module frb_flow_tangent_lanes
