!> The run of one body: see frb_splitting.
module frb_splitting_one
    use frb_exact_updates, only: turn_state, kick_state
    use frb_flow_one, only: flow_body
    use frb_free_flow, only: core_of, rigid_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_modified_kicks, only: angular_response, gradient_torque, turned
    use frb_rotations, only: cross, is_unit_quat
    use frb_schemes, only: splitting_scheme
    use frb_splitting_plan, only: splitting_plan, check_run
    use frb_splitting_run, only: splitting_run, run_steps, largest_momentum
    use frb_status, only: conclude, status_ok, status_bad_attitude, status_bad_momentum, status_bad_torque, &
        status_not_offered, status_stopped
    use frb_torque, only: body_scene, body_observer, body_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: integrate_body

    !> Momentum and attitude, what they lack in a compensated run, and all of it at the last whole step.
    type, extends(splitting_run) :: body_run
        real(wp) :: m(3) = 0.0_wp
        real(wp) :: q(4) = 0.0_wp
        real(wp) :: m_rest(3) = 0.0_wp
        real(wp) :: q_rest(4) = 0.0_wp
        real(wp) :: tau(3) = 0.0_wp
        real(wp) :: g(3) = 0.0_wp               ! see frb_modified_kicks
        real(wp) :: kept(14) = 0.0_wp
        type(body_core) :: core
        type(rigid_body), pointer :: body => null()
        class(body_scene), pointer :: scene => null()
        class(body_observer), pointer :: observer => null()
        class(body_drift), pointer :: drift => null()           !! null: the free flow
    contains
        procedure :: stage => stage_of_body
        procedure :: move => move_body
        procedure :: keep => keep_body
        procedure :: go_back => go_back_body
        procedure :: show => show_body
    end type body_run

