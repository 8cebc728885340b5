!> Many free bodies at once: blocks of them through SIMD lanes, blocks through threads.
module frb_flow_bodies
    use frb_flow_blocks, only: block_of_bodies, set_bodies, step_lanes
    use frb_flow_lanes, only: lanes, vector, workspace, is_served
    use frb_flow_limits, only: plain_largest, plain_smallest
    use frb_flow_one, only: flow_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_attitude, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: flow_many, check_many, flow_rows, all_finite

contains

    !> Many bodies in blocks, one per SIMD lane; body(:) holds one body for all or one for each, and so does
    !> h(:). The blocks are independent: with -fopenmp they are shared among the threads.
    subroutine flow_many(body, bodies, h, times, n, m, code, q)
        integer, intent(in) :: bodies, times, n     !! bodies and times: 1 or n
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        real(wp), intent(inout) :: m(3, n)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4, n)
        type(block_of_bodies) :: block
        integer :: first, count, refused

        call check_many(body, bodies, h, times, code)
        if (code /= status_ok .or. n == 0) return
        refused = status_ok
        call set_bodies(body, bodies, h, times, 1, min(n, lanes), block)
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

    !> One block: in place if all is plain and the lanes are whole vectors.
    subroutine flow_rows(body, bodies, h, times, first, count, block, m, refused, q)
        integer, intent(in) :: bodies, times, first, count
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(inout) :: m(3, count)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q(4, count)
        type(workspace) :: work
        real(wp) :: x(lanes, 3), copy_m(3, lanes), copy_q(4, lanes)
        logical :: good(lanes), served
        integer :: l, full, code

        if (block%all_plain .and. mod(count, vector) == 0) then
            call load_momenta(count, block, m, x, served)
            if (served .and. present(q)) served = all_finite(4*count, q)
            if (served) call step_lanes(count, present(q), block, x, work, served)
            if (served) then
                if (present(q)) call turn_attitudes(count, block, work, refused, q)
                call store_momenta(count, block, work, x, m)
                return
            end if
        end if
        full = vector*((count + vector - 1)/vector)
        do l = 1, count
            good(l) = abs(block%lane(l)) > 0.5_wp
            if (good(l)) good(l) = is_plain(m(:, l))
            if (good(l) .and. present(q)) good(l) = is_plain(q(:, l))
            copy_m(:, l) = 0.0_wp
            copy_q(:, l) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            if (.not. good(l)) cycle
            copy_m(:, l) = m(:, l)
            if (present(q)) copy_q(:, l) = q(:, l)
        end do
        copy_m(:, count + 1:full) = spread(copy_m(:, count), 2, full - count)
        copy_q(:, count + 1:full) = spread(copy_q(:, count), 2, full - count)
        call load_momenta(full, block, copy_m, x, served)
        call step_lanes(full, present(q), block, x, work, served)
        if (present(q)) call turn_attitudes(full, block, work, refused, copy_q)
        call store_momenta(full, block, work, x, copy_m)
        do l = 1, count
            code = status_ok
            if (good(l) .and. is_served(work%reach(l))) then
                m(:, l) = copy_m(:, l)
                if (present(q)) q(:, l) = copy_q(:, l)
            else
                associate (one => body(min(bodies, first + l - 1)), time => h(min(times, first + l - 1)))
                    if (present(q)) then
                        call flow_body(one, time, m(:, l), code, q(:, l))
                    else
                        call flow_body(one, time, m(:, l), code)
                    end if
                end associate
            end if
            refused = max(refused, code)
        end do
    end subroutine flow_rows

    !> Whether components are finite, far from overflow and, in their sum, not below the smallest.
    pure function is_plain(x) result(plain)
        real(wp), intent(in) :: x(:)
        logical :: plain

        plain = all(ieee_is_finite(x))
        if (plain) plain = all(abs(x) < plain_largest) .and. sum(abs(x)) >= plain_smallest
    end function is_plain

    !> Whether twice each number is finite.
    pure function all_finite(n, x) result(finite)
        integer, intent(in) :: n
        real(wp), intent(in) :: x(n)
        logical :: finite
        integer(int64) :: many
        integer :: l

        many = 0
        do l = 1, n
            many = many + merge(1_int64, 0_int64, ieee_is_finite(2*x(l)))
        end do
        finite = many == n
    end function all_finite

    !> Momenta as columns, each in the place of its cyclic axis if all bodies have the same; whether all are
    !> finite and far from overflow.
    subroutine load_momenta(n, block, m, x, plain)
        integer, intent(in) :: n
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(in) :: m(3, n)
        real(wp), intent(inout) :: x(lanes, 3)
        logical, intent(out) :: plain

        call load(n, m, x(1, block%column(1)), x(1, block%column(2)), x(1, block%column(3)), plain)
    end subroutine load_momenta

    pure subroutine load(n, m, x1, x2, x3, plain)
        integer, intent(in) :: n
        real(wp), intent(in) :: m(3, n)
        real(wp), intent(inout) :: x1(n), x2(n), x3(n)
        logical, intent(out) :: plain
        real(wp) :: m1, m2, m3, total
        integer(int64) :: many
        integer :: l

        many = 0
        do l = 1, n
            m1 = m(1, l)
            m2 = m(2, l)
            m3 = m(3, l)
            total = (0.25_wp*abs(m1) + 0.25_wp*abs(m2)) + 0.25_wp*abs(m3)       ! does not overflow
            total = merge(plain_largest, total, ieee_is_nan(total))     ! comparing a NaN raises a flag
            many = many + merge(1_int64, 0_int64, total < 0.25_wp*plain_largest)
            x1(l) = m1
            x2(l) = m2
            x3(l) = m3
        end do
        plain = many == n
    end subroutine load

    !> Momenta and their increments together, back in the place of m.
    subroutine store_momenta(n, block, work, x, m)
        integer, intent(in) :: n
        type(block_of_bodies), intent(in) :: block
        type(workspace), intent(in) :: work
        real(wp), intent(in) :: x(lanes, 3)
        real(wp), intent(inout) :: m(3, n)

        associate (c => block%column)
            call store(n, x(1, c(1)), x(1, c(2)), x(1, c(3)), work%d(1, c(1)), work%d(1, c(2)), &
                       work%d(1, c(3)), m)
        end associate
    end subroutine store_momenta

    pure subroutine store(n, x1, x2, x3, d1, d2, d3, m)
        integer, intent(in) :: n
        real(wp), intent(in) :: x1(n), x2(n), x3(n), d1(n), d2(n), d3(n)
        real(wp), intent(inout) :: m(3, n)
        integer :: l

        do l = 1, n
            m(1, l) = x1(l) + d1(l)
            m(2, l) = x2(l) + d2(l)
            m(3, l) = x3(l) + d3(l)
        end do
    end subroutine store

    !> q + q w. A body whose quaternion is zero is refused: it keeps its momentum too.
    subroutine turn_attitudes(n, block, work, refused, q)
        integer, intent(in) :: n
        type(block_of_bodies), intent(in) :: block
        type(workspace), intent(inout) :: work
        integer, intent(inout) :: refused
        real(wp), intent(inout) :: q(4, n)
        integer :: zeros, l

        call turn_rows(n, work%w0, work%w(1, block%column(1)), work%w(1, block%column(2)), &
                       work%w(1, block%column(3)), q, zeros)
        if (zeros == 0) return
        refused = max(refused, status_bad_attitude)
        do l = 1, n
            if (maxval(abs(q(:, l))) <= 0.0_wp) work%d(l, :) = -0.0_wp      ! m + d is then m, of zeros too
        end do
    end subroutine turn_attitudes

    pure subroutine turn_rows(n, w0, w1, w2, w3, q, zeros)
        integer, intent(in) :: n
        real(wp), intent(in) :: w0(n), w1(n), w2(n), w3(n)
        real(wp), intent(inout) :: q(4, n)
        integer, intent(out) :: zeros
        real(wp) :: q0, q1, q2, q3
        integer(int64) :: many
        integer :: l

        many = 0
        do l = 1, n
            q0 = q(1, l)
            q1 = q(2, l)
            q2 = q(3, l)
            q3 = q(4, l)
            many = many + merge(1_int64, 0_int64, (abs(q0) + abs(q1)) + (abs(q2) + abs(q3)) <= 0.0_wp)
            call turn(w0(l), w1(l), w2(l), w3(l), q0, q1, q2, q3)
            q(1, l) = q0
            q(2, l) = q1
            q(3, l) = q2
            q(4, l) = q3
        end do
        zeros = int(many)
    end subroutine turn_rows

    include 'turn_formulas.inc'

end module frb_flow_bodies
