!> Many equal bodies with the derivatives of their step: the bodies of a block share SIMD lanes, blocks are
!> shared among threads.
module frb_flow_tangent_many
    use frb_flow_limits, only: plain_largest, middle_limit, period_limit
    use frb_flow_tangent_body, only: tangent_body
    use frb_flow_tangent_far, only: find_far_ends
    use frb_flow_tangent_lanes, only: lanes, lane_body, lane_orbits, lane_ends, load_lanes, set_forms, &
        is_served, keep_lanes, join_lanes, finish_lanes
    use frb_flow_tangent_near, only: find_near_ends
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: tangent_many

contains

    !> Advances n equal bodies by h, with their transitions. A body that is refused keeps its state, and its
    !> transition is that of no step; code is then the largest of the codes. With -fopenmp blocks are shared
    !> among the threads.
    subroutine tangent_many(body, h, n, m, q, transition, code)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        integer, intent(in) :: n
        real(wp), intent(inout) :: m(3, n), q(4, n)
        real(wp), intent(out) :: transition(6, 6, n)
        integer, intent(out) :: code
        type(lane_body) :: of
        logical :: in_lanes, served(lanes)
        integer :: first, i, count, one, refused

        refused = status_ok
        in_lanes = body%status == status_ok .and. .not. body%needs_rotation .and. is_plain_time(body, h)
        of = body_of_lanes(body, 0.5_wp*h)
        !$omp parallel do if (n >= 64*lanes) private(served, i, count, one) reduction(max: refused)
        do first = 1, n, lanes
            count = min(lanes, n - first + 1)
            served = .false.
            if (in_lanes .and. count > lanes/4) call step_block(of, count, m(1, first), q(1, first), &
                                                               transition(1, 1, first), served)
            if (all(served(:count))) cycle
            do i = first, first + count - 1
                if (served(i - first + 1)) cycle
                call tangent_body(body, h, m(:, i), one, 0, q(:, i), transition(:, :, i))
                refused = max(refused, one)
            end do
        end do
        !$omp end parallel do
        code = refused
    end subroutine tangent_many

    !> The body over the half step t, its axes in cyclic order.
    pure function body_of_lanes(body, t) result(of)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t
        type(lane_body) :: of

        if (body%parity > 0.0_wp) then
            of = lane_body(body%order, body%alpha*t, body%beta*t, body%gamma*t, body%a(1)*t, body%a(3)*t, &
                           (body%a(1)*t)**2)
        else
            of = lane_body(body%order(3:1:-1), -body%gamma*t, -body%beta*t, -body%alpha*t, body%a(3)*t, &
                           body%a(1)*t, (body%a(1)*t)**2)
        end if
    end function body_of_lanes

    !> Advances those of a block that the lanes serve; the others are left as they are.
    subroutine step_block(of, count, m, q, transition, served)
        type(lane_body), intent(in) :: of
        integer, intent(in) :: count
        real(wp), intent(inout) :: m(3, count), q(4, count), transition(36, count)
        logical, intent(out) :: served(lanes)
        type(lane_orbits) :: orbits
        real(wp) :: some_m(3, lanes), some_q(4, lanes), some(36, lanes)
        integer :: l, near, far

        associate (o => of%order)
            if (count == lanes) then
                call load_lanes(of, m(o(1), 1), m(o(2), 1), m(o(3), 1), q, orbits, near, far)
                if (near + far == lanes) then
                    call step_lanes(of, near, far, orbits, m, q, transition)
                    served = .true.
                    return
                end if
            end if
            do l = 1, lanes
                some_m(:, l) = m(:, min(l, count))
                some_q(:, l) = q(:, min(l, count))
            end do
            call load_lanes(of, some_m(o(1), 1), some_m(o(2), 1), some_m(o(3), 1), some_q, orbits, near, far)
        end associate
        served = is_served(orbits%reach)
        if (near + far == 0) return
        do l = 1, lanes
            if (.not. served(l)) some_q(:, l) = 1.0_wp
        end do
        call step_lanes(of, near, far, orbits, some_m, some_q, some)
        do l = 1, count
            if (.not. served(l)) cycle
            m(:, l) = some_m(:, l)
            q(:, l) = some_q(:, l)
            transition(:, l) = some(:, l)
        end do
    end subroutine step_block

    !> Advances a whole block, of which `near` lanes are served by series and `far` by doublings.
    subroutine step_lanes(of, near, far, orbits, m, q, transition)
        type(lane_body), intent(in) :: of
        integer, intent(in) :: near, far
        type(lane_orbits), intent(inout) :: orbits
        real(wp), intent(inout) :: m(3, lanes), q(4, lanes), transition(36, lanes)
        type(lane_orbits) :: some
        type(lane_ends) :: ends, near_ends, far_ends

        call set_forms(of, orbits)
        if (far == 0) then
            call find_near_ends(of%b, orbits, ends)
        else if (near == 0) then
            call find_far_ends(of%b, orbits, ends)
        else
            call keep_lanes(-1.0_wp, middle_limit, orbits, some)
            call find_near_ends(of%b, some, near_ends)
            call keep_lanes(middle_limit, period_limit, orbits, some)
            call find_far_ends(of%b, some, far_ends)
            call join_lanes(orbits%reach, near_ends, far_ends, ends)
        end if
        call clear(transition)
        call finish_lanes(of, orbits, ends, m, q, transition)
    end subroutine step_lanes

    !> Writes the zeros of [J 0; W E], and the first row of E, which is written later: four numbers fill a
    !> vector.
    pure subroutine clear(transition)
        real(wp), intent(inout) :: transition(36, lanes)
        integer :: l, k

        do l = 1, lanes
            do k = 19, 31, 6
                transition(k:k + 3, l) = 0.0_wp
            end do
        end do
    end subroutine clear

    !> Whether the angle that the body turns in the time h is far from overflow.
    pure function is_plain_time(body, h) result(plain)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        logical :: plain

        plain = ieee_is_finite(h)
        if (plain) plain = abs(h) > 0.0_wp .and. abs(h) < plain_largest .and. body%a(1) < plain_largest
        if (plain) plain = abs(body%a(1)*h) < plain_largest
    end function is_plain_time

end module frb_flow_tangent_many
