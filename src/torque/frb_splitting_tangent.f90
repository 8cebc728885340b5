!> A run of a splitting scheme with its derivative: the loop of `splitting_plan` advances variations too.
module frb_splitting_tangent
    use frb_free_flow, only: flow_tangent, rigid_body
    use frb_kinds, only: wp
    use frb_rotations, only: is_unit_quat
    use frb_schemes, only: splitting_scheme
    use frb_splitting_plan, only: check_run, next_time, splitting_plan
    use frb_status, only: return_or_stop, status_ok, status_bad_attitude, status_bad_momentum, &
        status_bad_torque, status_not_offered
    use frb_torque, only: body_scene
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: integrate_tangent

contains

    !> Integrates one body over nsteps steps of size h, in place, with the derivative of the run by its start,
    !> on (dm, dtheta) as in `flow_tangent`. A kick adds plan%kick (d tau/d theta) dtheta to dm, by the
    !> scene's `torque_change` along the three axes of the body; `heavy_top` has one.
    !>
    !> q must have norm one, to 1e-6. For long runs call it for one part after another and multiply the
    !> derivatives, or advance single variations.
    !> Refused with `stat`, state and t untouched, the derivative 1: input that `integrate` refuses at the
    !> start, with its codes; a state that `flow_tangent` or the scene refuses later; a torque or its change
    !> that is not finite (`status_bad_torque`); a scene without `torque_change` and a scheme with modified
    !> kicks (`status_not_offered`).
    subroutine integrate_tangent(body, scheme, scene, h, nsteps, m, q, transition, t, stat)
        type(rigid_body), intent(in) :: body
        type(splitting_scheme), intent(in) :: scheme
        class(body_scene), intent(inout) :: scene           !! the torque and its change
        real(wp), intent(in) :: h                           !! step, of either sign
        integer, intent(in) :: nsteps                       !! >= 0
        real(wp), intent(inout) :: m(3), q(4)               !! momentum, attitude
        real(wp), intent(out) :: transition(6, 6)           !! derivative of the end by the start
        real(wp), intent(inout), optional :: t              !! time, goes on by nsteps*h; from 0
        integer, intent(out), optional :: stat
        real(wp), parameter :: axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1]*1.0_wp, [3, 3])
        type(splitting_plan) :: plan
        real(wp) :: m_now(3), q_now(4), phi(6, 6), tau(3), change(3, 3), now, one(6, 6)
        integer :: code, step, i, k, spacing

        call check_run(body%status(), scheme, h, int(nsteps, int64), spacing, now, code, t=t)
        if (code == status_ok .and. .not. all(ieee_is_finite(m))) code = status_bad_momentum
        if (code == status_ok .and. .not. is_unit_quat(q)) code = status_bad_attitude
        plan = splitting_plan(scheme, h)
        if (code == status_ok .and. any(abs(plan%modified) > 0.0_wp)) code = status_not_offered
        one = 0.0_wp
        one(1:3, 1:3) = axes
        one(4:6, 4:6) = axes
        transition = one
        m_now = m
        q_now = q
        do step = 1, nsteps
            do i = 1, plan%stages + 1
                if (code == status_ok) call flow_tangent(body, plan%drift(i), m_now, q_now, phi, code)
                if (code == status_ok) transition = transition + matmul(phi - one, transition)
                if (i > plan%stages .or. code /= status_ok) exit
                call scene%torque(q_now, now + plan%time(i), tau, code)
                m_now = m_now + plan%kick(i)*tau
                if (code == status_ok .and. .not. all(ieee_is_finite(m_now))) code = status_bad_torque
                do k = 1, 3
                    if (code == status_ok) call scene%torque_change(q_now, now + plan%time(i), axes(:, k), &
                                                                    change(:, k), code)
                end do
                if (code /= status_ok) exit
                if (.not. all(ieee_is_finite(change))) code = status_bad_torque
                if (code == status_ok) transition(1:3, :) = transition(1:3, :) &
                                                            + plan%kick(i)*matmul(change, transition(4:6, :))
            end do
            if (code /= status_ok) exit
            now = next_time(now, h)
        end do
        if (code == status_ok) then
            m = m_now
            q = q_now
            if (present(t)) t = now
        else
            transition = one
        end if
        call return_or_stop(code, 'integrate_tangent', stat)
    end subroutine integrate_tangent

end module frb_splitting_tangent
