!> The run of n bodies that interact: see frb_splitting.
module frb_splitting_many
    use frb_exact_updates, only: turn_state, kick_state
    use frb_free_flow, only: core_of, free_flow, rigid_body
    use frb_kinds, only: wp
    use frb_schemes, only: splitting_scheme
    use frb_splitting_plan, only: timetable, new_timetable, check_run, is_attitude
    use frb_status, only: conclude, status_ok, status_bad_attitude, status_bad_count, status_bad_momentum, &
        status_bad_torque
    use frb_torque, only: group_scene, group_observer, body_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: integrate_alike, integrate_group

    !> Momenta (3, n) and attitudes (4, n); what they lack and room for the turns in a compensated run.
    type :: group_state
        real(wp), allocatable :: m(:, :), q(:, :)
        real(wp), allocatable :: m_rest(:, :), q_rest(:, :), m_new(:, :), turn(:, :)
    end type group_state

contains

    !> n bodies that are alike.
    subroutine integrate_alike(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                               compensated, stat)
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
        logical, intent(in), optional :: compensated                !! default: .false.
        integer, intent(out), optional :: stat                      !! status code

        call integrate_group([body], scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                             compensated, stat)
    end subroutine integrate_alike

    !> n bodies, each with moments of its own.
    subroutine integrate_group(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                               compensated, stat)
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
        logical, intent(in), optional :: compensated                !! default: .false.
        integer, intent(out), optional :: stat                      !! status code
        type(timetable) :: table
        type(group_state) :: now, seen
        real(wp), allocatable :: tau(:, :)
        real(wp) :: start
        integer :: body_status, code, spacing, step, i

        body_status = status_ok
        do i = 1, size(body)
            if (body_status == status_ok) body_status = body(i)%status()
        end do
        call check_run(body_status, scheme, h, nsteps, spacing, start, code, every, t)
        if (code == status_ok) code = check_group(size(body), m, q)
        if (code /= status_ok) then
            call conclude(code, 'integrate', stat)
            return
        end if

        table = new_timetable(scheme, h, compensated)
        now%m = m
        now%q = q
        allocate (tau(3, size(m, 2)), source=0.0_wp)
        if (table%compensated) then
            allocate (now%m_rest(3, size(m, 2)), now%m_new(3, size(m, 2)), source=0.0_wp)
            allocate (now%q_rest(4, size(m, 2)), now%turn(4, size(m, 2)), source=0.0_wp)
        end if
        if (present(observer)) then
            seen = now
            call observer%observe(0, start, now%m, now%q)
        end if
        if (nsteps > 0) then
            if (.not. table%drift_first) call scene%torques(now%q, start, tau)
            call outer_stage(body, table, table%outer, tau, now, code, drift)
        end if
        do step = 1, nsteps
            if (code /= status_ok) exit
            call inner_stages(body, table, scene, start + (step - 1)*h, now, tau, code, drift)
            if (code /= status_ok) exit
            if (present(observer)) then
                if (mod(step, spacing) == 0) then
                    call copy_state(now, seen)
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
    end subroutine integrate_group

    !> A copy of `from` in `to`, both allocated alike: plain assignment would allocate anew.
    pure subroutine copy_state(from, to)
        type(group_state), intent(in) :: from
        type(group_state), intent(inout) :: to

        to%m(:, :) = from%m
        to%q(:, :) = from%q
        if (allocated(from%m_rest)) then
            to%m_rest(:, :) = from%m_rest
            to%q_rest(:, :) = from%q_rest
        end if
    end subroutine copy_state

    !> All stages of a step but the outer ones; leaves the last torques in `tau`.
    subroutine inner_stages(body, table, scene, start, now, tau, code, drift)
        type(rigid_body), intent(in) :: body(:)
        type(timetable), intent(in) :: table
        class(group_scene), intent(in) :: scene
        real(wp), intent(in) :: start               ! time at the start of the step
        type(group_state), intent(inout) :: now
        real(wp), contiguous, intent(inout) :: tau(:, :)
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift
        integer :: i

        code = status_ok
        do i = 1, table%stages
            if (i > 1 .or. .not. table%drift_first) then
                call do_drift(body, table, table%drift(i), now, code, drift)
                if (code /= status_ok) return
            end if
            call scene%torques(now%q, start + table%time(i), tau)
            if (i < table%stages .or. table%drift_first) then
                call do_kick(table, table%kick(i), tau, now, code)
                if (code /= status_ok) return
            end if
        end do
    end subroutine inner_stages

    !> The stage that closes a step, or closes one and opens the next; a kick by the torques at hand.
    subroutine outer_stage(body, table, amount, tau, now, code, drift)
        type(rigid_body), intent(in) :: body(:)
        type(timetable), intent(in) :: table
        real(wp), intent(in) :: amount              ! coefficient times h
        real(wp), contiguous, intent(in) :: tau(:, :)
        type(group_state), intent(inout) :: now
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift

        if (table%drift_first) then
            call do_drift(body, table, amount, now, code, drift)
        else
            call do_kick(table, amount, tau, now, code)
        end if
    end subroutine outer_stage

    !> The free bodies for a time h.
    subroutine do_drift(body, table, h, now, code, drift)
        type(rigid_body), intent(in) :: body(:)
        type(timetable), intent(in) :: table
        real(wp), intent(in) :: h
        type(group_state), intent(inout) :: now
        integer, intent(out) :: code
        class(body_drift), intent(in), optional :: drift
        integer :: i

        if (.not. table%compensated) then
            call advance_all(body, h, now%m, now%q, code, drift)
        else
            now%m_new(:, :) = now%m
            now%turn(1, :) = 1.0_wp
            now%turn(2:4, :) = 0.0_wp
            call advance_all(body, h, now%m_new, now%turn, code, drift)
            if (code /= status_ok) return
            do i = 1, size(now%m, 2)
                call turn_state(core_of(body(min(i, size(body)))), now%turn(:, i), now%m(:, i), &
                                now%m_rest(:, i), now%q(:, i), now%q_rest(:, i))
            end do
        end if
    end subroutine do_drift

    !> All bodies, in place: the batch form of the free flow, or the user's drift one by one.
    subroutine advance_all(body, h, m, q, code, drift)
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
    end subroutine advance_all

    !> m + h tau.
    pure subroutine do_kick(table, h, tau, now, code)
        type(timetable), intent(in) :: table
        real(wp), intent(in) :: h
        real(wp), contiguous, intent(in) :: tau(:, :)
        type(group_state), intent(inout) :: now
        integer, intent(out) :: code
        real(wp) :: total
        integer :: i

        code = status_bad_torque
        do i = 1, size(tau, 2)
            total = 0.25_wp*abs(tau(1, i)) + 0.25_wp*abs(tau(2, i)) + 0.25_wp*abs(tau(3, i))
            if (.not. ieee_is_finite(total)) return
            if (total > 0.25_wp*table%largest_torque) return
        end do
        code = status_ok
        if (table%compensated) then
            do i = 1, size(tau, 2)
                call kick_state(h, tau(:, i), now%m(:, i), now%m_rest(:, i))
            end do
        else
            now%m = now%m + h*tau
        end if
    end subroutine do_kick

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

end module frb_splitting_many
