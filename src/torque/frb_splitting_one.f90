!> The run of one body: see frb_splitting.
module frb_splitting_one
    use frb_exact_updates, only: turn_state, kick_state
    use frb_flow_one, only: flow_body
    use frb_free_flow, only: core_of, rigid_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_modified_kicks, only: gradient_torque, inverse_inertia, turned
    use frb_rotations, only: cross, is_unit_quat
    use frb_schemes, only: splitting_scheme
    use frb_splitting_plan, only: splitting_plan, run_basis, new_basis, check_run
    use frb_status, only: return_or_stop, status_ok, status_bad_attitude, status_bad_momentum, &
        status_bad_torque, status_not_offered, status_stopped
    use frb_torque, only: body_scene, body_observer, body_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: integrate_body

    !> Momentum and attitude, in a compensated run with their rounding errors, and the state at the last whole
    !> step.
    type :: moving
        type(run_basis) :: basis
        real(wp) :: m(3) = 0.0_wp
        real(wp) :: q(4) = 0.0_wp
        real(wp) :: m_rest(3) = 0.0_wp
        real(wp) :: q_rest(4) = 0.0_wp
        real(wp) :: tau(3) = 0.0_wp
        real(wp) :: g(3) = 0.0_wp               ! see frb_modified_kicks
        real(wp) :: response(3, 3) = 0.0_wp     ! I^-1 in the body frame
        real(wp) :: kept(14) = 0.0_wp
        type(body_core) :: core
        type(rigid_body), pointer :: body => null()
        class(body_scene), pointer :: scene => null()
        class(body_observer), pointer :: observer => null()
        class(body_drift), pointer :: drift => null()           !! null: the free flow
    end type moving

