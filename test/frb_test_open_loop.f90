!> The open loop: loops of one's own against `integrate`, plans, scenes that refuse and agree, observers that
!> stop, runs that are continued.
module frb_test_open_loop
    use frb_checks, only: tally, worst_of
    use frb_free_flow, only: free_flow, rigid_body
    use frb_invariants, only: kinetic_energy, spatial_momentum, total_energy
    use frb_kinds, only: wp
    use frb_rotations, only: quat_rotate, quat_to_matrix
    use frb_scenes, only: heavy_top
    use frb_schemes, only: mirrored, scheme_names, splitting_scheme
    use frb_splitting, only: integrate
    use frb_splitting_plan, only: next_time, splitting_plan
    use frb_status, only: status_ok, status_bad_attitude, status_bad_count, status_bad_momentum, &
        status_bad_option, status_bad_scheme, status_bad_time, status_stopped
    use frb_torque, only: body_scene
    use frb_torque_cases, only: dipoles, distance, group_recorder, known_top, pulsed_torque, recorder, &
        start_of_group, top_case
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_value, ieee_quiet_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: test_open_loop

    real(wp), parameter :: eps = epsilon(1.0_wp)
    integer, parameter :: n = 7, names = size(scheme_names)
    integer, parameter :: own_code = 77         ! of a scene of the user's

    !> A heavy top that counts, refuses on demand, and hears of the refusals of others.
    type, extends(body_scene) :: shared_top
        type(heavy_top) :: top
        integer :: asked = 0                    ! torques so far
        integer :: agreed = 0                   ! calls of the hook so far
        integer :: refuse_at = 0                ! torque that is refused
        integer :: others_refuse_at = 0         ! call of the hook at which another process refuses
        integer :: last_code = 0                ! what the hook came with
    contains
        procedure :: torque => shared_torque
        procedure :: agree => shared_agree
    end type shared_top

    !> The same of dipoles.
    type, extends(dipoles) :: shared_dipoles
        integer :: agreed = 0
        integer :: others_refuse_at = 0
    contains
        procedure :: agree => dipoles_agree
    end type shared_dipoles

