!> The run of one body: see frb_splitting.
module frb_splitting_one
    use frb_exact_updates, only: turn_state, kick_state
    use frb_free_flow, only: core_of, free_flow, rigid_body
    use frb_kinds, only: wp
    use frb_schemes, only: splitting_scheme
    use frb_splitting_plan, only: timetable, new_timetable, check_run, is_attitude
    use frb_status, only: conclude, status_ok, status_bad_attitude, status_bad_momentum, status_bad_torque
    use frb_torque, only: body_scene, body_observer, body_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: integrate_body

    !> Momentum and attitude, and what they lack in a compensated run.
    type :: body_state
        real(wp) :: m(3) = 0.0_wp
        real(wp) :: q(4) = 0.0_wp
        real(wp) :: m_rest(3) = 0.0_wp
        real(wp) :: q_rest(4) = 0.0_wp
    end type body_state

contains

    !> One body.
    subroutine integrate_body(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                               compensated, stat)
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
        logical, intent(in), optional :: compensated                !! default: .false.
        integer, intent(out), optional :: stat                      !! status code
        type(timetable) :: table
        type(body_state) :: now, seen
        real(wp) :: tau(3), start
        integer :: code, spacing, step

        call check_run(body%status(), scheme, h, nsteps, spacing, start, code, every, t)
        if (code == status_ok .and. .not. all(ieee_is_finite(m))) code = status_bad_momentum
        if (code == status_ok) then
            if (.not. is_attitude(q)) code = status_bad_attitude
        end if
        if (code /= status_ok) then
            call conclude(code, 'integrate', stat)
            return
        end if

        table = new_timetable(scheme, h, compensated)
        now%m = m
        now%q = q
        tau = 0.0_wp
        if (present(observer)) call observer%observe(0, start, now%m, now%q)
        if (nsteps > 0) then
            if (.not. table%drift_first) call scene%torque(now%q, start, tau)
            call outer_stage(body, table, table%outer, tau, now, code, drift)
        end if
        do step = 1, nsteps
            if (code /= status_ok) exit
            call inner_stages(body, table, scene, start + (step - 1)*h, now, tau, code, drift)
            if (code /= status_ok) exit
            if (present(observer)) then
                if (mod(step, spacing) == 0) then
                    seen = now
                    call outer_stage(body, table, table%outer, tau, seen, code, drift)
                    if (code /= status_ok) exit
                    call observer%observe(step, start + step*h, seen%m, seen%q)
                end if
            end if
            call outer_stage(body, table, merge(table%joint, table%outer, step < nsteps), tau, now, code, &
                             drift)
        end do

        if (code == status_ok .and. .not. all(ieee_is_finite(now%m))) code = status_bad_torque
        if (code == status_ok) then
            m = now%m
            q = now%q
            if (present(t)) t = start + nsteps*h
        end if
        call conclude(code, 'integrate', stat)
    end subroutine integrate_body

    !> All stages of a step but the outer ones; leaves the last torque in `tau`.
    subroutine inner_stages(body, table, scene, start, now, tau, code, drift)
        type(rigid_body), intent(in) :: body
        type(timetable), intent(in) :: table
        class(body_scene), intent(in) :: scene
        real(wp), intent(in) :: start               ! time at the start of the step
        type(body_state), intent(inout) :: now
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift
        integer :: i

        code = status_ok
        do i = 1, table%stages
            if (i > 1 .or. .not. table%drift_first) then
                call do_drift(body, table, table%drift(i), now, code, drift)
                if (code /= status_ok) return
            end if
            call scene%torque(now%q, start + table%time(i), tau)
            if (i < table%stages .or. table%drift_first) then
                call do_kick(table, table%kick(i), tau, now, code)
                if (code /= status_ok) return
            end if
        end do
    end subroutine inner_stages

    !> The stage that closes a step, or closes one and opens the next; a kick by the torque at hand.
    subroutine outer_stage(body, table, amount, tau, now, code, drift)
        type(rigid_body), intent(in) :: body
        type(timetable), intent(in) :: table
        real(wp), intent(in) :: amount              ! coefficient times h
        real(wp), intent(in) :: tau(3)
        type(body_state), intent(inout) :: now
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift

        if (table%drift_first) then
            call do_drift(body, table, amount, now, code, drift)
        else
            call do_kick(table, amount, tau, now, code)
        end if
    end subroutine outer_stage

    !> The free body for a time h.
    subroutine do_drift(body, table, h, now, code, drift)
        type(rigid_body), intent(in) :: body
        type(timetable), intent(in) :: table
        real(wp), intent(in) :: h
        type(body_state), intent(inout) :: now
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift
        real(wp) :: m(3), turn(4)

        if (.not. table%compensated) then
            if (present(drift)) then
                call drift%advance(body, h, now%m, now%q, code)
            else
                call free_flow(body, h, now%m, now%q, code)
            end if
        else
            m = now%m
            turn = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            if (present(drift)) then
                call drift%advance(body, h, m, turn, code)
            else
                call free_flow(body, h, m, turn, code)
            end if
            if (code == status_ok) call turn_state(core_of(body), turn, now%m, now%m_rest, now%q, now%q_rest)
        end if
    end subroutine do_drift

    !> m + h tau.
    pure subroutine do_kick(table, h, tau, now, code)
        type(timetable), intent(in) :: table
        real(wp), intent(in) :: h, tau(3)
        type(body_state), intent(inout) :: now
        integer, intent(out) :: code
        real(wp) :: total

        ! A NaN or Inf shows in the sum, which is compared only when there is none.
        code = status_bad_torque
        total = 0.25_wp*abs(tau(1)) + 0.25_wp*abs(tau(2)) + 0.25_wp*abs(tau(3))
        if (.not. ieee_is_finite(total)) return
        if (total > 0.25_wp*table%largest_torque) return
        code = status_ok
        if (table%compensated) then
            call kick_state(h, tau, now%m, now%m_rest)
        else
            now%m = now%m + h*tau
        end if
    end subroutine do_kick

end module frb_splitting_one
