!> Many equal bodies with the derivatives of their step: blocks of them through SIMD lanes, blocks through
!> threads.
module frb_flow_tangent_many
    use frb_flow_limits, only: plain_largest, plain_smallest
    use frb_flow_tangent_body, only: tangent_body
    use frb_flow_tangent_lanes, only: lanes, tangent_lanes, step_lanes, is_served
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
    use, intrinsic :: iso_fortran_env, only: int64
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
        type(tangent_lanes) :: block
        logical :: in_lanes, served(lanes)
        integer :: first, i, one, refused

        refused = status_ok
        in_lanes = body%status == status_ok .and. .not. body%needs_rotation .and. is_plain_time(body, h)
        block%transition = 0.0_wp
        !$omp parallel do if (n >= 64*lanes) firstprivate(block) private(served, i, one) &
        !$omp& reduction(max: refused)
        do first = 1, n, lanes
            served = .false.
            if (in_lanes .and. first + lanes - 1 <= n) then
                call step_block(body, h, m(1, first), q(1, first), transition(1, 1, first), block, served)
            end if
            if (all(served)) cycle
            do i = first, min(first + lanes - 1, n)
                if (served(i - first + 1)) cycle
                call tangent_body(body, h, m(:, i), one, 0, q(:, i), transition(:, :, i))
                refused = max(refused, one)
            end do
        end do
        !$omp end parallel do
        code = refused
    end subroutine tangent_many

    !> Advances those of a whole block that the lanes serve; the others are left as they are.
    subroutine step_block(body, h, m, q, transition, block, served)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3, lanes), q(4, lanes), transition(36, lanes)
        type(tangent_lanes), intent(inout) :: block
        logical, intent(out) :: served(lanes)
        integer :: l, i

        served = .false.
        do i = 1, 3
            do l = 1, lanes
                block%m(l, i) = m(body%order(i), l)
                block%q(l, i) = q(1 + body%order(i), l)
            end do
        end do
        do l = 1, lanes
            block%q(l, 0) = q(1, l)
        end do
        if (.not. all_plain(block)) return
        if (body%parity < 0.0_wp) call reflect(block)
        call step_lanes(body%alpha, body%beta, body%gamma, body%a(1), body%a(3), 0.5_wp*h, block)
        if (body%parity < 0.0_wp) call reflect(block)
        served = is_served(block%reach, block%square)
        if (all(served)) then
            call store(body%order, block, m, q, transition)
        else
            call store_some(body%order, block, served, m, q, transition)
        end if
    end subroutine step_block

    !> A block back to the bodies, its axes in the order of theirs.
    pure subroutine store(order, block, m, q, transition)
        integer, intent(in) :: order(3)
        type(tangent_lanes), intent(in) :: block
        real(wp), intent(inout) :: m(3, lanes), q(4, lanes), transition(36, lanes)
        real(wp) :: sorted(lanes, 36)
        integer :: l, i, k, from, place

        do i = 1, 3
            do l = 1, lanes
                m(order(i), l) = block%m(l, i)
                q(1 + order(i), l) = block%q(l, i)
            end do
        end do
        do l = 1, lanes
            q(1, l) = block%q(l, 0)
        end do
        if (all(order == [1, 2, 3])) then
            call transpose_into(block%transition, transition)
            return
        end if
        sorted = 0.0_wp
        do k = 1, 3
            do i = 1, 3
                from = i + 6*(k - 1)
                place = order(i) + 6*(order(k) - 1)
                sorted(:, place) = block%transition(:, from)
                sorted(:, place + 3) = block%transition(:, from + 3)
                sorted(:, place + 21) = block%transition(:, from + 21)
            end do
        end do
        call transpose_into(sorted, transition)
    end subroutine store

    !> The transposed of a matrix, four rows at a time, which fill a vector.
    pure subroutine transpose_into(x, y)
        real(wp), intent(in) :: x(lanes, 36)
        real(wp), intent(out) :: y(36, lanes)
        integer :: l, i

        do l = 1, lanes
            do i = 1, 33, 4
                y(i, l) = x(l, i)
                y(i + 1, l) = x(l, i + 1)
                y(i + 2, l) = x(l, i + 2)
                y(i + 3, l) = x(l, i + 3)
            end do
        end do
    end subroutine transpose_into

    !> The same for some of the lanes.
    pure subroutine store_some(order, block, served, m, q, transition)
        integer, intent(in) :: order(3)
        type(tangent_lanes), intent(in) :: block
        logical, intent(in) :: served(lanes)
        real(wp), intent(inout) :: m(3, lanes), q(4, lanes), transition(36, lanes)
        real(wp) :: all_m(3, lanes), all_q(4, lanes), all_transitions(36, lanes)
        integer :: l

        call store(order, block, all_m, all_q, all_transitions)
        do l = 1, lanes
            if (.not. served(l)) cycle
            m(:, l) = all_m(:, l)
            q(:, l) = all_q(:, l)
            transition(:, l) = all_transitions(:, l)
        end do
    end subroutine store_some

    !> To and from sorted axes that are right-handed: an odd sorting turns the last axis round.
    pure subroutine reflect(block)
        type(tangent_lanes), intent(inout) :: block
        integer, parameter :: crossed(12) = [3, 6, 9, 12, 13, 14, 16, 17, 24, 30, 34, 35]   ! once in axis 3
        integer :: i

        block%m(:, 3) = -block%m(:, 3)
        block%q(:, 3) = -block%q(:, 3)
        do i = 1, size(crossed)
            block%transition(:, crossed(i)) = -block%transition(:, crossed(i))
        end do
    end subroutine reflect

    !> Whether the largest components of all momenta and attitudes are plain numbers.
    pure function all_plain(block) result(plain)
        type(tangent_lanes), intent(in) :: block
        logical :: plain
        real(wp) :: size_m, size_q, least, most
        integer(int64) :: many
        integer :: l

        many = 0
        do l = 1, lanes
            size_m = 0.25_wp*abs(block%m(l, 1)) + (0.25_wp*abs(block%m(l, 2)) + 0.25_wp*abs(block%m(l, 3)))
            size_q = (0.25_wp*abs(block%q(l, 0)) + 0.25_wp*abs(block%q(l, 1))) &
                     + (0.25_wp*abs(block%q(l, 2)) + 0.25_wp*abs(block%q(l, 3)))
            size_m = merge(plain_largest, size_m, ieee_is_nan(size_m))      ! comparing a NaN raises a flag
            size_q = merge(plain_largest, size_q, ieee_is_nan(size_q))
            least = min(size_m, size_q)
            most = max(size_m, size_q)
            many = many + merge(1_int64, 0_int64, merge(least, 0.0_wp, most < plain_largest) > plain_smallest)
        end do
        plain = many == lanes
    end function all_plain

    !> Whether angles that the body turns in the time h stay far from overflow.
    pure function is_plain_time(body, h) result(plain)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        logical :: plain

        plain = ieee_is_finite(h)
        if (plain) plain = abs(h) > 0.0_wp .and. abs(h) < plain_largest .and. body%a(1) < plain_largest
        if (plain) plain = abs(body%a(1)*h) < plain_largest
    end function is_plain_time

end module frb_flow_tangent_many
