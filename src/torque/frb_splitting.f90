!> Bodies under torque: the free flow (drift) and the torque (kick) in turns, H = T + V.
!>
!> One step of an ABA scheme is drift(a1 h) kick(b1 h) drift(a2 h) ... drift(a1 h), section 4.3 and the
!> appendix of the paper; time passes with the drift. The stage that closes a step and the one that opens the
!> next are done as one. A state that is shown to an observer is completed on a copy, so watching a run does
!> not change it, not even in the last digit.
module frb_splitting
    use frb_free_flow, only: free_flow
    use frb_inertia, only: rigid_body
    use frb_kinds, only: wp
    use frb_schemes, only: splitting_scheme, most_stages
    use frb_status, only: conclude, status_ok, status_bad_attitude, status_bad_count, status_bad_momentum, &
        status_bad_time, status_bad_torque
    use frb_torque, only: body_scene, group_scene, body_observer, group_observer, body_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: integrate

    !> Integrates one body, or n bodies that interact, over `nsteps` steps of size `h`, in place:
    !> `call integrate(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, stat)`.
    !>
    !> For n bodies m is (3, n), q is (4, n), the body a scalar or body(n), scene and observer those of a
    !> group. Refused with `stat`, the state and t untouched: a body or scheme that could not be made (their
    !> own code); h zero or not finite or t not finite (`status_bad_time`); nsteps < 0, every < 1 or sizes
    !> that differ (`status_bad_count`); m not finite (`status_bad_momentum`); q not finite or of norm zero
    !> (`status_bad_attitude`); a torque that is not finite, at any time of the run (`status_bad_torque`).
    !> Accuracy: energy of the paper's heavy top within 1e-13 over 1e5 steps of 0.5; checked by `splitting:
    !> energy-of-the-papers-top-stays-within-1e-13`.
    interface integrate
        module procedure integrate_body
        module procedure integrate_alike
        module procedure integrate_group
    end interface integrate

    !> The stages of a chain of steps, multiplied by h. Within a step come drift(i), the torque at time(i),
    !> kick(i), without the first drift (ABA) or the last kick (BAB): that is the outer stage, shared by two
    !> steps.
    type :: timetable
        integer :: stages = 0                   ! torque evaluations per step
        logical :: drift_first = .true.         ! ABA: the outer stage is a drift
        real(wp) :: drift(most_stages) = 0.0_wp
        real(wp) :: kick(most_stages) = 0.0_wp
        real(wp) :: time(most_stages) = 0.0_wp  ! of each torque, from the start of the step
        real(wp) :: outer = 0.0_wp              ! outer stage at the start of the run and where it ends
        real(wp) :: joint = 0.0_wp              ! outer stage between two steps
    end type timetable

contains

    !> One body.
    subroutine integrate_body(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, stat)
        type(rigid_body), intent(in) :: body
        type(splitting_scheme), intent(in) :: scheme
        class(body_scene), intent(in) :: scene                      !! the torque
        real(wp), intent(in) :: h                                   !! step, of either sign, not zero
        integer, intent(in) :: nsteps                               !! number of steps, >= 0
        real(wp), intent(inout) :: m(3)                             !! angular momentum, body frame
        real(wp), intent(inout) :: q(4)                             !! attitude, unit quaternion
        class(body_observer), intent(inout), optional :: observer   !! at the start and every `every` steps
        integer, intent(in), optional :: every                      !! >= 1, default 1
        real(wp), intent(inout), optional :: t                      !! time, goes on by nsteps*h; from 0
        class(body_drift), intent(in), optional :: drift            !! default: the free flow
        integer, intent(out), optional :: stat                      !! status code
        type(timetable) :: table
        real(wp) :: m_now(3), q_now(4), m_seen(3), q_seen(4), tau(3), start
        integer :: code, spacing, step

        call check_run(body%status, scheme, h, nsteps, spacing, start, code, every, t)
        if (code == status_ok .and. .not. all(ieee_is_finite(m))) code = status_bad_momentum
        if (code == status_ok) then
            if (.not. is_attitude(q)) code = status_bad_attitude
        end if
        if (code /= status_ok) then
            call conclude(code, 'integrate', stat)
            return
        end if

        table = new_timetable(scheme, h)
        m_now = m
        q_now = q
        tau = 0.0_wp
        if (present(observer)) call observer%observe(0, start, m_now, q_now)
        if (nsteps > 0) then
            if (.not. table%drift_first) call scene%torque(q_now, start, tau)
            call outer_stage_of_body(body, table, table%outer, tau, m_now, q_now, code, drift)
        end if
        do step = 1, nsteps
            if (code /= status_ok) exit
            call inner_stages_of_body(body, table, scene, start + (step - 1)*h, m_now, q_now, tau, code, &
                                      drift)
            if (code /= status_ok) exit
            if (present(observer)) then
                if (mod(step, spacing) == 0) then
                    m_seen = m_now
                    q_seen = q_now
                    call outer_stage_of_body(body, table, table%outer, tau, m_seen, q_seen, code, drift)
                    if (code /= status_ok) exit
                    call observer%observe(step, start + step*h, m_seen, q_seen)
                end if
            end if
            call outer_stage_of_body(body, table, merge(table%joint, table%outer, step < nsteps), tau, &
                                     m_now, q_now, code, drift)
        end do

        if (code == status_ok) then
            m = m_now
            q = q_now
            if (present(t)) t = start + nsteps*h
        end if
        call conclude(code, 'integrate', stat)
    end subroutine integrate_body

    !> All stages of a step but the outer ones; leaves the last torque in `tau`.
    subroutine inner_stages_of_body(body, table, scene, start, m, q, tau, code, drift)
        type(rigid_body), intent(in) :: body
        type(timetable), intent(in) :: table
        class(body_scene), intent(in) :: scene
        real(wp), intent(in) :: start               ! time at the start of the step
        real(wp), intent(inout) :: m(3), q(4)
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift
        integer :: i

        code = status_ok
        do i = 1, table%stages
            if (i > 1 .or. .not. table%drift_first) then
                call drift_of_body(body, table%drift(i), m, q, code, drift)
                if (code /= status_ok) return
            end if
            call scene%torque(q, start + table%time(i), tau)
            if (i < table%stages .or. table%drift_first) then
                call kick_of_body(table%kick(i), tau, m, code)
                if (code /= status_ok) return
            end if
        end do
    end subroutine inner_stages_of_body

    !> The stage that closes a step, or closes one and opens the next; a kick by the torque at hand.
    subroutine outer_stage_of_body(body, table, amount, tau, m, q, code, drift)
        type(rigid_body), intent(in) :: body
        type(timetable), intent(in) :: table
        real(wp), intent(in) :: amount              ! coefficient times h
        real(wp), intent(in) :: tau(3)
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift

        if (table%drift_first) then
            call drift_of_body(body, amount, m, q, code, drift)
        else
            call kick_of_body(amount, tau, m, code)
        end if
    end subroutine outer_stage_of_body

    !> The free body for a time h, in place.
    subroutine drift_of_body(body, h, m, q, code, drift)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift

        if (present(drift)) then
            call drift%advance(body, h, m, q, code)
        else
            call free_flow(body, h, m, q, code)
        end if
    end subroutine drift_of_body

    !> m + h tau, in place.
    pure subroutine kick_of_body(h, tau, m, code)
        real(wp), intent(in) :: h, tau(3)
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code

        code = status_ok
        if (ieee_is_finite(tau(1)) .and. ieee_is_finite(tau(2)) .and. ieee_is_finite(tau(3))) then
            m = m + h*tau
        else
            code = status_bad_torque
        end if
    end subroutine kick_of_body

    !> n bodies that are alike.
    subroutine integrate_alike(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, stat)
        type(rigid_body), intent(in) :: body
        type(splitting_scheme), intent(in) :: scheme
        class(group_scene), intent(in) :: scene                     !! the torques
        real(wp), intent(in) :: h                                   !! step, of either sign, not zero
        integer, intent(in) :: nsteps                               !! number of steps, >= 0
        real(wp), contiguous, intent(inout) :: m(:, :)              !! angular momenta (3, n), body frames
        real(wp), contiguous, intent(inout) :: q(:, :)              !! attitudes (4, n), unit quaternions
        class(group_observer), intent(inout), optional :: observer  !! at the start and every `every` steps
        integer, intent(in), optional :: every                      !! >= 1, default 1
        real(wp), intent(inout), optional :: t                      !! time, goes on by nsteps*h; from 0
        class(body_drift), intent(in), optional :: drift            !! default: the free flow
        integer, intent(out), optional :: stat                      !! status code

        call integrate_group([body], scheme, scene, h, nsteps, m, q, observer, every, t, drift, stat)
    end subroutine integrate_alike

    !> n bodies, each with moments of its own.
    subroutine integrate_group(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, stat)
        type(rigid_body), intent(in) :: body(:)                     !! n bodies, or one for all
        type(splitting_scheme), intent(in) :: scheme
        class(group_scene), intent(in) :: scene                     !! the torques
        real(wp), intent(in) :: h                                   !! step, of either sign, not zero
        integer, intent(in) :: nsteps                               !! number of steps, >= 0
        real(wp), contiguous, intent(inout) :: m(:, :)              !! angular momenta (3, n), body frames
        real(wp), contiguous, intent(inout) :: q(:, :)              !! attitudes (4, n), unit quaternions
        class(group_observer), intent(inout), optional :: observer  !! at the start and every `every` steps
        integer, intent(in), optional :: every                      !! >= 1, default 1
        real(wp), intent(inout), optional :: t                      !! time, goes on by nsteps*h; from 0
        class(body_drift), intent(in), optional :: drift            !! default: the free flow, in a batch
        integer, intent(out), optional :: stat                      !! status code
        type(timetable) :: table
        real(wp), allocatable :: m_now(:, :), q_now(:, :), m_seen(:, :), q_seen(:, :), tau(:, :)
        real(wp) :: start
        integer :: body_status, code, spacing, step, i

        body_status = status_ok
        do i = 1, size(body)
            if (body_status == status_ok) body_status = body(i)%status
        end do
        call check_run(body_status, scheme, h, nsteps, spacing, start, code, every, t)
        if (code == status_ok) code = check_group(size(body), m, q)
        if (code /= status_ok) then
            call conclude(code, 'integrate', stat)
            return
        end if

        table = new_timetable(scheme, h)
        m_now = m
        q_now = q
        allocate (tau(3, size(m, 2)), source=0.0_wp)
        if (present(observer)) then
            m_seen = m
            q_seen = q
            call observer%observe(0, start, m_now, q_now)
        end if
        if (nsteps > 0) then
            if (.not. table%drift_first) call scene%torques(q_now, start, tau)
            call outer_stage_of_group(body, table, table%outer, tau, m_now, q_now, code, drift)
        end if
        do step = 1, nsteps
            if (code /= status_ok) exit
            call inner_stages_of_group(body, table, scene, start + (step - 1)*h, m_now, q_now, tau, code, &
                                       drift)
            if (code /= status_ok) exit
            if (present(observer)) then
                if (mod(step, spacing) == 0) then
                    m_seen(:, :) = m_now
                    q_seen(:, :) = q_now
                    call outer_stage_of_group(body, table, table%outer, tau, m_seen, q_seen, code, drift)
                    if (code /= status_ok) exit
                    call observer%observe(step, start + step*h, m_seen, q_seen)
                end if
            end if
            call outer_stage_of_group(body, table, merge(table%joint, table%outer, step < nsteps), tau, &
                                      m_now, q_now, code, drift)
        end do

        if (code == status_ok) then
            m = m_now
            q = q_now
            if (present(t)) t = start + nsteps*h
        end if
        call conclude(code, 'integrate', stat)
    end subroutine integrate_group

    !> All stages of a step but the outer ones; leaves the last torques in `tau`.
    subroutine inner_stages_of_group(body, table, scene, start, m, q, tau, code, drift)
        type(rigid_body), intent(in) :: body(:)
        type(timetable), intent(in) :: table
        class(group_scene), intent(in) :: scene
        real(wp), intent(in) :: start               ! time at the start of the step
        real(wp), contiguous, intent(inout) :: m(:, :), q(:, :)
        real(wp), contiguous, intent(inout) :: tau(:, :)
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift
        integer :: i

        code = status_ok
        do i = 1, table%stages
            if (i > 1 .or. .not. table%drift_first) then
                call drift_of_group(body, table%drift(i), m, q, code, drift)
                if (code /= status_ok) return
            end if
            call scene%torques(q, start + table%time(i), tau)
            if (i < table%stages .or. table%drift_first) then
                call kick_of_group(table%kick(i), tau, m, code)
                if (code /= status_ok) return
            end if
        end do
    end subroutine inner_stages_of_group

    !> The stage that closes a step, or closes one and opens the next; a kick by the torques at hand.
    subroutine outer_stage_of_group(body, table, amount, tau, m, q, code, drift)
        type(rigid_body), intent(in) :: body(:)
        type(timetable), intent(in) :: table
        real(wp), intent(in) :: amount              ! coefficient times h
        real(wp), contiguous, intent(in) :: tau(:, :)
        real(wp), contiguous, intent(inout) :: m(:, :), q(:, :)
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift

        if (table%drift_first) then
            call drift_of_group(body, amount, m, q, code, drift)
        else
            call kick_of_group(amount, tau, m, code)
        end if
    end subroutine outer_stage_of_group

    !> The free bodies for a time h, in place: the batch form of the free flow, or one by one.
    subroutine drift_of_group(body, h, m, q, code, drift)
        type(rigid_body), intent(in) :: body(:)
        real(wp), intent(in) :: h
        real(wp), contiguous, intent(inout) :: m(:, :), q(:, :)
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift
        integer :: i

        code = status_ok
        if (present(drift)) then
            do i = 1, size(m, 2)
                call drift%advance(body(min(i, size(body))), h, m(:, i), q(:, i), code)
                if (code /= status_ok) return
            end do
        else if (size(body) == 1) then
            call free_flow(body(1), h, m, q, code)
        else
            call free_flow(body, h, m, q, code)
        end if
    end subroutine drift_of_group

    !> m + h tau, in place.
    pure subroutine kick_of_group(h, tau, m, code)
        real(wp), intent(in) :: h
        real(wp), contiguous, intent(in) :: tau(:, :)
        real(wp), contiguous, intent(inout) :: m(:, :)
        integer, intent(out) :: code

        code = status_ok
        if (all(ieee_is_finite(tau))) then
            m = m + h*tau
        else
            code = status_bad_torque
        end if
    end subroutine kick_of_group

    !> What is common to every call: first thing that is wrong, and defaults.
    pure subroutine check_run(body_status, scheme, h, nsteps, spacing, start, code, every, t)
        integer, intent(in) :: body_status
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        integer, intent(in) :: nsteps
        integer, intent(out) :: spacing
        real(wp), intent(out) :: start
        integer, intent(out) :: code
        integer, intent(in), optional :: every
        real(wp), intent(in), optional :: t

        spacing = 1
        if (present(every)) spacing = every
        start = 0.0_wp
        if (present(t)) start = t
        code = body_status
        if (code == status_ok) code = scheme%status
        if (code == status_ok .and. (nsteps < 0 .or. spacing < 1)) code = status_bad_count
        if (code == status_ok) then
            code = status_bad_time
            if (ieee_is_finite(h) .and. ieee_is_finite(start)) then
                if (abs(h) > 0.0_wp) code = status_ok
            end if
        end if
    end subroutine check_run

    !> Sizes and values of the state of a group.
    pure function check_group(bodies, m, q) result(code)
        integer, intent(in) :: bodies
        real(wp), intent(in) :: m(:, :), q(:, :)
        integer :: code
        integer :: n, i

        n = size(m, 2)
        code = status_bad_count
        if (size(m, 1) /= 3 .or. size(q, 1) /= 4 .or. size(q, 2) /= n) return
        if (bodies /= 1 .and. bodies /= n) return
        code = status_bad_momentum
        if (.not. all(ieee_is_finite(m))) return
        code = status_bad_attitude
        do i = 1, n
            if (.not. is_attitude(q(:, i))) return
        end do
        code = status_ok
    end function check_group

    !> Whether q can stand for an attitude: finite and not zero.
    pure function is_attitude(q) result(good)
        real(wp), intent(in) :: q(4)
        logical :: good

        good = all(ieee_is_finite(q))
        if (good) good = any(abs(q) > 0.0_wp)
    end function is_attitude

    !> The scheme's stages for steps of size h.
    pure function new_timetable(scheme, h) result(table)
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        type(timetable) :: table
        real(wp) :: a(scheme%drifts), b(scheme%kicks)
        integer :: i, s

        a = scheme%drift_coefficients()
        b = scheme%kick_coefficients()
        s = scheme%stages()
        table%stages = s
        table%drift_first = scheme%drift_first
        table%time(1:s) = [(sum(a(1:i))*h, i=1, s)]
        if (scheme%drift_first) then
            table%outer = a(1)*h
            table%joint = 2*a(1)*h
            table%drift(2:s) = a(2:s)*h
            table%kick(1:s) = b*h
        else
            table%outer = b(1)*h
            table%joint = 2*b(1)*h
            table%drift(1:s) = a*h
            table%kick(1:s - 1) = b(2:s)*h
            table%time(s) = h
        end if
    end function new_timetable

end module frb_splitting
