!> Many free bodies at once: the bodies of a block share SIMD lanes, blocks are shared among threads. Blocks
!> have states as columns: states in rows are copied; states in columns that fill whole vectors move in place.
module frb_flow_bodies
    use frb_flow_blocks, only: block_of_bodies, set_bodies, step_lanes, whole
    use frb_flow_lanes, only: lanes, workspace
    use frb_flow_lanes_long, only: is_near
    use frb_flow_limits, only: plain_largest, plain_smallest
    use frb_flow_one, only: flow_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: flow_many, flow_columns

    logical, parameter :: none(lanes) = .false.

contains

    !> Many bodies in blocks, one per SIMD lane; body(:) holds one body for all or one for each, and so does
    !> h(:). The blocks are independent: with -fopenmp they are shared among the threads. What becomes of a
    !> body does not depend on the others: the same bits for any threads and parts of a batch. (So one body
    !> takes a block too, though a call for it alone is faster.)
    subroutine flow_many(body, bodies, alike, h, times, n, m, code, q)
        integer, intent(in) :: bodies, times, n     !! bodies and times: 1 or n
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike                !! body(1) is meant for all, whatever n
        real(wp), intent(in) :: h(times)
        real(wp), intent(inout) :: m(3, n)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4, n)
        type(block_of_bodies) :: block
        integer :: first, count, refused

        call check_many(body, bodies, h, times, code)
        if (code /= status_ok .or. n == 0) return
        refused = status_ok
        block%of%alike = alike
        if (max(bodies, times) == 1) call set_bodies(body, bodies, h, times, 1, min(n, lanes), block)
        !$omp parallel do if (n >= 64*lanes) firstprivate(block) private(count) reduction(max: refused)
        do first = 1, n, lanes
            count = min(lanes, n - first + 1)
            if (max(bodies, times) > 1) call set_bodies(body, bodies, h, times, first, count, block)
            if (present(q)) then
                call flow_rows(body, bodies, h, times, first, count, block, m(1, first), refused, q(1, first))
            else
                call flow_rows(body, bodies, h, times, first, count, block, m(1, first), refused)
            end if
        end do
        !$omp end parallel do
        code = refused
    end subroutine flow_many

    !> The same with states in columns, q0 to q3 all or none: the same bits.
    subroutine flow_columns(body, bodies, alike, h, times, n, m1, m2, m3, code, q0, q1, q2, q3)
        integer, intent(in) :: bodies, times, n     !! bodies and times: 1 or n
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike                !! body(1) is meant for all, whatever n
        real(wp), intent(in) :: h(times)
        real(wp), intent(inout) :: m1(n), m2(n), m3(n)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q0(n), q1(n), q2(n), q3(n)
        type(block_of_bodies) :: block
        type(workspace) :: work
        real(wp) :: x(lanes, 3), y(lanes, 4)
        logical :: served
        integer :: first, last, count, refused

        call check_many(body, bodies, h, times, code)
        if (code /= status_ok .or. n == 0) return
        refused = status_ok
        block%of%alike = alike
        if (max(bodies, times) == 1) call set_bodies(body, bodies, h, times, 1, min(n, lanes), block)
        !$omp parallel do if (n >= 64*lanes) firstprivate(block) private(last, count, served, x, y, work) &
        !$omp& reduction(max: refused)
        do first = 1, n, lanes
            last = min(first + lanes - 1, n)
            count = last - first + 1
            if (max(bodies, times) > 1) call set_bodies(body, bodies, h, times, first, count, block)
            served = .false.
            if (block%all_plain .and. count == whole(count)) then
                if (present(q0)) then
                    call flow_whole(count, block, .false., work, served, m1(first), m2(first), m3(first), &
                                    q0(first), q1(first), q2(first), q3(first))
                else
                    call flow_whole(count, block, .false., work, served, m1(first), m2(first), m3(first))
                end if
            end if
            if (served) cycle
            x(:count, 1) = m1(first:last)
            x(:count, 2) = m2(first:last)
            x(:count, 3) = m3(first:last)
            if (present(q0)) then
                y(:count, 1) = q0(first:last)
                y(:count, 2) = q1(first:last)
                y(:count, 3) = q2(first:last)
                y(:count, 4) = q3(first:last)
            end if
            call flow_block(body, bodies, h, times, first, count, block, present(q0), x, y, refused)
            m1(first:last) = x(:count, 1)
            m2(first:last) = x(:count, 2)
            m3(first:last) = x(:count, 3)
            if (.not. present(q0)) cycle
            q0(first:last) = y(:count, 1)
            q1(first:last) = y(:count, 2)
            q2(first:last) = y(:count, 3)
            q3(first:last) = y(:count, 4)
        end do
        !$omp end parallel do
        code = refused
    end subroutine flow_columns

    !> Whether the only body or the only time is refused, and so all states are.
    pure subroutine check_many(body, bodies, h, times, code)
        integer, intent(in) :: bodies, times
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        integer, intent(out) :: code

        code = status_ok
        if (bodies == 1) code = body(1)%status
        if (code /= status_ok .or. times /= 1) return
        if (.not. ieee_is_finite(h(1))) code = status_bad_time
    end subroutine check_many

    !> One block of rows. Storing four columns as rows by vectors takes longer than by numbers: GCC shuffles
    !> each vector four times.
    subroutine flow_rows(body, bodies, h, times, first, count, block, m, refused, q)
        integer, intent(in) :: bodies, times, first, count
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(inout) :: m(3, count)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q(4, count)
        real(wp) :: x(lanes, 3), y(lanes, 4)
        integer :: l

        do l = 1, count
            x(l, 1) = m(1, l)
            x(l, 2) = m(2, l)
            x(l, 3) = m(3, l)
        end do
        if (present(q)) then
            do l = 1, count
                y(l, 1) = q(1, l)
                y(l, 2) = q(2, l)
                y(l, 3) = q(3, l)
                y(l, 4) = q(4, l)
            end do
        end if
        call flow_block(body, bodies, h, times, first, count, block, present(q), x, y, refused)
        do l = 1, count
            m(1, l) = x(l, 1)
            m(2, l) = x(l, 2)
            m(3, l) = x(l, 3)
        end do
        if (.not. present(q)) return
        !GCC$ novector
        do l = 1, count
            q(1, l) = y(l, 1)
            q(2, l) = y(l, 2)
            q(3, l) = y(l, 3)
            q(4, l) = y(l, 4)
        end do
    end subroutine flow_rows

    !> One block, its states in columns with room for whole vectors. Bodies that the lanes cannot move are
    !> moved by flow_body.
    subroutine flow_block(body, bodies, h, times, first, count, block, with_attitude, x, y, refused)
        integer, intent(in) :: bodies, times, first, count
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        type(block_of_bodies), intent(in) :: block
        logical, intent(in) :: with_attitude
        real(wp), intent(inout) :: x(lanes, 3), y(lanes, 4)
        integer, intent(inout) :: refused
        type(workspace) :: work
        real(wp) :: new_x(lanes, 3), new_y(lanes, 4)
        logical :: good(lanes), served
        integer :: l, full

        full = whole(count)
        do l = count + 1, full
            x(l, :) = x(count, :)
            if (with_attitude) y(l, :) = y(count, :)
        end do
        if (block%all_plain) then
            call flow_lanes(.false., x, y)
            if (served) return
            if (.not. any(is_near(work%reach(:count)))) then
                call flow_rest(body, bodies, h, times, first, count, none, with_attitude, x, y, refused)
                return
            end if
        end if
        do l = 1, full
            good(l) = abs(block%lane(l)) > 0.5_wp .and. plain_momentum(x(l, 1), x(l, 2), x(l, 3)) > 0
            if (good(l) .and. with_attitude) then
                good(l) = plain_attitude(y(l, 1), y(l, 2), y(l, 3), y(l, 4)) > 0
            end if
            new_x(l, :) = 0.0_wp
            new_y(l, :) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            if (.not. good(l)) cycle
            new_x(l, :) = x(l, :)
            if (with_attitude) new_y(l, :) = y(l, :)
        end do
        call flow_lanes(.true., new_x, new_y)
        good(:count) = good(:count) .and. is_near(work%reach(:count))
        do l = 1, count
            if (.not. good(l)) cycle
            x(l, :) = new_x(l, :)
            if (with_attitude) y(l, :) = new_y(l, :)
        end do
        call flow_rest(body, bodies, h, times, first, count, good, with_attitude, x, y, refused)

    contains

        !> The states u, v of all lanes, whole vectors or a part.
        subroutine flow_lanes(in_part, u, v)
            logical, intent(in) :: in_part
            real(wp), intent(inout) :: u(lanes, 3), v(lanes, 4)

            if (with_attitude) then
                call flow_whole(full, block, in_part, work, served, u(:, 1), u(:, 2), u(:, 3), v(:, 1), &
                                v(:, 2), v(:, 3), v(:, 4))
            else
                call flow_whole(full, block, in_part, work, served, u(:, 1), u(:, 2), u(:, 3))
            end if
        end subroutine flow_lanes

    end subroutine flow_block

    !> The bodies of a block that are not `done`, one after another.
    subroutine flow_rest(body, bodies, h, times, first, count, done, with_attitude, x, y, refused)
        integer, intent(in) :: bodies, times, first, count
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        logical, intent(in) :: done(count), with_attitude
        real(wp), intent(inout) :: x(lanes, 3), y(lanes, 4)
        integer, intent(inout) :: refused
        real(wp) :: m(3), q(4)
        integer :: l

        do l = 1, count
            if (done(l)) cycle
            m = x(l, :)
            if (with_attitude) then
                q = y(l, :)
                call flow_single(body, bodies, h, times, first + l - 1, m, refused, q)
                y(l, :) = q
            else
                call flow_single(body, bodies, h, times, first + l - 1, m, refused)
            end if
            x(l, :) = m
        end do
    end subroutine flow_rest

    !> Body number k by itself.
    subroutine flow_single(body, bodies, h, times, k, m, refused, q)
        integer, intent(in) :: bodies, times, k
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        real(wp), intent(inout) :: m(3)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q(4)
        integer :: code

        if (present(q)) then
            call flow_body(body(min(bodies, k)), h(min(times, k)), m, code, q)
        else
            call flow_body(body(min(bodies, k)), h(min(times, k)), m, code)
        end if
        refused = max(refused, code)
    end subroutine flow_single

    !> Whole vectors of lanes in columns, all plain or, served = .false., as they were. Lanes out of reach
    !> stay behind if in_part; otherwise there is no step if there are such lanes.
    subroutine flow_whole(n, block, in_part, work, served, m1, m2, m3, q0, q1, q2, q3)
        integer, intent(in) :: n
        type(block_of_bodies), intent(in) :: block
        logical, intent(in) :: in_part
        type(workspace), intent(inout) :: work
        logical, intent(out) :: served
        real(wp), intent(inout) :: m1(n), m2(n), m3(n)
        real(wp), intent(inout), optional :: q0(n), q1(n), q2(n), q3(n)
        integer(int64) :: many
        integer :: l

        many = 0
        do l = 1, n
            many = many + plain_momentum(m1(l), m2(l), m3(l))
        end do
        if (present(q0)) then
            do l = 1, n
                many = many + plain_attitude(q0(l), q1(l), q2(l), q3(l))
            end do
            many = many - n
        end if
        served = many == n
        if (.not. served) then
            work%reach(:n) = 0.0_wp     ! not known
            return
        end if
        call step_lanes(n, present(q0), block, m1, m2, m3, work, served)
        if (.not. (served .or. in_part)) return
        associate (c => block%column)
            call add(n, work%d(1, c(1)), m1)
            call add(n, work%d(1, c(2)), m2)
            call add(n, work%d(1, c(3)), m3)
            if (.not. present(q0)) return
            call turn_columns(n, work%w0, work%w(1, c(1)), work%w(1, c(2)), work%w(1, c(3)), q0, q1, q2, q3)
        end associate
    end subroutine flow_whole

    !> 1 if the components are finite and far from overflow, else 0. Comparing a NaN would raise a flag.
    pure function plain_momentum(m1, m2, m3) result(one)
        real(wp), intent(in) :: m1, m2, m3
        integer(int64) :: one
        real(wp) :: total

        total = (0.25_wp*abs(m1) + 0.25_wp*abs(m2)) + 0.25_wp*abs(m3)       ! does not overflow
        total = merge(plain_largest, total, ieee_is_nan(total))
        one = merge(1_int64, 0_int64, total < 0.25_wp*plain_largest)
    end function plain_momentum

    !> 1 if the components are finite, far from overflow and not all near zero, else 0.
    pure function plain_attitude(q0, q1, q2, q3) result(one)
        real(wp), intent(in) :: q0, q1, q2, q3
        integer(int64) :: one
        real(wp) :: total

        total = (0.25_wp*abs(q0) + 0.25_wp*abs(q1)) + (0.25_wp*abs(q2) + 0.25_wp*abs(q3))
        total = merge(plain_largest, total, ieee_is_nan(total))
        total = merge(plain_largest, total, total < plain_smallest)
        one = merge(1_int64, 0_int64, total < 0.25_wp*plain_largest)
    end function plain_attitude

    !> m + d.
    pure subroutine add(n, d, m)
        integer, intent(in) :: n
        real(wp), intent(in) :: d(n)
        real(wp), intent(inout) :: m(n)

        m = m + d
    end subroutine add

    !> q + q w.
    pure subroutine turn_columns(n, w0, w1, w2, w3, q0, q1, q2, q3)
        integer, intent(in) :: n
        real(wp), intent(in) :: w0(n), w1(n), w2(n), w3(n)
        real(wp), intent(inout) :: q0(n), q1(n), q2(n), q3(n)
        integer :: l

        do l = 1, n
            call turn(w0(l), w1(l), w2(l), w3(l), q0(l), q1(l), q2(l), q3(l))
        end do
    end subroutine turn_columns

    include 'turn_formulas.inc'

end module frb_flow_bodies
