!> Many free bodies whose states are columns: m1(n), m2(n), m3(n) and q0(n) to q3(n).
module frb_flow_columns
    use frb_flow_blocks, only: block_of_bodies, set_bodies, step_lanes
    use frb_flow_bodies, only: all_finite, check_many, flow_rows
    use frb_flow_lanes, only: lanes, vector, workspace
    use frb_flow_limits, only: plain_largest
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_attitude
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: flow_columns

contains

    !> As flow_many, on columns; q0 to q3 all or none. The results are those of flow_many to the last digits.
    subroutine flow_columns(body, bodies, h, times, n, m1, m2, m3, code, q0, q1, q2, q3)
        integer, intent(in) :: bodies, times, n     !! bodies and times: 1 or n
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        real(wp), intent(inout) :: m1(n), m2(n), m3(n)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q0(n), q1(n), q2(n), q3(n)
        type(block_of_bodies) :: block
        real(wp) :: m(3, lanes), q(4, lanes)
        logical :: served
        integer :: first, last, count, refused, i

        call check_many(body, bodies, h, times, code)
        if (code /= status_ok .or. n == 0) return
        refused = status_ok
        call set_bodies(body, bodies, h, times, 1, min(n, lanes), block)
        !$omp parallel do if (n >= 64*lanes) firstprivate(block) private(last, count, served, m, q, i) &
        !$omp& reduction(max: refused)
        do first = 1, n, lanes
            last = min(first + lanes - 1, n)
            count = last - first + 1
            if (max(bodies, times) > 1) call set_bodies(body, bodies, h, times, first, count, block)
            served = .false.
            if (block%all_plain .and. mod(count, vector) == 0) then
                if (present(q0)) then
                    call flow_whole(count, block, m1(first), m2(first), m3(first), served, refused, &
                                    q0(first), q1(first), q2(first), q3(first))
                else
                    call flow_whole(count, block, m1(first), m2(first), m3(first), served, refused)
                end if
            end if
            if (served) cycle
            ! What is not plain goes through rows.
            do i = 1, count
                m(:, i) = [m1(first + i - 1), m2(first + i - 1), m3(first + i - 1)]
            end do
            if (present(q0)) then
                do i = 1, count
                    q(:, i) = [q0(first + i - 1), q1(first + i - 1), q2(first + i - 1), q3(first + i - 1)]
                end do
                call flow_rows(body, bodies, h, times, first, count, block, m, refused, q)
                q0(first:last) = q(1, :count)
                q1(first:last) = q(2, :count)
                q2(first:last) = q(3, :count)
                q3(first:last) = q(4, :count)
            else
                call flow_rows(body, bodies, h, times, first, count, block, m, refused)
            end if
            m1(first:last) = m(1, :count)
            m2(first:last) = m(2, :count)
            m3(first:last) = m(3, :count)
        end do
        !$omp end parallel do
        code = refused
    end subroutine flow_columns

    !> Whole vectors of lanes in place, if all are plain; else, served = .false., they stay as they are.
    subroutine flow_whole(n, block, m1, m2, m3, served, refused, q0, q1, q2, q3)
        integer, intent(in) :: n
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(inout) :: m1(n), m2(n), m3(n)
        logical, intent(out) :: served
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q0(n), q1(n), q2(n), q3(n)
        type(workspace) :: work
        real(wp) :: x(lanes, 3)
        integer :: zeros, l

        associate (c => block%column)
            call load(n, m1, m2, m3, x(1, c(1)), x(1, c(2)), x(1, c(3)), served)
            if (served .and. present(q0)) served = all_finite(n, q0) .and. all_finite(n, q1) &
                .and. all_finite(n, q2) .and. all_finite(n, q3)
            if (served) call step_lanes(n, present(q0), block, x, work, served)
            if (.not. served) return
            if (present(q0)) then
                call turn_columns(n, work%w0, work%w(1, c(1)), work%w(1, c(2)), work%w(1, c(3)), q0, q1, q2, &
                                  q3, zeros)
                if (zeros > 0) then
                    refused = max(refused, status_bad_attitude)
                    do l = 1, n
                        if (maxval(abs([q0(l), q1(l), q2(l), q3(l)])) <= 0.0_wp) work%d(l, :) = -0.0_wp
                    end do
                end if
            end if
            m1 = m1 + work%d(:n, c(1))
            m2 = m2 + work%d(:n, c(2))
            m3 = m3 + work%d(:n, c(3))
        end associate
    end subroutine flow_whole

    !> A copy, and whether all are finite and far from overflow: as for rows.
    pure subroutine load(n, m1, m2, m3, x1, x2, x3, plain)
        integer, intent(in) :: n
        real(wp), intent(in) :: m1(n), m2(n), m3(n)
        real(wp), intent(inout) :: x1(n), x2(n), x3(n)
        logical, intent(out) :: plain
        real(wp) :: total
        integer(int64) :: many
        integer :: l

        many = 0
        do l = 1, n
            total = (0.25_wp*abs(m1(l)) + 0.25_wp*abs(m2(l))) + 0.25_wp*abs(m3(l))
            total = merge(plain_largest, total, ieee_is_nan(total))
            many = many + merge(1_int64, 0_int64, total < 0.25_wp*plain_largest)
            x1(l) = m1(l)
            x2(l) = m2(l)
            x3(l) = m3(l)
        end do
        plain = many == n
    end subroutine load

    !> q + q w, and how many quaternions are zero.
    pure subroutine turn_columns(n, w0, w1, w2, w3, q0, q1, q2, q3, zeros)
        integer, intent(in) :: n
        real(wp), intent(in) :: w0(n), w1(n), w2(n), w3(n)
        real(wp), intent(inout) :: q0(n), q1(n), q2(n), q3(n)
        integer, intent(out) :: zeros
        real(wp) :: total
        integer(int64) :: many
        integer :: l

        many = 0
        do l = 1, n
            total = (abs(q0(l)) + abs(q1(l))) + (abs(q2(l)) + abs(q3(l)))
            many = many + merge(1_int64, 0_int64, total <= 0.0_wp)
            call turn(w0(l), w1(l), w2(l), w3(l), q0(l), q1(l), q2(l), q3(l))
        end do
        zeros = int(many)
    end subroutine turn_columns

    include 'turn_formulas.inc'

end module frb_flow_columns