contains

    !> One body.
    subroutine integrate_body(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                              compensated, rests, joined, stat)
        type(rigid_body), intent(in), target :: body
        type(splitting_scheme), intent(in) :: scheme
        class(body_scene), intent(inout), target :: scene           !! the torque
        real(wp), intent(in) :: h                                   !! step, of either sign, not zero
        integer(int64), intent(in) :: nsteps                        !! number of steps, >= 0
        real(wp), intent(inout) :: m(3)                             !! angular momentum, body frame
        real(wp), intent(inout) :: q(4)                             !! attitude, unit quaternion
        class(body_observer), intent(inout), optional, target :: observer  !! at start, every `every` steps
        integer, intent(in), optional :: every                      !! >= 1, default 1
        real(wp), intent(inout), optional :: t                      !! time, goes on by nsteps*h; from 0
        class(body_drift), intent(in), optional, target :: drift    !! default: the free flow
        logical, intent(in), optional :: compensated                !! default: .false.
        real(wp), intent(inout), optional :: rests(7)               !! rounding errors of m and q; from 0
        logical, intent(in), optional :: joined                     !! default: .false.
        integer, intent(out), optional :: stat                      !! status code
        type(splitting_plan) :: plan
        type(moving) :: run
        real(wp) :: time
        integer :: code, spacing

        call check_run(body%status(), scheme, h, nsteps, spacing, time, code, every, t)
        if (code == status_ok .and. .not. all(ieee_is_finite(m))) code = status_bad_momentum
        if (code == status_ok .and. .not. is_unit_quat(q)) code = status_bad_attitude
        if (code == status_ok .and. present(rests)) then
            if (.not. all(ieee_is_finite(rests))) code = status_bad_momentum
        end if
        call scene%agree(code)
        if (code == status_ok) then
            plan = splitting_plan(scheme, h)
            run%basis = new_basis(scheme, plan, h, compensated, joined)
            run%m = m
            run%q = q
            if (present(rests)) then
                run%m_rest = rests(1:3)
                run%q_rest = rests(4:7)
            end if
            run%body => body
            run%core = core_of(body)
            run%response = inverse_inertia(run%core)
            run%scene => scene
            if (present(observer)) run%observer => observer
            if (present(drift)) run%drift => drift
            call run_steps(run, plan, h, nsteps, spacing, time, code)
            m = run%m
            q = run%q
            if (present(t)) t = time
            if (present(rests) .and. run%basis%compensated) rests = [run%m_rest, run%q_rest]
        end if
        call return_or_stop(code, 'integrate', stat)
    end subroutine integrate_body

    !> m + amount tau + modified g.
    pure subroutine kick(run, amount, modified)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: amount, modified

        if (run%basis%compensated) then
            call kick_state(amount, run%tau, run%m, run%m_rest)
            if (abs(modified) > 0.0_wp) call kick_state(modified, run%g, run%m, run%m_rest)
        else
            ! One by one: to load numbers in one vector that were stored one by one, a processor waits.
            run%m(1) = run%m(1) + amount*run%tau(1)
            run%m(2) = run%m(2) + amount*run%tau(2)
            run%m(3) = run%m(3) + amount*run%tau(3)
            if (abs(modified) > 0.0_wp) then
                run%m(1) = run%m(1) + modified*run%g(1)
                run%m(2) = run%m(2) + modified*run%g(2)
                run%m(3) = run%m(3) + modified*run%g(3)
            end if
        end if
    end subroutine kick

    !> The torque, and whether it is finite and its kicks do not overflow.
    subroutine ask_torque(run, time, code)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: time
        integer, intent(out) :: code

        call run%scene%torque(run%q, time, run%tau, code)
        if (code == status_ok) then
            if (.not. all_within(3, run%tau, run%basis%largest_torque)) code = status_bad_torque
        end if
    end subroutine ask_torque

    !> The torque, and the torque g of a modified kick, from the scene's own change of the torque or from
    !> displaced torques, for which a second agreement is needed. All torques are computed, whatever the code
    !> before: other processes may take part in them. One displaced torque replaces the torque itself, and g
    !> is then 0.
    subroutine ask_torque_and_gradient(run, time, kick, modified, code)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: time, kick, modified
        integer, intent(inout) :: code
        real(wp) :: change(3), other(3), turn(3)
        integer :: refused

        if (run%basis%displaced == 0) then
            call run%scene%torque_and_gradient(run%q, time, run%response, run%tau, run%g, refused)
            if (refused == status_not_offered) then
                run%basis%displaced = run%basis%on_request
                refused = status_ok
            end if
        else
            call run%scene%torque(run%q, time, run%tau, refused)
        end if
        if (code == status_ok) code = refused
        call check_torque_and_gradient(run, code)
        if (run%basis%displaced == 0 .or. code /= status_ok) return
        turn = matmul(run%response, run%tau)
        if (run%basis%displaced == 1) then
            turn = (2*(modified/kick))*turn
            call run%scene%torque(turned(run%q, turn), time, change, code)
            run%tau = change + cross(turn, run%tau)
            run%g = 0.0_wp
        else
            call run%scene%torque(turned(run%q, run%basis%displacement*turn), time, change, code)
            call run%scene%torque(turned(run%q, -run%basis%displacement*turn), time, other, refused)
            if (code == status_ok) code = refused
            run%g = gradient_torque(turn, run%tau, (change - other)/(2*run%basis%displacement))
        end if
        call check_torque_and_gradient(run, code)
    end subroutine ask_torque_and_gradient

    !> Whether torque and g are finite and their kicks do not overflow, agreed on.
    subroutine check_torque_and_gradient(run, code)
        type(moving), intent(inout) :: run
        integer, intent(inout) :: code

        if (code == status_ok) then
            if (.not. (all_within(3, run%tau, run%basis%largest_torque) &
                       .and. all_within(3, run%g, run%basis%largest_gradient))) code = status_bad_torque
        end if
        call run%scene%agree(code)
    end subroutine check_torque_and_gradient

    !> The free body for a time h.
    subroutine advance(run, h, code)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: h
        integer, intent(out) :: code
        real(wp) :: m(3), turn(4)

        if (.not. run%basis%compensated) then
            if (associated(run%drift)) then
                call run%drift%advance(run%body, h, run%m, run%q, code)
            else
                call flow_body(run%core, h, run%m, code, run%q)
            end if
        else
            m = run%m
            turn = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            if (associated(run%drift)) then
                call run%drift%advance(run%body, h, m, turn, code)
            else
                call flow_body(run%core, h, m, code, turn)
            end if
            if (code == status_ok) then
                call turn_state(run%core, turn, run%m, run%m_rest, run%q, run%q_rest)
            end if
        end if
        call check_drifted(run, code)
    end subroutine advance

    !> Keeps the state at the start of a step.
    subroutine keep(run)
        type(moving), intent(inout) :: run

        run%kept(1:3) = run%m
        run%kept(4:7) = run%q
        if (run%basis%compensated) then
            run%kept(8:10) = run%m_rest
            run%kept(11:14) = run%q_rest
        end if
    end subroutine keep

    !> Goes back to the state at the start of the step.
    subroutine go_back(run)
        type(moving), intent(inout) :: run

        run%m = run%kept(1:3)
        run%q = run%kept(4:7)
        run%m_rest = run%kept(8:10)
        run%q_rest = run%kept(11:14)
    end subroutine go_back

    include 'next_time.inc'

    include 'splitting_steps.inc'

end module frb_splitting_one
