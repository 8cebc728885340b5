!> The open loop: scenes that refuse and agree, torques counted where drifts are joined.
module frb_test_open_scenes
    use frb_checks, only: tally, worst_of
    use frb_extrapolation, only: extrapolate
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use frb_scenes, only: heavy_top
    use frb_schemes, only: scheme_names, splitting_scheme
    use frb_splitting, only: integrate
    use frb_status, only: status_bad_time, status_ok, status_stopped
    use frb_torque, only: body_scene
    use frb_torque_cases, only: dipoles, distance, known_top, recorder, start_of_group, top_case
    use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
    implicit none
    private

    public :: test_open_scenes

    real(wp), parameter :: eps = epsilon(1.0_wp)
    integer, parameter :: n = 7, names = size(scheme_names)
    integer, parameter :: own_code = 77         ! of a scene of the user's

    !> A heavy top that counts, refuses on demand, and hears of the refusals of others.
    type, extends(body_scene) :: shared_top
        type(heavy_top) :: top
        integer :: asked = 0                    ! torques so far
        integer :: agreed = 0                   ! calls of the hook so far
        integer :: refuse_at = 0                ! torque that is refused
        integer :: spoil_at = 0                 ! torque that is NaN
        integer :: said_at = 0                  ! first call of the hook with a code of an error
        integer :: others_refuse_at = 0         ! call of the hook at which another process refuses
        integer :: last_code = 0                ! code in the last call of the hook
    contains
        procedure :: torque => shared_torque
        procedure :: agree => shared_agree
    end type shared_top

    !> Dipoles that count and refuse in the same way.
    type, extends(dipoles) :: shared_dipoles
        integer :: agreed = 0
        integer :: others_refuse_at = 0
    contains
        procedure :: agree => dipoles_agree
    end type shared_dipoles

contains

    subroutine test_open_scenes(t)
        type(tally), intent(inout) :: t

        call t%open_suite('open-scenes', 25)
        call test_refusing_scenes(t)
        call test_agreeing(t)
        call test_extrapolate(t)
        call test_joined(t)
        call t%close_suite()
    end subroutine test_open_scenes

    subroutine shared_torque(self, q, t, tau, stat)
        class(shared_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        call self%top%torque(q, t, tau, stat)
        self%asked = self%asked + 1
        if (self%asked == self%refuse_at) stat = own_code
        if (self%asked == self%spoil_at) tau(2) = ieee_value(t, ieee_quiet_nan)
    end subroutine shared_torque

    subroutine shared_agree(self, code)
        class(shared_top), intent(inout) :: self
        integer, intent(inout) :: code

        self%agreed = self%agreed + 1
        self%last_code = code
        if (code /= status_ok .and. self%said_at == 0) self%said_at = self%agreed
        if (self%agreed == self%others_refuse_at) code = max(code, own_code)
    end subroutine shared_agree

    subroutine dipoles_agree(self, code)
        class(shared_dipoles), intent(inout) :: self
        integer, intent(inout) :: code

        self%agreed = self%agreed + 1
        if (self%agreed == self%others_refuse_at) code = max(code, own_code)
    end subroutine dipoles_agree

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
                ! One step more is not possible: it needs the torque that is refused.
                scene = shared_top(top=item%top)
                call integrate(item%body, scheme, scene, 0.05_wp, done + 1, m_short, q_short)
                good = good .and. scene%asked >= i - done*scheme%stages()
            end do
            call t%ok(trim(scheme_names(k))//'-ends-with-the-last-whole-step-before-a-refusal', good)
        end do
    end subroutine test_refusing_scenes

    !> Two processes, one after the other: a torque is refused, or is NaN, on the first, and the second hears
    !> of it by the hook alone. Both ask for the same torques, or one of them would wait for ever.
    subroutine test_extrapolate(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(shared_top) :: one, other
        real(wp) :: m(3), q(4), m_other(3), q_other(4)
        integer :: i, stat, stat_other
        logical :: refused, spoilt

        item = known_top(2)
        refused = .true.
        spoilt = .true.
        do i = 1, 60
            one = shared_top(top=item%top, refuse_at=i)
            call run_both()
            ! The second torque only serves the first guess of a step.
            refused = refused .and. stat == merge(status_ok, own_code, i == 2) .and. stat_other == stat &
                      .and. one%said_at > 0 &
                      .and. one%asked == other%asked .and. one%agreed == other%agreed
            one = shared_top(top=item%top, spoil_at=i)
            call run_both()
            spoilt = spoilt .and. one%said_at > 0 .and. one%asked == other%asked &
                     .and. one%agreed == other%agreed &
                     .and. (stat == status_ok .eqv. stat_other == status_ok) &
                     .and. all(abs(m - m_other) <= 0.0_wp)
        end do
        call t%ok('processes-that-extrapolate-end-together-where-one-refuses', refused)
        call t%ok('processes-that-extrapolate-stay-together-where-one-has-nan', spoilt)

    contains

        !> The run of the first process, and that of the second, which hears of what the first one said.
        subroutine run_both()
            m = item%m0
            q = item%q0
            call extrapolate(item%body, one, 2.0_wp, m, q, 1.0e-9_wp, stat=stat)
            other = shared_top(top=item%top, others_refuse_at=one%said_at)
            m_other = item%m0
            q_other = item%q0
            call extrapolate(item%body, other, 2.0_wp, m_other, q_other, 1.0e-9_wp, stat=stat_other)
        end subroutine run_both

    end subroutine test_extrapolate

    !> The hook gets every code before it takes effect, and the code that it returns ends the run.
    subroutine test_agreeing(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(shared_top) :: scene
        type(shared_dipoles) :: group
        type(rigid_body) :: body(n)
        type(recorder) :: record
        real(wp) :: m(3), q(4), time, ms(3, n), qs(4, n), ms_start(3, n), qs_start(4, n)
        integer :: i, stat, calls, ended
        logical :: good

        item = known_top(2)
        scheme = splitting_scheme('srkn14')
        scene = shared_top(top=item%top)
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, scene, 0.05_wp, 4, m, q, record)
        calls = scene%agreed
        ! At the start, after each torque, at the end of each step, after each state shown.
        call t%equal('the-hook-is-asked-wherever-a-run-may-end', calls, 1 + 4*14 + 4 + 5)
        good = .true.
        do i = 1, calls
            scene = shared_top(top=item%top, others_refuse_at=i)
            m = item%m0
            q = item%q0
            time = 0.0_wp
            call integrate(item%body, scheme, scene, 0.05_wp, 4, m, q, record, t=time, stat=stat)
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
        record%stop_at = 1
        call integrate(item%body, scheme, scene, 0.05_wp, 4, m, q, record, stat=stat)
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

    !> Drifts of two steps joined to one: the same run to rounding, one drift less in each step.
    subroutine test_joined(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(recorder) :: record
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
            record%count = 0
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m_joined, q_joined, record, every=8, &
                           joined=.true.)
            worst(2) = worst_of(worst(2), distance(m, q, record%m(:, 6), record%q(:, 6)))
            ! A joined run that a refusal ends has made its last drift: the state is that of a whole step.
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

end module frb_test_open_scenes
