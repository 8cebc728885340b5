!> The open loop: observers that stop, runs that are continued.
module frb_test_restarts
    use frb_checks, only: tally
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use frb_schemes, only: scheme_names, splitting_scheme
    use frb_splitting, only: integrate
    use frb_status, only: status_bad_count, status_bad_momentum, status_stopped
    use frb_torque_cases, only: dipoles, group_recorder, known_top, pulsed_torque, recorder, &
        start_of_group, top_case
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: test_restarts

    real(wp), parameter :: eps = epsilon(1.0_wp)
    integer, parameter :: n = 7, names = size(scheme_names)

contains

    subroutine test_restarts(t)
        type(tally), intent(inout) :: t

        call t%open_suite('restarts', 36)
        call test_stopping(t)
        call test_restarted_runs(t)
        call test_restarted_groups(t)
        call t%close_suite()
    end subroutine test_restarts

    !> An observer ends a run.
    subroutine test_stopping(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(recorder) :: record
        type(group_recorder) :: group_seen
        type(dipoles) :: scene
        type(rigid_body) :: body(n)
        real(wp) :: m(3), q(4), time, m_short(3), q_short(4), ms(3, n), qs(4, n)
        integer :: k, stat

        item = known_top(2)
        do k = 1, 2
            scheme = splitting_scheme(trim(merge('srkn14', 'srkn11', k == 1)))
            m = item%m0
            q = item%q0
            m_short = m
            q_short = q
            time = 2.0_wp
            record%count = 0
            record%stop_at = 14
            call integrate(item%body, scheme, item%top, 0.05_wp, 1000000000000_int64, m, q, record, every=7, &
                           t=time, stat=stat)
            call integrate(item%body, scheme, item%top, 0.05_wp, 14, m_short, q_short)
            call t%ok('an-observer-ends-a-run-with-the-state-it-sees', stat == status_stopped &
                      .and. record%count == 3 .and. all(abs([m - m_short, m - record%m(:, 3)]) <= 0.0_wp) &
                      .and. all(abs([q - q_short, q - record%q(:, 3)]) <= 0.0_wp) &
                      .and. abs(time - record%t(3)) <= 0.0_wp .and. abs(time - 2.7_wp) <= 2*eps)
        end do
        record%count = 0
        record%stop_at = 0
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, item%top, 0.05_wp, 10, m, q, record, stat=stat)
        call t%ok('before-the-first-step-if-it-likes', stat == status_stopped .and. record%count == 1 &
                  .and. all(abs(m - item%m0) <= 0.0_wp))
        record%stop_at = 3
        call integrate(item%body, scheme, item%top, 0.05_wp, 10, m, q, record)
        call t%equal('without-stat-a-stopped-run-returns', record%count, 5)
        call start_of_group(body, ms, qs)
        group_seen%stop_at = 4
        call integrate(body, scheme, scene, 0.05_wp, 10, ms, qs, group_seen, every=2, stat=stat)
        call t%ok('an-observer-ends-the-run-of-a-group', stat == status_stopped .and. group_seen%step == 4 &
                  .and. all(abs(ms - group_seen%m) <= 0.0_wp))
    end subroutine test_stopping

    !> A run in several calls equals the run in one call, to the last bit: every scheme, plain and
    !> compensated, a torque that depends on time.
    subroutine test_restarted_runs(t)
        type(tally), intent(inout) :: t
        integer, parameter :: pieces(4) = [1, 13, 40, 17]
        real(wp), parameter :: h(2) = [0.037_wp, -0.1_wp/3]
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(pulsed_torque) :: pulse
        real(wp) :: m(3, 2), q(4, 2), rests(7, 2), time(2)
        integer :: i, j, k, mode
        logical :: same(2)

        item = known_top(2)
        do k = 1, names
            scheme = splitting_scheme(trim(scheme_names(k)))
            same = .true.
            do mode = 1, 2
                do j = 1, 2
                    m = spread(item%m0, 2, 2)
                    q = spread(item%q0, 2, 2)
                    time = 0.6_wp
                    rests = 0.0_wp
                    call run(sum(pieces), 1)
                    do i = 1, size(pieces)
                        call run(pieces(i), 2)
                    end do
                    same(mode) = same(mode) .and. all(abs(m(:, 1) - m(:, 2)) <= 0.0_wp) &
                                 .and. all(abs(q(:, 1) - q(:, 2)) <= 0.0_wp) &
                                 .and. abs(time(1) - time(2)) <= 0.0_wp &
                                 .and. all(abs(rests(:, 1) - rests(:, 2)) <= 0.0_wp)
                end do
            end do
            call t%ok(trim(scheme_names(k))//'-goes-on-to-the-bit', same(1))
            call t%ok(trim(scheme_names(k))//'-compensated-goes-on-to-the-bit', same(2))
        end do

    contains

        !> The heavy top, or for negative steps the torque that depends on time.
        subroutine run(steps, which)
            integer, intent(in) :: steps, which

            if (h(j) > 0.0_wp) then
                call integrate(item%body, scheme, item%top, h(j), steps, m(:, which), q(:, which), &
                               t=time(which), compensated=mode == 2, rests=rests(:, which))
            else
                call integrate(item%body, scheme, pulse, h(j), steps, m(:, which), q(:, which), &
                               t=time(which), compensated=mode == 2, rests=rests(:, which))
            end if
        end subroutine run

    end subroutine test_restarted_runs

    !> Groups: a run in several calls equals the run in one call.
    subroutine test_restarted_groups(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: body(n)
        type(dipoles) :: scene
        type(splitting_scheme) :: scheme
        real(wp) :: m(3, n, 2), q(4, n, 2), rests(7, n, 2), time(2)
        integer :: k, mode, stat
        logical :: same(2)

        same = .true.
        do k = 1, names
            scheme = splitting_scheme(trim(scheme_names(k)))
            do mode = 1, 2
                call start_of_group(body, m(:, :, 1), q(:, :, 1))
                m(:, :, 2) = m(:, :, 1)
                q(:, :, 2) = q(:, :, 1)
                time = 0.1_wp
                rests = 0.0_wp
                call integrate(body, scheme, scene, 0.03_wp, 30, m(:, :, 1), q(:, :, 1), t=time(1), &
                               compensated=mode == 2, rests=rests(:, :, 1))
                call integrate(body, scheme, scene, 0.03_wp, 11, m(:, :, 2), q(:, :, 2), t=time(2), &
                               compensated=mode == 2, rests=rests(:, :, 2))
                call integrate(body, scheme, scene, 0.03_wp, 19, m(:, :, 2), q(:, :, 2), t=time(2), &
                               compensated=mode == 2, rests=rests(:, :, 2))
                same(mode) = same(mode) .and. all(abs(m(:, :, 1) - m(:, :, 2)) <= 0.0_wp) &
                             .and. all(abs(q(:, :, 1) - q(:, :, 2)) <= 0.0_wp) &
                             .and. all(abs(rests(:, :, 1) - rests(:, :, 2)) <= 0.0_wp) &
                             .and. abs(time(1) - time(2)) <= 0.0_wp
            end do
        end do
        call t%ok('groups-go-on-to-the-bit', same(1))
        call t%ok('compensated-groups-go-on-to-the-bit', same(2))
        call t%ok('a-compensated-group-has-rests', maxval(abs(rests)) > 0.0_wp)
        call integrate(body, scheme, scene, 0.03_wp, 1, m(:, :, 1), q(:, :, 1), compensated=.true., &
                       rests=rests(1:6, :, 1), stat=stat)
        call t%equal('rests-of-another-size-are-refused', stat, status_bad_count)
        rests(3, 2, 1) = ieee_value(1.0_wp, ieee_quiet_nan)
        call integrate(body, scheme, scene, 0.03_wp, 1, m(:, :, 1), q(:, :, 1), compensated=.true., &
                       rests=rests(:, :, 1), stat=stat)
        call t%equal('rests-that-are-nan-are-refused', stat, status_bad_momentum)
    end subroutine test_restarted_groups

end module frb_test_restarts
