!> Many equal bodies with the derivatives of their step: the bodies of a block share SIMD lanes, blocks are
!> shared among threads.
module frb_flow_tangent_many
    use frb_flow_blocks, only: polynomial_of_rho
    use frb_flow_limits, only: plain_largest
    use frb_flow_tangent_body, only: tangent_body
    use frb_flow_tangent_far, only: step_far
    use frb_flow_tangent_lanes, only: lanes, kinds, far, lane_body, lane_orbits, reach_of_kinds, &
        load_lanes, keep_lanes
    use frb_flow_tangent_near, only: step_near
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: tangent_many

    integer, parameter :: group = 32*lanes      !! bodies that a thread takes at a time
    integer, parameter :: few = lanes/4         !! as many are faster one by one

    !> Bodies that wait, and their states, by kind of step; those of kind `kinds` + 1 are moved one by one.
    type :: waiting_states
        integer :: count(kinds + 1), number(lanes, kinds + 1)
        real(wp) :: m(3, lanes, kinds + 1), q(4, lanes, kinds + 1)
    end type waiting_states

contains

    !> Advances n equal bodies by h, with their transitions. A body that is refused keeps its state, and its
    !> transition is that of no step; code is then the largest of the codes. With -fopenmp groups of bodies
    !> are shared among the threads.
    subroutine tangent_many(body, h, n, m, q, transition, code)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        integer, intent(in) :: n
        real(wp), intent(inout) :: m(3, n), q(4, n)
        real(wp), intent(out) :: transition(36, n)
        integer, intent(out) :: code
        type(lane_body) :: of
        logical :: in_lanes
        integer :: first, i, one, refused

        refused = status_ok
        in_lanes = body%status == status_ok .and. .not. body%needs_rotation .and. is_plain_time(body, h)
        if (in_lanes) then
            of = body_of_lanes(body, 0.5_wp*h)
            !$omp parallel do if (n >= 2*group) reduction(max: refused)
            do first = 1, n, group
                call step_group(body, h, of, min(group, n - first + 1), m(1, first), q(1, first), &
                                transition(1, first), refused)
            end do
            !$omp end parallel do
        else
            !$omp parallel do if (n >= 2*group) private(one) reduction(max: refused)
            do i = 1, n
                call tangent_body(body, h, m(1, i), one, 0, q(1, i), transition(1, i))
                refused = max(refused, one)
            end do
            !$omp end parallel do
        end if
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
        of%most = reach_of_kinds(of)
    end function body_of_lanes

    !> Advances a group of bodies. Of a block that needs steps of several kinds, those of the kind that most
    !> have are advanced, if they are half of it; the others wait, with a copy of their state, for others of
    !> their kind. So do the bodies of a last block that is not whole; few of them are advanced one by one.
    pure subroutine step_group(body, h, of, n, m, q, transition, refused)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        type(lane_body), intent(in) :: of
        integer, intent(in) :: n
        real(wp), intent(inout) :: m(3, n), q(4, n), transition(36, n)
        integer, intent(inout) :: refused
        type(waiting_states) :: waiting
        type(lane_orbits) :: orbits
        real(wp) :: old_m(3, lanes), old_q(4, lanes)
        integer :: first, l, one, most, kind, many(kinds)

        waiting%count = 0
        do first = 1, n, lanes
            most = 0
            if (n - first < few) then
                do l = first, n
                    call tangent_body(body, h, m(1, l), one, 0, q(1, l), transition(1, l))
                    refused = max(refused, one)
                end do
                exit
            else if (n - first >= lanes - 1) then
                call load_lanes(of, m(1, first), q(1, first), orbits, many)
                most = maxloc(many, 1)
                if (many(most) == lanes) then
                    call step_lanes(most, of, orbits, m(1, first), q(1, first), transition(1, first))
                    cycle
                end if
                if (2*many(most) < lanes) most = 0
            end if
            do l = 1, lanes
                old_m(:, l) = m(:, first + min(l - 1, n - first))
                old_q(:, l) = q(:, first + min(l - 1, n - first))
            end do
            if (n - first < lanes - 1) call load_lanes(of, old_m, old_q, orbits, many)
            if (most > 0) then
                call keep_lanes(most, orbits)
                call step_lanes(most, of, orbits, m(1, first), q(1, first), transition(1, first))
            end if
            do l = 1, min(lanes, n - first + 1)
                kind = min(nint(orbits%kind(l)), kinds + 1)
                if (kind == most) cycle
                associate (count => waiting%count(kind))
                    count = count + 1
                    waiting%number(count, kind) = first - 1 + l
                    waiting%m(:, count, kind) = old_m(:, l)
                    waiting%q(:, count, kind) = old_q(:, l)
                    if (count == lanes) call step_kind(body, h, of, kind, waiting, n, m, q, transition, &
                                                       refused)
                end associate
            end do
        end do
        do kind = 1, kinds + 1
            call step_kind(body, h, of, kind, waiting, n, m, q, transition, refused)
        end do
    end subroutine step_group

    !> Advances the bodies of one kind that wait.
    pure subroutine step_kind(body, h, of, kind, waiting, n, m, q, transition, refused)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        type(lane_body), intent(in) :: of
        integer, intent(in) :: kind, n
        type(waiting_states), intent(inout) :: waiting
        real(wp), intent(inout) :: m(3, n), q(4, n), transition(36, n)
        integer, intent(inout) :: refused
        type(lane_orbits) :: orbits
        real(wp) :: its_transition(36, lanes)
        integer :: count, l, one, many(kinds)

        count = waiting%count(kind)
        if (count == 0) return
        waiting%count(kind) = 0
        associate (number => waiting%number(:, kind), its_m => waiting%m(:, :, kind), &
                   its_q => waiting%q(:, :, kind))
            if (kind > kinds) then
                do l = 1, count
                    call tangent_body(body, h, its_m(:, l), one, 0, its_q(:, l), its_transition(:, l))
                    refused = max(refused, one)
                end do
            else
                do l = count + 1, lanes
                    its_m(:, l) = its_m(:, count)
                    its_q(:, l) = its_q(:, count)
                end do
                call load_lanes(of, its_m, its_q, orbits, many)
                call step_lanes(kind, of, orbits, its_m, its_q, its_transition)
            end if
            do l = 1, count
                m(:, number(l)) = its_m(:, l)
                q(:, number(l)) = its_q(:, l)
                transition(:, number(l)) = its_transition(:, l)
            end do
        end associate
    end subroutine step_kind

    !> Advances a whole block.
    pure subroutine step_lanes(kind, of, orbits, m, q, transition)
        integer, intent(in) :: kind
        type(lane_body), intent(in) :: of
        type(lane_orbits), intent(in) :: orbits
        real(wp), intent(inout) :: m(3, lanes), q(4, lanes), transition(36, lanes)

        if (kind == far) then
            call clear(transition)
            call step_far(of, orbits, m, q, transition)
        else
            call step_near(kind, of, orbits, m, q, transition)
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
