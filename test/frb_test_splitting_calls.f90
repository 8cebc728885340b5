!> Calls of `integrate`: scenes, observers, drifts, refused input.
module frb_test_splitting_calls
    use frb_checks, only: tally
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use frb_rotations, only: quat_conjugate, quat_product
    use frb_scenes, only: heavy_top, plain_scene
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    use frb_status, only: status_ok, status_bad_attitude, status_bad_count, status_bad_moments, &
        status_bad_momentum, status_bad_option, status_bad_scheme, status_bad_time, status_bad_torque
    use frb_torque_cases, only: top_case, known_top, distance, recorder, spoilt_torque, plain_drift, &
        failing_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_value, ieee_quiet_nan, ieee_positive_inf
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: test_splitting_calls

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_splitting_calls(t)
        type(tally), intent(inout) :: t

        call t%open_suite('splitting-calls', 43)
        call test_top_torque(t)
        call test_loop(t)
        call test_refused(t)
        call t%close_suite()
    end subroutine test_splitting_calls

    !> The torque of a heavy top is minus the change of its potential with a turn about each body axis.
    subroutine test_top_torque(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: small = 1.0e-5_wp    ! difference quotient: error small**2 and eps/small
        type(heavy_top) :: top
        real(wp) :: q(4), tau(3), slope(3), turn(4), v(2)
        integer :: j, stat(3)

        top = heavy_top(force=[0.3_wp, -0.7_wp, 1.1_wp], centre=[0.5_wp, 0.9_wp, -0.4_wp])
        q = [0.1_wp, 0.7_wp, 0.5_wp, 0.5_wp]
        call top%torque(q, 0.0_wp, tau, stat(1))
        do j = 1, 3
            turn = [cos(small/2), 0.0_wp, 0.0_wp, 0.0_wp]
            turn(1 + j) = sin(small/2)
            call top%potential(quat_product(q, turn), 0.0_wp, v(1), stat(2))
            call top%potential(quat_product(q, quat_conjugate(turn)), 0.0_wp, v(2), stat(3))
            slope(j) = (v(1) - v(2))/(2*small)
        end do
        call t%ok('a-heavy-top-refuses-nothing', all(stat == status_ok))
        call t%close_to('torque-of-a-heavy-top-is-minus-the-slope-of-its-potential', tau, -slope, 1.0e-9_wp)
    end subroutine test_top_torque

    !> Observers, merged stages, plain scenes, drifts.
    subroutine test_loop(t)
        type(tally), intent(inout) :: t
        character(8), parameter :: names(2) = [character(8) :: 'srkn14', 'srkn11']
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(recorder) :: every_step, every_seventh
        type(plain_drift) :: same_drift
        type(plain_scene) :: plain
        real(wp) :: m(3, 5), q(4, 5), v(2)
        integer :: i, stat

        item = known_top(2)
        do i = 1, 2
            scheme = splitting_scheme(trim(names(i)))
            m = spread(item%m0, 2, 5)
            q = spread(item%q0, 2, 5)
            every_step%count = 0
            every_seventh%count = 0
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m(:, 1), q(:, 1))
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m(:, 2), q(:, 2), every_step)
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m(:, 3), q(:, 3), every_seventh, every=7)
            call t%close_to('watching-a-run-does-not-change-it', [m(:, 2), q(:, 2), m(:, 3), q(:, 3)], &
                            [m(:, 1), q(:, 1), m(:, 1), q(:, 1)], 0.0_wp)
            call t%ok('observer-sees-the-start-and-every-step', every_step%count == 41)
            call t%ok('observer-sees-the-start-and-every-seventh-step', every_seventh%count == 6 &
                      .and. all(every_seventh%step(1:6) == [integer(int64) :: 0, 7, 14, 21, 28, 35]))
            call t%close_to('observer-is-told-the-time', every_seventh%t(1:6), &
                            0.35_wp*[0, 1, 2, 3, 4, 5], 2*eps)
            call t%close_to('observer-sees-the-end-as-it-is-returned', &
                            [every_step%m(:, 41), every_step%q(:, 41)], [m(:, 1), q(:, 1)], 0.0_wp)
            call t%close_to('observer-sees-the-start-as-it-was-given', &
                            [every_step%m(:, 1), every_step%q(:, 1)], [item%m0, item%q0], 0.0_wp)
            call integrate(item%body, scheme, item%top, 0.05_wp, 20, m(:, 4), q(:, 4))
            call t%at_most('observer-sees-what-a-shorter-run-returns', &
                           distance(every_step%m(:, 21), every_step%q(:, 21), m(:, 4), q(:, 4)), 0.0_wp)
            call integrate(item%body, scheme, item%top, 0.05_wp, 20, m(:, 4), q(:, 4))
            call t%at_most('a-run-in-two-parts-is-the-run', &
                           distance(m(:, 4), q(:, 4), m(:, 1), q(:, 1)), 0.0_wp)
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m(:, 5), q(:, 5), drift=same_drift)
            call t%close_to('the-same-flow-as-a-drift-of-the-users-gives-the-same-run', [m(:, 5), q(:, 5)], &
                            [m(:, 1), q(:, 1)], 0.0_wp)
        end do

        plain = plain_scene(weight_torque, weight)
        m(:, 2) = item%m0
        q(:, 2) = item%q0
        call integrate(item%body, scheme, plain, 0.05_wp, 40, m(:, 2), q(:, 2))
        call t%at_most('plain-procedures-make-the-same-top', &
                       distance(m(:, 2), q(:, 2), m(:, 1), q(:, 1)), 128*eps)
        call plain%potential(item%q, 0.0_wp, v(1), stat)
        call item%top%potential(item%q, 0.0_wp, v(2), stat)
        call t%close_to('plain-potential-is-the-tops', &
                        v(1), v(2), 2*eps)
        plain = plain_scene(weight_torque)
        call plain%potential(item%q, 0.0_wp, v(1), stat)
        call t%ok('plain-scene-without-potential-says-nan', ieee_is_nan(v(1)))
        plain = plain_scene()
        call integrate(item%body, scheme, plain, 0.05_wp, 40, m(:, 2), q(:, 2), stat=stat)
        call t%equal('plain-scene-without-torque-is-refused', stat, status_bad_torque)

        every_step%count = 0
        m(:, 2) = item%m0
        call integrate(item%body, scheme, item%top, 0.05_wp, 0, m(:, 2), q(:, 2), every_step, stat=stat)
        call t%ok('no-steps-leave-the-state-and-show-the-start', stat == status_ok &
                  .and. every_step%count == 1 .and. all(abs(m(:, 2) - item%m0) <= 0.0_wp))
    end subroutine test_loop

    !> The torque of a unit weight on axis 3 in a field along space axis 3: (Q_32, -Q_31, 0).
    pure subroutine weight_torque(q, t, tau)
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)

        associate (unused_t => t)
        end associate
        tau = [2*(q(3)*q(4) + q(1)*q(2)), -2*(q(2)*q(4) - q(1)*q(3)), 0.0_wp]
    end subroutine weight_torque

    !> Q_33.
    pure function weight(q, t) result(v)
        real(wp), intent(in) :: q(4), t
        real(wp) :: v

        associate (unused_t => t)
        end associate
        v = 1 - 2*(q(2)**2 + q(3)**2)
    end function weight

    !> Each way a call can be wrong: the code, and the state untouched.
    subroutine test_refused(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme, bad_scheme
        type(spoilt_torque) :: spoilt
        type(failing_drift) :: failing
        type(heavy_top) :: violent
        type(rigid_body) :: bad_body
        real(wp) :: nan, inf, m(3), q(4), time
        integer :: stat

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        inf = ieee_value(1.0_wp, ieee_positive_inf)
        item = known_top(2)
        scheme = splitting_scheme('srkn14')
        time = 3.0_wp

        m = item%m0
        q = item%q0
        spoilt%until = 0.0_wp
        call integrate(item%body, scheme, spoilt, 0.1_wp, 100, m, q, t=time, stat=stat)
        call refused('torque-that-is-nan', status_bad_torque)
        call ends_with_a_whole_step(t, 'torque-that-becomes-nan', item, scheme)
        call ends_with_a_whole_step(t, 'torque-that-becomes-nan-in-a-bab-scheme', item, &
                                    splitting_scheme('srkn11'))
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, drift=failing, stat=stat)
        call refused('drift-that-fails', status_bad_option)
        call integrate(item%body, scheme, item%top, 0.0_wp, 5, m, q, t=time, stat=stat)
        call refused('zero-step', status_bad_time)
        call integrate(item%body, scheme, item%top, nan, 5, m, q, t=time, stat=stat)
        call refused('nan-step', status_bad_time)
        call integrate(item%body, scheme, item%top, inf, 5, m, q, t=time, stat=stat)
        call refused('infinite-step', status_bad_time)
        call integrate(item%body, scheme, item%top, 1.0e300_wp, 100, m, q, t=time, stat=stat)
        call refused('run-whose-end-overflows', status_bad_time)
        violent = heavy_top(force=[0.0_wp, 0.0_wp, 0.1_wp*huge(1.0_wp)], centre=[1.0_wp, 0.0_wp, 0.0_wp])
        call integrate(item%body, scheme, violent, 100.0_wp, 5, m, q, t=time, stat=stat)
        call refused('torque-that-makes-m-overflow', status_bad_torque)
        call integrate(item%body, scheme, item%top, 0.1_wp, -1, m, q, t=time, stat=stat)
        call refused('negative-number-of-steps', status_bad_count)
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, every=0, t=time, stat=stat)
        call refused('observing-every-zero-steps', status_bad_count)
        call integrate(bad_body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call refused('body-never-made', status_bad_moments)
        bad_scheme = splitting_scheme([0.5_wp, 0.5_wp], [0.9_wp])
        call integrate(item%body, bad_scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call refused('scheme-that-does-not-sum-to-one', status_bad_scheme)
        call integrate(item%body, splitting_scheme('none'), item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call refused('scheme-of-unknown-name', status_bad_option)
        m(2) = inf
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call t%equal('infinite-momentum-is-refused', stat, status_bad_momentum)
        m = item%m0
        q = 0.0_wp
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call t%equal('attitude-of-norm-zero-is-refused', stat, status_bad_attitude)
        q(3) = nan
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call t%equal('nan-attitude-is-refused', stat, status_bad_attitude)
        q = item%q0
        time = nan
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call t%equal('nan-time-is-refused', stat, status_bad_time)

    contains

        subroutine refused(what, code)
            character(*), intent(in) :: what
            integer, intent(in) :: code

            call t%ok(what//'-is-refused-and-the-state-untouched', stat == code &
                      .and. all(abs(m - item%m0) <= 0.0_wp) .and. all(abs(q - item%q0) <= 0.0_wp) &
                      .and. abs(time - 3.0_wp) <= 0.0_wp)
        end subroutine refused

    end subroutine test_refused

    !> A torque that is NaN from time 7.2 on ends a run in steps of 0.1 from 3 with step 41 or 42.
    subroutine ends_with_a_whole_step(t, what, item, scheme)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: what
        type(top_case), intent(in) :: item
        type(splitting_scheme), intent(in) :: scheme
        real(wp), parameter :: start = 3.0_wp
        type(spoilt_torque) :: torque
        real(wp) :: m_end(3), q_end(4), t_end, m_short(3), q_short(4), t_short
        integer :: done, stat

        m_end = item%m0
        q_end = item%q0
        t_end = start
        torque%until = 7.2_wp
        call integrate(item%body, scheme, torque, 0.1_wp, 100, m_end, q_end, t=t_end, stat=stat)
        done = nint((t_end - start)/0.1_wp)
        m_short = item%m0
        q_short = item%q0
        t_short = start
        torque%until = huge(start)
        call integrate(item%body, scheme, torque, 0.1_wp, done, m_short, q_short, t=t_short)
        call t%ok(what//'-ends-the-run-with-the-last-whole-step', stat == status_bad_torque &
                  .and. (done == 41 .or. done == 42) .and. all(abs(m_end - m_short) <= 0.0_wp) &
                  .and. all(abs(q_end - q_short) <= 0.0_wp) .and. abs(t_end - t_short) <= 0.0_wp)
    end subroutine ends_with_a_whole_step

end module frb_test_splitting_calls