contains

    subroutine test_open_loop(t)
        type(tally), intent(inout) :: t

        call t%open_suite('open-loop', 103)
        call test_own_loop(t)
        call test_plans(t)
        call test_refusing_scenes(t)
        call test_agreeing(t)
        call test_stopping(t)
        call test_restarts(t)
        call test_restarted_groups(t)
        call test_joined(t)
        call test_times(t)
        call test_units_and_sizes(t)
        call t%close_suite()
    end subroutine test_open_loop

    subroutine shared_torque(self, q, t, tau, stat)
        class(shared_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        call self%top%torque(q, t, tau, stat)
        self%asked = self%asked + 1
        if (self%asked == self%refuse_at) stat = own_code
    end subroutine shared_torque

    subroutine shared_agree(self, code)
        class(shared_top), intent(inout) :: self
        integer, intent(inout) :: code

        self%agreed = self%agreed + 1
        self%last_code = code
        if (self%agreed == self%others_refuse_at) code = max(code, own_code)
    end subroutine shared_agree

    subroutine dipoles_agree(self, code)
        class(shared_dipoles), intent(inout) :: self
        integer, intent(inout) :: code

        self%agreed = self%agreed + 1
        if (self%agreed == self%others_refuse_at) code = max(code, own_code)
    end subroutine dipoles_agree

    !> The recipe of splitting_plan, one body and many, every scheme with plain kicks; the torque kept where
    !> nothing moves.
    subroutine test_own_loop(t)
        type(tally), intent(inout) :: t
        integer, parameter :: steps = 20
        real(wp), parameter :: h = 0.05_wp
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(splitting_plan) :: plan
        type(dipoles) :: scene
        type(rigid_body) :: body(n)
        real(wp) :: m(3), q(4), tau(3), m_own(3), q_own(4)
        real(wp) :: ms(3, n), qs(4, n), taus(3, n), ms_own(3, n), qs_own(4, n)
        integer :: i, k, step, stat, asked
        logical :: known

        item = known_top(2)
        do k = 1, names
            scheme = splitting_scheme(trim(scheme_names(k)))
            if (scheme%has_modified_kicks()) cycle
            plan = splitting_plan(scheme, h)
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, h, steps, m, q)
            m_own = item%m0
            q_own = item%q0
            known = .false.
            asked = 0
            do step = 1, steps
                do i = 1, plan%stages
                    call free_flow(item%body, plan%drift(i), m_own, q_own)
                    if (abs(plan%drift(i)) > 0.0_wp .or. .not. known) then
                        call item%top%torque(q_own, (step - 1)*h + plan%time(i), tau, stat)
                        asked = asked + 1
                    end if
                    known = .true.
                    m_own = m_own + plan%kick(i)*tau
                end do
                call free_flow(item%body, plan%drift(i), m_own, q_own)
            end do
            call t%at_most(trim(scheme_names(k))//'-in-a-loop-of-ones-own-is-integrate', &
                           distance(m_own, q_own, m, q), 1.0e-14_wp)
            call t%equal(trim(scheme_names(k))//'-asks-for-as-many-torques-as-the-scheme-has-stages', asked, &
                         steps*scheme%stages() + merge(0, 1, scheme%drift_first))

            call start_of_group(body, ms, qs)
            ms_own = ms
            qs_own = qs
            call integrate(body, scheme, scene, h, steps, ms, qs)
            do step = 1, steps
                do i = 1, plan%stages
                    call free_flow(body, plan%drift(i), ms_own, qs_own)
                    call scene%torques(qs_own, (step - 1)*h + plan%time(i), taus, stat)
                    ms_own = ms_own + plan%kick(i)*taus
                end do
                call free_flow(body, plan%drift(i), ms_own, qs_own)
            end do
            call t%at_most(trim(scheme_names(k))//'-of-a-group-in-a-loop-of-ones-own-is-integrate', &
                           max(maxval(abs(ms_own - ms)), maxval(abs(qs_own - qs))), 1.0e-14_wp)
        end do
    end subroutine test_own_loop

    !> What a plan holds, and when there is none.
    subroutine test_plans(t)
        type(tally), intent(inout) :: t
        type(splitting_scheme) :: scheme
        type(splitting_plan) :: plan
        real(wp) :: nan, worst
        integer :: k, i, stat
        logical :: sized, open_with_torque

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        worst = 0.0_wp
        sized = .true.
        open_with_torque = .true.
        do k = 1, names
            scheme = splitting_scheme(trim(scheme_names(k)))
            plan = splitting_plan(scheme, -0.3_wp, stat)
            sized = sized .and. stat == status_ok .and. plan%status == status_ok &
                    .and. size(plan%drift) == plan%stages + 1 .and. size(plan%kick) == plan%stages &
                    .and. size(plan%time) == plan%stages
            worst = worst_of(worst, abs([sum(plan%drift), sum(plan%kick)] + 0.3_wp))
            do i = 1, plan%stages
                worst = worst_of(worst, abs(plan%time(i) - sum(plan%drift(1:i))))
            end do
            if (scheme%drift_first .eqv. all(abs(plan%drift([1, plan%stages + 1])) <= 0.0_wp)) then
                open_with_torque = .false.
            end if
        end do
        call t%ok('a-plan-has-as-many-of-each-as-it-has-stages', sized)
        call t%at_most('drifts-and-kicks-sum-to-h-and-times-follow-the-drifts', worst, 4*eps)
        call t%ok('plans-that-open-with-a-kick-have-no-drift-at-their-ends', open_with_torque)
        scheme = splitting_scheme('strang')
        plan = splitting_plan(scheme, 0.0_wp, stat)
        call t%ok('no-plan-for-no-step', all([stat, plan%status] == status_bad_time) .and. plan%stages == 0 &
                  .and. all(abs(plan%drift) <= 0.0_wp) .and. size(plan%drift) == 1)
        plan = splitting_plan(scheme, nan)
        call t%equal('no-plan-for-a-nan-step', plan%status, status_bad_time)
        plan = splitting_plan(splitting_scheme([0.5_wp, 0.5_wp], [0.9_wp]), 0.1_wp, stat)
        call t%ok('no-plan-for-no-scheme', all([stat, plan%status] == status_bad_scheme) &
                  .and. plan%stages == 0)
        plan = splitting_plan(splitting_scheme('none'), 0.1_wp)
        call t%equal('a-plan-says-what-the-scheme-says', plan%status, status_bad_option)
    end subroutine test_plans

    !> A torque that refuses ends the run with the last whole step, in any stage of any scheme.
    subroutine test_refusing_scenes(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(shared_top) :: scene
        real(wp) :: m(3), q(4), time, m_short(3), q_short(4), t_short
        integer :: k, i, stat, done
        logical :: good

        item = known_top(2)
        do k = 1, names
            scheme = splitting_scheme(trim(scheme_names(k)))
            good = .true.
            do i = 1, 40
                scene = shared_top(top=item%top, refuse_at=i)
                m = item%m0
                q = item%q0
                time = 1.0_wp
                call integrate(item%body, scheme, scene, 0.05_wp, 50, m, q, t=time, stat=stat)
                done = nint((time - 1)/0.05_wp)
                m_short = item%m0
                q_short = item%q0
                t_short = 1.0_wp
                scene = shared_top(top=item%top)
                call integrate(item%body, scheme, scene, 0.05_wp, done, m_short, q_short, t=t_short)
                good = good .and. stat == own_code .and. done < i .and. all(abs(m - m_short) <= 0.0_wp) &
                       .and. all(abs(q - q_short) <= 0.0_wp) .and. abs(time - t_short) <= 0.0_wp
                ! Not a whole step more was possible: that one asks for the torque that is refused.
                scene = shared_top(top=item%top)
                call integrate(item%body, scheme, scene, 0.05_wp, done + 1, m_short, q_short)
                good = good .and. scene%asked >= i - done*scheme%stages()
            end do
            call t%ok(trim(scheme_names(k))//'-ends-with-the-last-whole-step-before-a-refusal', good)
        end do
    end subroutine test_refusing_scenes

    !> The hook hears every code before it counts, and what it says ends the run.
    subroutine test_agreeing(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(shared_top) :: scene
        type(shared_dipoles) :: group
        type(rigid_body) :: body(n)
        type(recorder) :: seen
        real(wp) :: m(3), q(4), time, ms(3, n), qs(4, n), ms_start(3, n), qs_start(4, n)
        integer :: i, stat, calls, ended
        logical :: good

        item = known_top(2)
        scheme = splitting_scheme('srkn14')
        scene = shared_top(top=item%top)
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, scene, 0.05_wp, 4, m, q, seen)
        calls = scene%agreed
        ! At the start, after each torque, at the end of each step, after each state shown.
        call t%equal('the-hook-is-asked-wherever-a-run-may-end', calls, 1 + 4*14 + 4 + 5)
        good = .true.
        do i = 1, calls
            scene = shared_top(top=item%top, others_refuse_at=i)
            m = item%m0
            q = item%q0
            time = 0.0_wp
            call integrate(item%body, scheme, scene, 0.05_wp, 4, m, q, seen, t=time, stat=stat)
            good = good .and. stat == own_code .and. scene%agreed == i
        end do
        call t%ok('a-run-ends-where-another-process-refuses', good)
        scene = shared_top(top=item%top, refuse_at=30)
        call integrate(item%body, scheme, scene, 0.05_wp, 4, m, q, stat=stat)
        call t%equal('the-hook-hears-what-the-torque-said', scene%last_code, own_code)
        scene = shared_top(top=item%top)
        call integrate(item%body, scheme, scene, 0.0_wp, 4, m, q, stat=stat)
        call t%ok('the-hook-hears-of-refused-input', scene%last_code == status_bad_time &
                  .and. scene%agreed == 1)
        scene = shared_top(top=item%top)
        seen%stop_at = 1
        call integrate(item%body, scheme, scene, 0.05_wp, 4, m, q, seen, stat=stat)
        call t%equal('the-hook-hears-of-an-observer-that-stops', scene%last_code, status_stopped)

        call start_of_group(body, ms_start, qs_start)
        ms = ms_start
        qs = qs_start
        call integrate(body, scheme, group, 0.05_wp, 4, ms, qs)
        call t%equal('so-is-the-hook-of-a-group', group%agreed, 1 + 4*14 + 4)
        good = .true.
        ended = group%agreed
        do i = 1, ended
            group%agreed = 0
            group%others_refuse_at = i
            ms = ms_start
            qs = qs_start
            call integrate(body, scheme, group, 0.05_wp, 4, ms, qs, stat=stat)
            good = good .and. stat == own_code .and. group%agreed == i
        end do
        call t%ok('a-group-ends-where-another-process-refuses', good)
    end subroutine test_agreeing

    !> An observer ends a run.
    subroutine test_stopping(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(recorder) :: seen
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
            seen%count = 0
            seen%stop_at = 14
            call integrate(item%body, scheme, item%top, 0.05_wp, 1000000000000_int64, m, q, seen, every=7, &
                           t=time, stat=stat)
            call integrate(item%body, scheme, item%top, 0.05_wp, 14, m_short, q_short)
            call t%ok('an-observer-ends-a-run-with-the-state-it-sees', stat == status_stopped &
                      .and. seen%count == 3 .and. all(abs([m - m_short, m - seen%m(:, 3)]) <= 0.0_wp) &
                      .and. all(abs([q - q_short, q - seen%q(:, 3)]) <= 0.0_wp) &
                      .and. abs(time - seen%t(3)) <= 0.0_wp .and. abs(time - 2.7_wp) <= 2*eps)
        end do
        seen%count = 0
        seen%stop_at = 0
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, item%top, 0.05_wp, 10, m, q, seen, stat=stat)
        call t%ok('before-the-first-step-if-it-likes', stat == status_stopped .and. seen%count == 1 &
                  .and. all(abs(m - item%m0) <= 0.0_wp))
        seen%stop_at = 3
        call integrate(item%body, scheme, item%top, 0.05_wp, 10, m, q, seen)
        call t%equal('without-stat-a-stopped-run-returns', seen%count, 5)
        call start_of_group(body, ms, qs)
        group_seen%stop_at = 4
        call integrate(body, scheme, scene, 0.05_wp, 10, ms, qs, group_seen, every=2, stat=stat)
        call t%ok('an-observer-ends-the-run-of-a-group', stat == status_stopped .and. group_seen%step == 4 &
                  .and. all(abs(ms - group_seen%m) <= 0.0_wp))
    end subroutine test_stopping

    !> A run in pieces is the run in one, to the last bit: every scheme, plain and compensated, a torque that
    !> depends on time.
    subroutine test_restarts(t)
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

    end subroutine test_restarts

    !> The same of groups.
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

    !> Drifts of two steps as one: the same run to rounding, one drift less a step.
    subroutine test_joined(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(recorder) :: seen
        type(shared_top) :: scene
        real(wp) :: m(3), q(4), m_joined(3), q_joined(4), time, worst(3)
        integer :: k, stat, done

        item = known_top(2)
        worst = 0.0_wp
        do k = 1, names
            scheme = splitting_scheme(trim(scheme_names(k)))
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m, q)
            m_joined = item%m0
            q_joined = item%q0
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m_joined, q_joined, joined=.true.)
            worst(1) = worst_of(worst(1), distance(m, q, m_joined, q_joined))
            m_joined = item%m0
            q_joined = item%q0
            seen%count = 0
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m_joined, q_joined, seen, every=8, &
                           joined=.true.)
            worst(2) = worst_of(worst(2), distance(m, q, seen%m(:, 6), seen%q(:, 6)))
            ! Ended by a refusal it is closed: the state is that of a whole step.
            scene = shared_top(top=item%top, refuse_at=37)
            m_joined = item%m0
            q_joined = item%q0
            time = 0.0_wp
            call integrate(item%body, scheme, scene, 0.05_wp, 40, m_joined, q_joined, t=time, joined=.true., &
                           stat=stat)
            done = nint(time/0.05_wp)
            m = item%m0
            q = item%q0
            scene = shared_top(top=item%top)
            call integrate(item%body, scheme, scene, 0.05_wp, done, m, q)
            worst(3) = worst_of(worst(3), distance(m, q, m_joined, q_joined))
        end do
        call t%at_most('joined-drifts-make-the-same-run', worst(1), 128*eps)
        call t%at_most('joined-runs-show-whole-steps', worst(2), 128*eps)
        call t%at_most('joined-runs-end-with-whole-steps', worst(3), 128*eps)
    end subroutine test_joined

    !> Times of steps, from any start, stay with start + steps*h; after 2**53 steps of h they stand.
    subroutine test_times(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: starts(6) = [0.0_wp, 0.1_wp, -3.7_wp, 1.0e6_wp + 0.37_wp, -1.0e-3_wp, 0.062_wp]
        real(wp), parameter :: h(4) = [0.1_wp, -0.1_wp, 1.0_wp/3, 1.0e-3_wp]
        real(wp) :: time, worst
        integer :: i, j, k

        worst = 0.0_wp
        do i = 1, size(starts)
            do j = 1, size(h)
                time = starts(i)
                do k = 1, 200000
                    time = next_time(time, h(j))
                end do
                worst = worst_of(worst, abs(time - (starts(i) + 200000*h(j))) &
                                 /spacing(max(abs(time), abs(starts(i)))))
            end do
        end do
        call t%at_most('two-hundred-thousand-steps-of-time-lose-two-units', worst, 2.0_wp)
        call t%close_to('time-stands-where-a-step-is-below-its-last-digit', next_time(1.0e20_wp, 0.1_wp), &
                        1.0e20_wp, 0.0_wp)
        call t%ok('times-of-extreme-steps-are-finite', abs(next_time(1.0e300_wp, 1.0e-300_wp)) < huge(time) &
                  .and. abs(next_time(-1.0e-300_wp, 1.0e300_wp)) < huge(time))
    end subroutine test_times

    !> What needs a quaternion of norm one refuses another; arrays that do not match.
    subroutine test_units_and_sizes(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(dipoles) :: scene
        type(rigid_body) :: body(n), none
        real(wp) :: m(3), q(4), ms(3, n), qs(4, n)
        integer :: stat, inside

        item = known_top(2)
        scheme = splitting_scheme('strang')
        m = item%m0
        q = item%q0*(1 + 9.0e-7_wp)
        call integrate(item%body, scheme, item%top, 0.05_wp, 1, m, q, stat=inside)
        m = item%m0
        q = item%q0*(1 - 1.1e-6_wp)
        call integrate(item%body, scheme, item%top, 0.05_wp, 1, m, q, stat=stat)
        call t%ok('a-quaternion-off-by-a-millionth-is-refused', inside == status_ok &
                  .and. stat == status_bad_attitude)
        q = 2*item%q0
        call integrate(item%body, scheme, item%top, 0.05_wp, 1, m, q, stat=stat)
        call t%ok('a-quaternion-of-norm-two-is-refused', stat == status_bad_attitude &
                  .and. all(abs(m - item%m0) <= 0.0_wp))
        call start_of_group(body, ms, qs)
        qs(:, 3) = 2*qs(:, 3)
        call integrate(body, scheme, scene, 0.05_wp, 1, ms, qs, stat=stat)
        call t%equal('in-a-group-too', stat, status_bad_attitude)
        call t%ok('what-rotates-by-it-gives-nan', all(ieee_is_nan(quat_rotate(q, m))) &
                  .and. all(ieee_is_nan(quat_to_matrix(q))) .and. all(ieee_is_nan(spatial_momentum(m, q))) &
                  .and. all(ieee_is_nan(spatial_momentum(ms, qs))))
        call t%ok('energies-of-arrays-that-do-not-match-are-nan', &
                  ieee_is_nan(kinetic_energy(body(2:), ms)) .and. ieee_is_nan(kinetic_energy(body, qs)) &
                  .and. ieee_is_nan(kinetic_energy(body(1), qs)) .and. ieee_is_nan(kinetic_energy(none, m)) &
                  .and. ieee_is_nan(total_energy(body, scene, 0.0_wp, ms, qs(:, 2:))) &
                  .and. ieee_is_nan(total_energy(body(2:), scene, 0.0_wp, ms, qs)) &
                  .and. ieee_is_nan(total_energy(body(1), scene, 0.0_wp, ms, ms)))
        call t%ok('momenta-of-arrays-that-do-not-match-are-nan', &
                  all(ieee_is_nan(spatial_momentum(ms, qs(:, 2:)))) &
                  .and. all(ieee_is_nan(spatial_momentum(qs, qs))))
        call t%ok('a-half-too-short-for-a-palindrome-gives-nan', &
                  all(ieee_is_nan(mirrored([1.0_wp, 2.0_wp], 5))))
    end subroutine test_units_and_sizes

end module frb_test_open_loop
