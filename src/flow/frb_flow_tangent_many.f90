!> Many equal bodies with the derivatives of their step: the bodies of a block share SIMD lanes, blocks are
!> shared among threads.
module frb_flow_tangent_many
    use frb_flow_blocks, only: polynomial_of_rho
    use frb_flow_limits, only: plain_largest
    use frb_flow_tangent_body, only: tangent_body
    use frb_flow_tangent_far, only: step_far
    use frb_flow_tangent_lanes, only: lanes, kinds, tiny, far, lane_body, lane_orbits, load_lanes, &
        keep_lanes
    use frb_flow_tangent_near, only: step_near
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
        logical :: in_lanes, whole, served(lanes)
        integer :: first, i, count, one, refused

        refused = status_ok
        in_lanes = body%status == status_ok .and. .not. body%needs_rotation .and. is_plain_time(body, h)
        if (in_lanes) of = body_of_lanes(body, 0.5_wp*h)
        !$omp parallel do if (n >= 64*lanes) private(whole, served, i, count, one) reduction(max: refused)
        do first = 1, n, lanes
            count = min(lanes, n - first + 1)
            whole = .false.
            if (in_lanes .and. count > lanes/4) then
                call step_block(of, count, m(1, first), q(1, first), transition(1, 1, first), whole, served)
            else
                served = .false.
            end if
            if (whole) cycle
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

        of%rate = body%a(1)*t
        of%rho = polynomial_of_rho(body%a)
        if (body%parity > 0.0_wp) then
            of%order = body%order
            of%a = body%alpha*t
            of%b = body%beta*t
            of%g = body%gamma*t
            of%first = of%rate
            of%last = body%a(3)*t
        else
            of%order = body%order(3:1:-1)
            of%a = -body%gamma*t
            of%b = -body%beta*t
            of%g = -body%alpha*t
            of%first = body%a(3)*t
            of%last = of%rate
        end if
    end function body_of_lanes

    !> Advances those of a block that the lanes serve; the others are left as they are.
    pure subroutine step_block(of, count, m, q, transition, whole, served)
        type(lane_body), intent(in) :: of
        integer, intent(in) :: count
        real(wp), intent(inout) :: m(3, count), q(4, count), transition(36, count)
        logical, intent(out) :: whole               !! all are served; served is then not set
        logical, intent(inout) :: served(lanes)
        real(wp) :: some_m(3, lanes), some_q(4, lanes)
        type(lane_orbits) :: orbits
        integer :: l, kind, many(kinds)

        if (count == lanes) then
            call load_lanes(of, m, q, orbits, many)
            whole = maxval(many) == lanes
            if (whole) then
                call step_lanes(maxloc(many, 1), of, orbits, m, q, transition)
                return
            end if
        else
            do l = 1, lanes
                some_m(:, l) = m(:, min(l, count))
                some_q(:, l) = q(:, min(l, count))
            end do
            call load_lanes(of, some_m, some_q, orbits, many)
        end if
        whole = .false.
        served = .false.
        do kind = 1, kinds
            if (many(kind) > 0) call step_some(kind, of, orbits, count, m, q, transition, served)
        end do
    end subroutine step_block

    !> Advances the lanes of one kind.
    pure subroutine step_some(kind, of, orbits, count, m, q, transition, served)
        integer, intent(in) :: kind
        type(lane_body), intent(in) :: of
        type(lane_orbits), intent(in) :: orbits
        integer, intent(in) :: count
        real(wp), intent(inout) :: m(3, count), q(4, count), transition(36, count)
        logical, intent(inout) :: served(lanes)
        type(lane_orbits) :: kept
        real(wp) :: some_m(3, lanes), some_q(4, lanes), some(36, lanes)
        logical :: here(lanes)
        integer :: l

        call keep_lanes(kind, orbits, kept, here)
        call step_lanes(kind, of, kept, some_m, some_q, some)
        do l = 1, count
            if (.not. here(l)) cycle
            m(:, l) = some_m(:, l)
            q(:, l) = some_q(:, l)
            transition(:, l) = some(:, l)
        end do
        served = served .or. here
    end subroutine step_some

    !> Advances a whole block.
    pure subroutine step_lanes(kind, of, orbits, m, q, transition)
        integer, intent(in) :: kind
        type(lane_body), intent(in) :: of
        type(lane_orbits), intent(in) :: orbits
        real(wp), intent(inout) :: m(3, lanes), q(4, lanes), transition(36, lanes)

        call clear(transition)
        if (kind == far) then
            call step_far(of, orbits, m, q, transition)
        else
            call step_near(kind == tiny, of, orbits, m, q, transition)
        end if
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