contains

    !> One body.
    subroutine integrate_body(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                              compensated, rests, stat)
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
        real(wp), intent(inout), optional :: rests(7)               !! what m and q lack, compensated; from 0
        integer, intent(out), optional :: stat                      !! status code
        type(splitting_plan) :: plan
        type(body_run) :: run
        real(wp) :: time
        integer :: code, spacing

        call check_run(body%status(), scheme, h, nsteps, spacing, time, code, every, t)
        if (code == status_ok .and. .not. all(ieee_is_finite(m))) code = status_bad_momentum
        if (code == status_ok .and. .not. is_unit_quat(q)) code = status_bad_attitude
        if (present(compensated)) run%compensated = compensated
        if (present(rests) .and. run%compensated) then
            run%m_rest = rests(1:3)
            run%q_rest = rests(4:7)
            if (code == status_ok .and. .not. all(ieee_is_finite(rests))) code = status_bad_momentum
        end if
        call scene%agree(code)
        if (code == status_ok) then
            plan = splitting_plan(scheme, h)
            run%m = m
            run%q = q
            run%body => body
            run%core = core_of(body)
            run%scene => scene
            if (present(observer)) run%observer => observer
            if (present(drift)) run%drift => drift
            run%on_request = scheme%displaced
            call run_steps(run, plan, h, nsteps, present(observer), spacing, time, code)
            m = run%m
            q = run%q
            if (present(t)) t = time
            if (present(rests) .and. run%compensated) rests = [run%m_rest, run%q_rest]
        end if
        ! An observer that stops a run has done what it was there for.
        if (code == status_stopped .and. .not. present(stat)) return
        call conclude(code, 'integrate', stat)
    end subroutine integrate_body

    subroutine stage_of_body(self, drift, time, kick, modified, code)
        class(body_run), intent(inout) :: self
        real(wp), intent(in) :: drift, time, kick, modified
        integer, intent(out) :: code
        integer :: refused

        code = status_ok
        if (abs(drift) > 0.0_wp) then
            call advance_body(self, drift, code)
            if (associated(self%drift)) then
                call self%scene%agree(code)
                if (code /= status_ok) return
            end if
        end if
        if (.not. self%torque_known) then
            ! Also where the free flow has refused, which leaves q valid: others may take part in the torque.
            call self%scene%torque(self%q, time, self%tau, refused)
            if (code == status_ok) code = refused
            if (code == status_ok) then
                if (.not. (all_below(self%tau, self%largest_torque) &
                           .and. all_below(self%m, largest_momentum))) code = status_bad_torque
            end if
            call self%scene%agree(code)
            if (code == status_ok .and. abs(modified) > 0.0_wp) then
                call add_gradient(self, time, kick, modified, code)
                call self%scene%agree(code)
            end if
            if (code /= status_ok) return
            self%torque_known = .true.
        end if
        if (self%compensated) then
            call kick_state(kick, self%tau, self%m, self%m_rest)
            if (abs(modified) > 0.0_wp) call kick_state(modified, self%g, self%m, self%m_rest)
        else
            self%m = self%m + kick*self%tau
            if (abs(modified) > 0.0_wp) self%m = self%m + modified*self%g
        end if
    end subroutine stage_of_body

    !> The torque g of a modified kick, from the scene's own change of the torque or from displaced torques.
    !> One displaced torque takes the place of the torque itself, and g is then 0.
    subroutine add_gradient(self, time, kick, modified, code)
        class(body_run), intent(inout) :: self
        real(wp), intent(in) :: time, kick, modified
        integer, intent(out) :: code
        real(wp) :: n(3), change(3), other(3), turn(3)
        integer :: refused

        n = angular_response(self%core, self%tau)
        if (self%displaced == 0) then
            call self%scene%torque_change(self%q, time, n, change, code)
            if (code == status_not_offered) self%displaced = self%on_request
        end if
        if (self%displaced == 1) then
            turn = (2*(modified/kick))*n
            call self%scene%torque(turned(self%q, turn), time, change, code)
        else if (self%displaced == 2) then
            ! Both, whatever the first one says: others may take part in the torques.
            call self%scene%torque(turned(self%q, self%reach*n), time, change, code)
            call self%scene%torque(turned(self%q, -self%reach*n), time, other, refused)
            if (code == status_ok) code = refused
            if (code == status_ok) change = (change - other)/(2*self%reach)
        end if
        if (code /= status_ok) return
        if (self%displaced == 1) then
            self%tau = change + cross(turn, self%tau)
            self%g = 0.0_wp
        else
            self%g = gradient_torque(n, self%tau, change)
        end if
        if (.not. (all_below(self%tau, self%largest_torque) &
                   .and. all_below(self%g, self%largest_gradient))) code = status_bad_torque
    end subroutine add_gradient

    !> Whether the sizes of three numbers add up to less than `bound`; a NaN or Inf shows in the sum, which is
    !> compared only when there is none.
    pure function all_below(v, bound) result(good)
        real(wp), intent(in) :: v(3), bound
        logical :: good
        real(wp) :: total

        total = 0.25_wp*abs(v(1)) + 0.25_wp*abs(v(2)) + 0.25_wp*abs(v(3))
        good = ieee_is_finite(total)
        if (good) good = total <= 0.25_wp*bound
    end function all_below

    !> A drift that closes a step.
    subroutine move_body(self, h, code)
        class(body_run), intent(inout) :: self
        real(wp), intent(in) :: h
        integer, intent(out) :: code

        call advance_body(self, h, code)
        call self%scene%agree(code)
    end subroutine move_body

    !> The free body for a time h.
    subroutine advance_body(self, h, code)
        class(body_run), intent(inout) :: self
        real(wp), intent(in) :: h
        integer, intent(out) :: code
        real(wp) :: m(3), turn(4)

        self%torque_known = .false.
        if (.not. self%compensated) then
            if (associated(self%drift)) then
                call self%drift%advance(self%body, h, self%m, self%q, code)
            else
                call flow_body(self%core, h, self%m, code, self%q)
            end if
        else
            m = self%m
            turn = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            if (associated(self%drift)) then
                call self%drift%advance(self%body, h, m, turn, code)
            else
                call flow_body(self%core, h, m, code, turn)
            end if
            if (code == status_ok) then
                call turn_state(self%core, turn, self%m, self%m_rest, self%q, self%q_rest)
            end if
        end if
        if (associated(self%drift) .and. code == status_ok) then
            if (.not. all(ieee_is_finite(self%m))) code = status_bad_momentum
            if (.not. all(ieee_is_finite(self%q))) code = status_bad_attitude
        end if
    end subroutine advance_body

    subroutine keep_body(self)
        class(body_run), intent(inout) :: self

        self%kept(1:3) = self%m
        self%kept(4:7) = self%q
        if (self%compensated) then
            self%kept(8:10) = self%m_rest
            self%kept(11:14) = self%q_rest
        end if
    end subroutine keep_body

    subroutine go_back_body(self)
        class(body_run), intent(inout) :: self

        self%m = self%kept(1:3)
        self%q = self%kept(4:7)
        self%m_rest = self%kept(8:10)
        self%q_rest = self%kept(11:14)
    end subroutine go_back_body

    subroutine show_body(self, step, t, code)
        class(body_run), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t
        integer, intent(out) :: code
        logical :: stop_here

        stop_here = .false.
        call self%observer%observe(step, t, self%m, self%q, stop_here)
        code = merge(status_stopped, status_ok, stop_here)
        call self%scene%agree(code)
    end subroutine show_body

end module frb_splitting_one
