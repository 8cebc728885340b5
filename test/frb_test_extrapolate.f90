!> `extrapolate`: order, tolerances, times, observers, many bodies, refusals.
module frb_test_extrapolate
    use frb_checks, only: largest, tally, worst_of
    use frb_extrapolation, only: extrapolate, extrapolation_report
    use frb_extrapolation_sets, only: half, last_differences, last_weights, stages, torques_of_step
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp
    use frb_scenes, only: heavy_top
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    use frb_status, only: status_ok, status_bad_attitude, status_bad_count, status_bad_moments, &
        status_bad_momentum, status_bad_option, status_bad_time, status_stopped
    use frb_torque_cases, only: top_case, known_top, distance, recorder, spoilt_torque
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: test_extrapolate

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_extrapolate(t)
        type(tally), intent(inout) :: t

        call t%open_suite('extrapolate', 102)
        call test_order(t)
        call test_weights(t)
        call test_tolerances(t)
        call test_free(t)
        call test_times(t)
        call test_observers(t)
        call test_many(t)
        call test_refused(t)
        call t%close_suite()
    end subroutine test_extrapolate

    !> Order 14 with fixed steps, 12 for loose tolerances, and an estimate that is not too low.
    subroutine test_order(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(extrapolation_report) :: report
        real(wp) :: m(3), q(4), error(2), order_seen, m_ref(3), q_ref(4), h
        integer, parameter :: steps(2, 4) = reshape([8, 13, 10, 16, 14, 22, 16, 36], [2, 4])
        integer, parameter :: tops(4) = [2, 2, 3, 2]
        ! The tolerance chooses the sequences: 0 those for the last digits.
        real(wp), parameter :: tolerances(4) = [0.0_wp, 1.0e-9_wp, 1.0e-9_wp, 1.0e-4_wp]
        integer :: i, k

        do k = 1, 4
            item = known_top(tops(k))
            do i = 1, 2
                m = item%m0
                q = item%q0
                call extrapolate(item%body, item%top, item%t, m, q, tolerances(k), step=item%t/steps(i, k), &
                                 report=report)
                error(i) = distance(m, q, item%m, item%q)
                call t%equal('fixed-steps-are-as-many-as-asked-for', int(report%steps), steps(i, k))
            end do
            order_seen = log(error(1)/error(2))/log(real(steps(2, k), wp)/steps(1, k))
            ! With these sequences errors fall faster than order 14 until they reach rounding.
            if (k < 4) call t%ok('order-fourteen-is-kept-or-passed', order_seen > 14.0_wp)
            if (k == 4) call t%close_to('order-twelve-shows-for-a-loose-tolerance', order_seen, 12.0_wp, &
                                        1.0_wp)
        end do
        do k = 1, 3
            item = known_top(k)
            do i = 1, 3
                h = merge(3.0_wp, 0.4_wp, k == 1)*i
                m = item%m0
                q = item%q0
                call extrapolate(item%body, item%top, h, m, q, 1.0e-9_wp, step=h, report=report)
                m_ref = item%m0
                q_ref = item%q0
                call integrate(item%body, splitting_scheme('srkn17'), item%top, h/100, 100, m_ref, q_ref, &
                               compensated=.true.)
                error(1) = distance(m, q, m_ref, q_ref)
                call t%at_most('the-error-of-a-step-is-at-most-six-times-its-estimate', error(1), &
                               6*report%largest_error + 20*eps)
            end do
        end do
    end subroutine test_order

    !> The weights of the sequences: their sum is 1, and they cancel all powers of the step that their number
    !> allows; those of the estimate one power less. Both to the rounding of the weights and of their sum.
    subroutine test_weights(t)
        type(tally), intent(inout) :: t
        integer, parameter :: order_of_set(3) = [14, 14, 12]
        real(wp), allocatable :: n(:, :), c(:, :), d(:, :)
        real(wp) :: sums(0:6), left(0:6)
        integer :: set, j, last

        do set = 1, 3
            allocate (n, source=0.5_wp/max(half(:, :stages(set), set), 0.01_wp))
            allocate (c, source=last_weights(:, :stages(set), set))
            allocate (d, source=last_differences(:, :stages(set), set))
            last = order_of_set(set)/2 - 1
            do j = 0, last
                sums(j) = sum(c/n**(2*j))
                left(j) = sum(d/n**(2*j))
            end do
            call t%equal('as-many-sequences-as-the-order-needs', count(abs(c) > 0.0_wp), last + 1)
            call t%close_to('weights-have-the-sum-one', sums(0), 1.0_wp, eps*sum(abs(c)))
            call t%at_most('weights-cancel-even-powers', largest(abs(sums(1:last))), eps*sum(abs(c)))
            call t%at_most('weights-of-the-estimate-cancel-even-powers', &
                           largest(abs(left(:last - 1))), eps*sum(abs(d)))
            call t%ok('the-estimate-has-the-last-power', abs(left(last)) > 1.0e-12_wp)
            call t%equal('torques-of-a-step', torques_of_step(set), nint(sum(n, mask=abs(c) > 0.0_wp)))
            deallocate (n, c, d)
        end do
    end subroutine test_weights

    !> Tolerances from 1 to 0: every run ends, and reports the tolerance that it kept.
    subroutine test_tolerances(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: tolerances(7) = [1.0_wp, 0.1_wp, 1.0e-13_wp, 1.0e-15_wp, 1.0e-20_wp, &
                                                tiny(1.0_wp), 0.0_wp]
        type(top_case) :: item
        type(extrapolation_report) :: report
        real(wp) :: m(3), q(4)
        integer :: i, k, stat

        do k = 1, 2
            item = known_top(k)
            do i = 1, size(tolerances)
                m = item%m0
                q = item%q0
                call extrapolate(item%body, item%top, item%t, m, q, tolerances(i), stat=stat, report=report)
                call t%ok('every-tolerance-ends', stat == status_ok .and. report%steps < 200 &
                          .and. report%rejected < 100)
                call t%ok('the-tolerance-held-is-told', report%tolerance >= tolerances(i) &
                          .and. report%largest_error <= report%tolerance)
            end do
            call t%at_most('no-tolerance-asks-for-all-digits', distance(m, q, item%m, item%q), 2.0e-12_wp)
        end do
    end subroutine test_tolerances

    !> Without a torque the result is that of the free flow in one step, to the bit.
    subroutine test_free(t)
        type(tally), intent(inout) :: t
        type(spoilt_torque) :: none
        type(rigid_body) :: body
        type(extrapolation_report) :: report
        real(wp) :: m(3), q(4), m_free(3), q_free(4), h
        integer :: i

        none%until = huge(1.0_wp)
        do i = 1, 3
            body = rigid_body([1.0_wp, 1.5_wp, 2.0_wp])
            if (i == 2) body = rigid_body([0.0_wp, 1.0_wp, 1.0_wp])
            m = [0.0_wp, -0.3_wp, 0.5_wp]
            q = [0.5_wp, -0.5_wp, 0.5_wp, 0.5_wp]
            h = merge(-1.0e5_wp, 1.0e3_wp, i == 3)
            m_free = m
            q_free = q
            call free_flow(body, h, m_free, q_free)
            call extrapolate(body, none, h, m, q, 1.0e-6_wp, report=report)
            call t%at_most('a-free-body-moves-exactly', distance(m, q, m_free, q_free), 0.0_wp)
            call t%equal('a-free-body-takes-one-step', int(report%steps + report%rejected), 1)
        end do
        ! The separatrix, alone and with a torque that leaves it alone for a while.
        body = rigid_body([1.0_wp, 2.0_wp, 3.0_wp])
        m = [sqrt(0.5_wp), 0.0_wp, sqrt(1.5_wp)]
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        m_free = m
        q_free = q
        call free_flow(body, 5.0_wp, m_free, q_free)
        block
            type(heavy_top) :: weak
            weak%force = [0.0_wp, 0.0_wp, 1.0e-13_wp]
            call extrapolate(body, weak, 5.0_wp, m, q, 1.0e-12_wp)
        end block
        call t%at_most('a-hardly-disturbed-separatrix-is-kept', distance(m, q, m_free, q_free), 1.0e-10_wp)
    end subroutine test_free

    !> No time, time backwards, and a run that continues from the time of another.
    subroutine test_times(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(extrapolation_report) :: report
        real(wp) :: m(3), q(4), m_other(3), q_other(4), time
        integer :: stat

        item = known_top(2)
        m = item%m0
        q = item%q0
        time = 3.0_wp
        call extrapolate(item%body, item%top, 0.0_wp, m, q, 1.0e-9_wp, t=time, stat=stat, report=report)
        call t%ok('no-time-is-no-step', stat == status_ok .and. report%steps == 0 &
                  .and. all(abs(m - item%m0) <= 0.0_wp) .and. abs(time - 3.0_wp) <= 0.0_wp)
        call extrapolate(item%body, item%top, item%t, m, q, 1.0e-12_wp, t=time)
        call t%close_to('time-goes-on', time, 13.0_wp, 0.0_wp)
        call extrapolate(item%body, item%top, -item%t, m, q, 1.0e-12_wp, t=time)
        call t%close_to('and-back', time, 3.0_wp, 0.0_wp)
        call t%at_most('there-and-back-returns-the-start', distance(m, q, item%m0, item%q0), 1.0e-10_wp)
        call extrapolate(item%body, item%top, 4.0_wp, m, q, 1.0e-12_wp)
        call extrapolate(item%body, item%top, 6.0_wp, m, q, 1.0e-12_wp)
        m_other = item%m0
        q_other = item%q0
        call extrapolate(item%body, item%top, 10.0_wp, m_other, q_other, 1.0e-12_wp, compensated=.false.)
        call t%at_most('a-run-can-go-on', distance(m, q, m_other, q_other), 1.0e-10_wp)
    end subroutine test_times

    !> An observer sees every step and changes nothing; it may stop.
    subroutine test_observers(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(recorder) :: record
        type(extrapolation_report) :: report
        real(wp) :: m(3), q(4), m_alone(3), q_alone(4), time
        integer :: stat, n

        item = known_top(2)
        m = item%m0
        q = item%q0
        m_alone = m
        q_alone = q
        call extrapolate(item%body, item%top, item%t, m_alone, q_alone, 1.0e-9_wp)
        call extrapolate(item%body, item%top, item%t, m, q, 1.0e-9_wp, observer=record, report=report)
        n = record%count
        call t%equal('an-observer-sees-the-start-and-every-step', n, int(report%steps) + 1)
        call t%at_most('an-observer-changes-nothing', distance(m, q, m_alone, q_alone), 0.0_wp)
        call t%ok('steps-are-numbered-and-times-go-on', all(record%step(2:n) == record%step(1:n - 1) + 1) &
                  .and. all(record%t(2:n) > record%t(1:n - 1)) .and. abs(record%t(n) - item%t) <= 0.0_wp)
        call t%at_most('the-last-state-shown-is-the-last', &
                       distance(m, q, record%m(:, n), record%q(:, n)), 0.0_wp)
        m = item%m0
        q = item%q0
        record%count = 0
        record%stop_at = 3
        time = 0.0_wp
        call extrapolate(item%body, item%top, item%t, m, q, 1.0e-9_wp, t=time, observer=record, stat=stat)
        call t%equal('an-observer-can-stop', stat, status_stopped)
        call t%ok('and-keeps-the-state-it-saw', record%count == 4 .and. abs(time - record%t(4)) <= 0.0_wp &
                  .and. distance(m, q, record%m(:, 4), record%q(:, 4)) <= 0.0_wp)
    end subroutine test_observers

    !> Many bodies: each moves as by itself, also when another one is refused.
    subroutine test_many(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(rigid_body) :: bodies(3)
        type(extrapolation_report) :: report, one
        real(wp) :: m(3, 3), q(4, 3), m0(3, 3), m_one(3), q_one(4), time, apart
        integer :: steps, i, stat

        item = known_top(2)
        do i = 1, 3
            m0(:, i) = item%m0*(1 + 0.1_wp*i)
            q(:, i) = item%q0
            bodies(i) = rigid_body([0.6_wp, 0.8_wp, 1.0_wp + 0.1_wp*i])
        end do
        m = m0
        time = 1.0_wp
        call extrapolate(bodies, item%top, 3.0_wp, m, q, 1.0e-9_wp, t=time, stat=stat, report=report)
        steps = 0
        apart = 0.0_wp
        do i = 1, 3
            m_one = m0(:, i)
            q_one = item%q0
            call extrapolate(bodies(i), item%top, 3.0_wp, m_one, q_one, 1.0e-9_wp, t=time, report=one)
            time = 1.0_wp
            steps = steps + int(one%steps)
            apart = worst_of(apart, distance(m(:, i), q(:, i), m_one, q_one))
        end do
        call t%ok('many-bodies-move-each-as-by-itself', stat == status_ok .and. apart <= 0.0_wp)
        call t%equal('steps-of-many-bodies-add-up', int(report%steps), steps)
        m = m0
        m(2, 2) = ieee_value(m0(1, 1), ieee_quiet_nan)
        do i = 1, 3
            q(:, i) = item%q0
        end do
        call extrapolate(item%body, item%top, 3.0_wp, m, q, 1.0e-9_wp, t=time, stat=stat)
        m_one = m0(:, 3)
        q_one = item%q0
        call extrapolate(item%body, item%top, 3.0_wp, m_one, q_one, 1.0e-9_wp)
        call t%ok('a-body-that-is-refused-does-not-keep-the-others', stat == status_bad_momentum &
                  .and. distance(m(:, 3), q(:, 3), m_one, q_one) <= 0.0_wp .and. abs(time - 1.0_wp) <= 0.0_wp)
        call extrapolate(bodies(1:2), item%top, 3.0_wp, m, q, 1.0e-9_wp, stat=stat)
        call t%equal('two-bodies-for-three-states-are-refused', stat, status_bad_count)
    end subroutine test_many

    !> Each input that can be wrong, with the state untouched.
    subroutine test_refused(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(rigid_body) :: no_body, turned
        type(spoilt_torque) :: pulse
        real(wp) :: m(3), q(4), time, nan
        integer :: stat

        item = known_top(2)
        nan = ieee_value(nan, ieee_quiet_nan)
        m = item%m0
        q = item%q0
        time = 3.0_wp
        call extrapolate(no_body, item%top, 1.0_wp, m, q, 1.0e-9_wp, t=time, stat=stat)
        call refused('body-never-made', status_bad_moments)
        call extrapolate(item%body, item%top, nan, m, q, 1.0e-9_wp, t=time, stat=stat)
        call refused('nan-time', status_bad_time)
        call extrapolate(item%body, item%top, ieee_value(nan, ieee_positive_inf), m, q, 1.0e-9_wp, t=time, &
                         stat=stat)
        call refused('infinite-time', status_bad_time)
        call extrapolate(item%body, item%top, 1.0_wp, m, q, 1.0e-9_wp, t=time, step=-0.1_wp, stat=stat)
        call refused('negative-step', status_bad_time)
        call extrapolate(item%body, item%top, 1.0_wp, m, q, 1.0e-9_wp, t=time, step=1.0e-20_wp, stat=stat)
        call refused('step-too-small-to-count', status_bad_time)
        call extrapolate(item%body, item%top, 1.0_wp, m, q, -1.0e-9_wp, t=time, stat=stat)
        call refused('negative-tolerance', status_bad_option)
        call extrapolate(item%body, item%top, 1.0_wp, m, q, nan, t=time, stat=stat)
        call refused('nan-tolerance', status_bad_option)
        m(2) = nan
        call extrapolate(item%body, item%top, 1.0_wp, m, q, 1.0e-9_wp, stat=stat)
        call t%equal('nan-momentum-is-refused', stat, status_bad_momentum)
        ! Compiled with -Ofast, such runs must end.
        turned = rigid_body(reshape( &
                                    [1.0_wp, 0.1_wp, 0.2_wp, 0.1_wp, 1.5_wp, -0.1_wp, 0.2_wp, -0.1_wp, &
                                     2.2_wp], [3, 3]))
        pulse%until = huge(time)
        m = [0.3_wp, nan, 1.2_wp]
        call extrapolate(turned, pulse, 1.0_wp, m, q, 1.0e-9_wp, stat=stat)
        call t%equal('nan-momentum-of-a-body-by-its-tensor-is-refused', stat, status_bad_momentum)
        m = item%m0
        call extrapolate(turned, pulse, nan, m, q, 1.0e-9_wp, stat=stat)
        call t%equal('nan-time-of-a-body-by-its-tensor-is-refused', stat, status_bad_time)
        q = 1.01_wp*q
        call extrapolate(item%body, item%top, 1.0_wp, m, q, 1.0e-9_wp, stat=stat)
        call t%equal('attitude-of-another-norm-is-refused', stat, status_bad_attitude)

    contains

        subroutine refused(what, code)
            character(*), intent(in) :: what
            integer, intent(in) :: code

            call t%ok(what//'-is-refused-and-the-state-untouched', stat == code &
                      .and. all(abs(m - item%m0) <= 0.0_wp) .and. all(abs(q - item%q0) <= 0.0_wp) &
                      .and. abs(time - 3.0_wp) <= 0.0_wp)
        end subroutine refused

    end subroutine test_refused

end module frb_test_extrapolate
