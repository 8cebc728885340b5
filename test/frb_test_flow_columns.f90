!> More ways to call free_flow for many bodies: columns, each body with its own time, matrices, bodies by
!> tensor in blocks. Each is compared with a call that other suites test.
module frb_test_flow_columns
    use frb, only: wp, rigid_body, free_flow, free_flow_columns, quat_to_matrix, status_ok, &
        status_bad_momentum, status_bad_attitude, status_bad_time, status_bad_count, status_bad_moments
    use frb_checks, only: tally, largest, worst_of
    use frb_flow_samples, only: stream, no_rotation, same_bits
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: test_flow_columns

    integer, parameter :: n = 300
    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Largest difference of a batch from one body at a time, relative to the angles turned.
    real(wp), parameter :: same_motion = 16*eps

    !> Bodies, times and states of all sorts.
    type :: sample
        type(rigid_body) :: body(n)
        real(wp) :: h(n), m(3, n), q(4, n)
    end type sample

contains

    subroutine test_flow_columns(t)
        type(tally), intent(inout) :: t
        type(sample), allocatable :: some

        call t%open_suite('flow-columns', 17)
        allocate (some)
        call draw(some)
        call check_columns(t, some)
        call check_times(t, some)
        call check_matrices(t, some)
        call check_refused(t, some)
        call check_counts(t, some)
        call t%close_suite()
    end subroutine test_flow_columns

    !> Moments in any order, symmetric ones, tensors; short, middle and long steps side by side.
    subroutine draw(some)
        type(sample), intent(out) :: some
        type(stream) :: random
        real(wp) :: r(3, 3), tensor(3, 3), q(4), moments(3)
        integer :: i

        do i = 1, n
            moments = cshift(random%triangle(), int(random%uniform(0.0_wp, 3.0_wp)))
            if (mod(i, 2) == 0) moments = moments([2, 1, 3])
            if (mod(i, 7) == 0) moments(1) = moments(2)
            q = [random%uniform(-1.0_wp, 1.0_wp), random%direction()]
            q = q/norm2(q)
            r = quat_to_matrix(q)
            tensor = matmul(r, transpose(spread(moments, 1, 3)*r))
            some%body(i) = rigid_body(moments)
            if (mod(i, 5) == 0) some%body(i) = rigid_body(0.5_wp*(tensor + transpose(tensor)))
            some%h(i) = random%log_uniform(-3.0_wp, 1.0_wp)*sign(1.0_wp, random%uniform(-1.0_wp, 1.0_wp))
            some%m(:, i) = random%direction()
            some%q(:, i) = q
        end do
    end subroutine draw

    !> States first to last as columns, by one call for equal (1) or different bodies and times.
    subroutine by_columns(some, bodies, times, first, last, m, stat, q)
        type(sample), intent(in) :: some
        integer, intent(in) :: bodies, times, first, last
        real(wp), intent(inout) :: m(:, :)
        integer, intent(out) :: stat
        real(wp), intent(inout), optional :: q(:, :)
        real(wp) :: x(n, 3), y(n, 0:3)
        integer :: i

        i = last - first + 1
        x(:i, :) = transpose(m(:, first:last))
        if (present(q)) then
            y(:i, :) = transpose(q(:, first:last))
            if (bodies == 1 .and. times == 1) then
                call free_flow_columns(some%body(1), some%h(1), x(:i, 1), x(:i, 2), x(:i, 3), &
                                       y(:i, 0), y(:i, 1), y(:i, 2), y(:i, 3), stat)
            else if (bodies == 1) then
                call free_flow_columns(some%body(1), some%h(first:last), x(:i, 1), x(:i, 2), x(:i, 3), &
                                       y(:i, 0), y(:i, 1), y(:i, 2), y(:i, 3), stat)
            else if (times == 1) then
                call free_flow_columns(some%body(first:last), some%h(1), x(:i, 1), x(:i, 2), x(:i, 3), &
                                       y(:i, 0), y(:i, 1), y(:i, 2), y(:i, 3), stat)
            else
                call free_flow_columns(some%body(first:last), some%h(first:last), x(:i, 1), x(:i, 2), &
                                       x(:i, 3), y(:i, 0), y(:i, 1), y(:i, 2), y(:i, 3), &
                                       stat)
            end if
            q(:, first:last) = transpose(y(:i, :))
        else if (bodies == 1) then
            call free_flow_columns(some%body(1), some%h(1), x(:i, 1), x(:i, 2), x(:i, 3), stat=stat)
        else
            call free_flow_columns(some%body(first:last), some%h(first:last), x(:i, 1), x(:i, 2), x(:i, 3), &
                                   stat=stat)
        end if
        m(:, first:last) = transpose(x(:i, :))
    end subroutine by_columns

    !> Columns give the bits of rows, however split.
    subroutine check_columns(t, some)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: some
        integer, parameter :: splits(4) = [n, 64, 24, 7]
        character(*), parameter :: names(4) = [character(30) :: 'equal-bodies', 'equal-bodies-own-times', &
            'different-bodies', 'different-bodies-own-times']
        real(wp) :: m(3, n), q(4, n), alone(3, n), mc(3, n), qc(4, n)
        logical :: bits, apart
        integer :: form, k, first, last, stat, bodies, times

        do form = 1, 4
            bodies = merge(1, n, form <= 2)
            times = merge(1, n, mod(form, 2) == 1)
            m = some%m
            q = some%q
            alone = m
            if (form == 1) call free_flow(some%body(1), some%h(1), m, q)
            if (form == 2) call free_flow(some%body(1), some%h, m, q)
            if (form == 3) call free_flow(some%body, some%h(1), m, q)
            if (form == 4) call free_flow(some%body, some%h, m, q)
            if (form == 1) call free_flow(some%body(1), some%h(1), alone)
            if (form == 2) call free_flow(some%body(1), some%h, alone)
            if (form == 3) call free_flow(some%body, some%h(1), alone)
            if (form == 4) call free_flow(some%body, some%h, alone)
            bits = .true.
            do k = 1, size(splits)
                mc = some%m
                qc = some%q
                do first = 1, n, splits(k)
                    last = min(first + splits(k) - 1, n)
                    call by_columns(some, bodies, times, first, last, mc, stat, qc)
                    bits = bits .and. stat == status_ok
                end do
                bits = bits .and. same_bits([mc], [m]) .and. same_bits([qc], [q])
            end do
            call t%ok('columns-give-the-bits-of-rows: '//trim(names(form)), bits)
            ! Without attitude the momenta are the same to a unit in the last place of |m| = 1.
            if (form == 1 .or. form == 4) then
                mc = some%m
                call by_columns(some, bodies, times, 1, n, mc, stat)
                apart = stat == status_ok .and. maxval(abs(mc - m)) <= eps
                call t%ok('columns-of-momenta-alone: '//trim(names(form)), apart)
            end if
            call t%at_most('momenta-alone-to-a-unit: '//trim(names(form)), largest([abs(alone - m)]), eps)
        end do
    end subroutine check_columns

    !> A time and a body of its own for each state, tensors among them, against one body at a time.
    subroutine check_times(t, some)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: some
        real(wp) :: m(3, n), q(4, n), one_m(3), one_q(4), worst, turned
        integer :: i, k

        do k = 1, 2
            m = some%m
            q = some%q
            if (k == 1) call free_flow(some%body(5), some%h, m, q)      ! by tensor
            if (k == 2) call free_flow(some%body, some%h, m, q)
            worst = 0.0_wp
            do i = 1, n
                one_m = some%m(:, i)
                one_q = some%q(:, i)
                call free_flow(some%body(merge(5, i, k == 1)), some%h(i), one_m, one_q)
                turned = 1 + abs(some%h(i))/minval(some%body(merge(5, i, k == 1))%moments())
                worst = worst_of(worst, norm2([one_m - m(:, i), one_q - q(:, i)])/turned)
            end do
            call t%at_most('own-times-as-one-by-one: '//merge('by a tensor', 'all kinds  ', k == 1), worst, &
                           same_motion)
        end do
    end subroutine check_times

    !> Matrices as quaternions.
    subroutine check_matrices(t, some)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: some
        real(wp) :: m(3, n), q(4, n), mq(3, n), a(3, 3, n), worst
        integer :: i, k, stat

        worst = 0.0_wp
        do k = 1, 4
            m = some%m
            mq = some%m
            q = some%q
            do i = 1, n
                a(:, :, i) = quat_to_matrix(q(:, i))
            end do
            select case (k)
            case (1)
                call free_flow(some%body(1), 0.3_wp, m, a, stat)
                call free_flow(some%body(1), 0.3_wp, mq, q)
            case (2)
                call free_flow(some%body, 0.3_wp, m, a, stat)
                call free_flow(some%body, 0.3_wp, mq, q)
            case (3)
                call free_flow(some%body(1), some%h, m, a, stat)
                call free_flow(some%body(1), some%h, mq, q)
            case default
                call free_flow(some%body, some%h, m, a, stat)
                call free_flow(some%body, some%h, mq, q)
            end select
            do i = 1, n
                worst = worst_of(worst, [abs(a(:, :, i) - quat_to_matrix(q(:, i)))])
            end do
            if (stat /= status_ok .or. .not. same_bits([m], [mq])) worst = huge(worst)
        end do
        call t%at_most('matrices-turn-as-quaternions', worst, same_motion)
        a = spread(no_rotation, 3, n)
        a(2, 3, 77) = ieee_value(1.0_wp, ieee_positive_inf)
        m = some%m
        call free_flow(some%body(1), 0.3_wp, m, a, stat)
        call t%ok('a-matrix-that-is-not-finite-is-refused', stat == status_bad_attitude &
                  .and. same_bits(m(:, 77), some%m(:, 77)) &
                  .and. same_bits([a(:, :2, 77)], [no_rotation(:, :2)]) &
                  .and. maxval(abs(m(:, 78) - some%m(:, 78))) > 1.0e-3_wp)
    end subroutine check_matrices

    !> States that are refused stay, and the others move.
    subroutine check_refused(t, some)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: some
        type(sample), allocatable :: bad
        real(wp) :: m(3, n), q(4, n), good_m(3, n), good_q(4, n)
        logical :: right
        integer :: form, stat, i, expected

        good_m = some%m
        good_q = some%q
        call by_columns(some, n, n, 1, n, good_m, stat, good_q)
        right = .true.
        do form = 1, 4
            bad = some
            i = 40 + 17*form
            expected = status_bad_attitude
            if (form == 1) bad%q(:, i) = 0.0_wp
            if (form == 2) bad%m(3, i) = ieee_value(1.0_wp, ieee_quiet_nan)
            if (form == 3) bad%h(i) = ieee_value(1.0_wp, ieee_positive_inf)
            if (form == 4) bad%body(i) = rigid_body([1.0_wp, -1.0_wp, 1.0_wp])
            if (form == 2) expected = status_bad_momentum
            if (form == 3) expected = status_bad_time
            if (form == 4) expected = status_bad_moments
            m = bad%m
            q = bad%q
            call by_columns(bad, n, n, 1, n, m, stat, q)
            right = right .and. stat == expected .and. same_bits(m(:, i), bad%m(:, i)) &
                .and. same_bits(q(:, i), bad%q(:, i))
            m(:, i) = good_m(:, i)
            q(:, i) = good_q(:, i)
            right = right .and. same_bits([m], [good_m]) .and. same_bits([q], [good_q])
        end do
        call t%ok('refused-columns-stay-and-the-others-go-on', right)
    end subroutine check_refused

    !> Sizes that do not match.
    subroutine check_counts(t, some)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: some
        real(wp) :: m(3, n), q(4, n), a(3, 3, n), x(n, 3), y(n, 0:3)
        integer :: stat(11)

        m = some%m
        q = some%q
        a = spread(no_rotation, 3, n)
        x = transpose(m)
        y = transpose(q)
        call free_flow(some%body(1), some%h(2:), m, q, stat(1))
        call free_flow(some%body(1:1), some%h, m, q, stat(2))
        call free_flow(some%body, some%h(2:), m, stat(3))
        call free_flow(some%body(1), 1.0_wp, m, a(:, :, 2:), stat(4))
        call free_flow(some%body(2:), some%h, m, a, stat(5))
        call free_flow_columns(some%body(1), 1.0_wp, x(2:, 1), x(:, 2), x(:, 3), stat=stat(6))
        call free_flow_columns(some%body(1), 1.0_wp, x(:, 1), x(:, 2), x(:, 3), y(:, 0), y(:, 1), &
                               stat=stat(7))
        call free_flow_columns(some%body(1), 1.0_wp, x(:, 1), x(:, 2), x(:, 3), y(:, 0), y(:, 1), y(2:, 2), &
                               y(:, 3), stat(8))
        call free_flow_columns(some%body(2:), some%h, x(:, 1), x(:, 2), x(:, 3), stat=stat(9))
        call free_flow(some%body, some%h(:1), m, q, stat(10))
        call free_flow_columns(some%body(:1), some%h, x(:, 1), x(:, 2), x(:, 3), stat=stat(11))
        call t%ok('sizes-that-do-not-match-are-refused', all(stat == status_bad_count))
        call t%ok('and-left-alone', same_bits([m], [some%m]) .and. same_bits([q], [some%q]) &
                  .and. same_bits([transpose(x)], [some%m]))
    end subroutine check_counts

end module frb_test_flow_columns
