!> The run of n bodies that interact: see frb_splitting.
module frb_splitting_many
    use frb_exact_updates, only: turn_state, kick_state
    use frb_flow_bodies, only: flow_many
    use frb_free_flow, only: core_of, rigid_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_modified_kicks, only: angular_response, gradient_torque, turned
    use frb_rotations, only: cross, is_unit_quat
    use frb_schemes, only: splitting_scheme
    use frb_splitting_plan, only: splitting_plan, check_run
    use frb_splitting_run, only: splitting_run, run_steps, largest_momentum
    use frb_status, only: conclude, status_ok, status_bad_attitude, status_bad_count, status_bad_momentum, &
        status_bad_torque, status_not_offered, status_stopped
    use frb_torque, only: group_scene, group_observer, body_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: integrate_group

    !> Momenta (3, n) and attitudes (4, n), what they lack and room for the turns in a compensated run, and
    !> all of it at the last whole step.
    type, extends(splitting_run) :: group_run
        real(wp), allocatable :: m(:, :), q(:, :), tau(:, :)
        real(wp), allocatable :: m_rest(:, :), q_rest(:, :), m_new(:, :), turn(:, :)
        real(wp), allocatable :: kept_m(:, :), kept_q(:, :), kept_m_rest(:, :), kept_q_rest(:, :)
        real(wp), allocatable :: n(:, :), g(:, :), other(:, :), q_turned(:, :)  ! see frb_modified_kicks
        type(body_core), allocatable :: core(:)
        type(rigid_body), pointer :: body(:) => null()          !! n, or one for all
        class(group_scene), pointer :: scene => null()
        class(group_observer), pointer :: observer => null()
        class(body_drift), pointer :: drift => null()           !! null: the free flow, in a batch
    contains
        procedure :: stage => stage_of_group
        procedure :: move => move_group
        procedure :: keep => keep_group
        procedure :: go_back => go_back_group
        procedure :: show => show_group
    end type group_run

contains

    !> n bodies, each with moments of its own.
    subroutine integrate_group(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                               compensated, rests, stat)
        type(rigid_body), intent(in), target :: body(:)             !! n bodies, or one for all
        type(splitting_scheme), intent(in) :: scheme
        class(group_scene), intent(inout), target :: scene          !! the torques
        real(wp), intent(in) :: h                                   !! step, of either sign, not zero
        integer(int64), intent(in) :: nsteps                        !! number of steps, >= 0
        real(wp), contiguous, intent(inout) :: m(:, :)              !! angular momenta (3, n), body frames
        real(wp), contiguous, intent(inout) :: q(:, :)              !! attitudes (4, n), unit quaternions
        class(group_observer), intent(inout), optional, target :: observer  !! at start, every `every` steps
        integer, intent(in), optional :: every                      !! >= 1, default 1
        real(wp), intent(inout), optional :: t                      !! time, goes on by nsteps*h; from 0
        class(body_drift), intent(in), optional, target :: drift    !! default: the free flow, in a batch
        logical, intent(in), optional :: compensated                !! default: .false.
        real(wp), contiguous, intent(inout), optional :: rests(:, :)    !! (7, n): what m and q lack; from 0
        integer, intent(out), optional :: stat                      !! status code
        type(splitting_plan) :: plan
        type(group_run) :: run
        real(wp) :: time
        integer :: body_status, code, spacing, i, n

        body_status = status_ok
        do i = 1, size(body)
            if (body_status == status_ok) body_status = body(i)%status()
        end do
        call check_run(body_status, scheme, h, nsteps, spacing, time, code, every, t)
        if (code == status_ok) code = check_group(size(body), m, q, rests)
        call scene%agree(code)
        if (code == status_ok) then
            n = size(m, 2)
            plan = splitting_plan(scheme, h)
            run%m = m
            run%q = q
            allocate (run%tau(3, n), source=0.0_wp)
            allocate (run%kept_m(3, n), run%kept_q(4, n))
            if (present(compensated)) run%compensated = compensated
            if (run%compensated) then
                allocate (run%m_rest(3, n), run%m_new(3, n), run%q_rest(4, n), run%turn(4, n), source=0.0_wp)
                allocate (run%kept_m_rest(3, n), run%kept_q_rest(4, n))
                if (present(rests)) then
                    run%m_rest(:, :) = rests(1:3, :)
                    run%q_rest(:, :) = rests(4:7, :)
                end if
            end if
            run%body => body
            run%core = core_of(body)
            run%scene => scene
            if (present(observer)) run%observer => observer
            if (present(drift)) run%drift => drift
            run%on_request = scheme%displaced
            if (scheme%has_modified_kicks()) then
                allocate (run%n(3, n), run%g(3, n), run%other(3, n), run%q_turned(4, n), source=0.0_wp)
            end if
            call run_steps(run, plan, h, nsteps, present(observer), spacing, time, code)
            m = run%m
            q = run%q
            if (present(t)) t = time
            if (present(rests) .and. run%compensated) then
                rests(1:3, :) = run%m_rest
                rests(4:7, :) = run%q_rest
            end if
        end if
        ! An observer that stops a run has done what it was there for.
        if (code == status_stopped .and. .not. present(stat)) return
        call conclude(code, 'integrate', stat)
    end subroutine integrate_group

    subroutine stage_of_group(self, drift, time, kick, modified, code)
        class(group_run), intent(inout) :: self
        real(wp), intent(in) :: drift, time, kick, modified
        integer, intent(out) :: code
        integer :: i, refused

        code = status_ok
        if (abs(drift) > 0.0_wp) then
            call advance_group(self, drift, code)
            if (associated(self%drift)) then
                call self%scene%agree(code)
                if (code /= status_ok) return
            end if
        end if
        if (.not. self%torque_known) then
            ! Also where the free flow has refused, which leaves q valid: others may take part in the torque.
            call self%scene%torques(self%q, time, self%tau, refused)
            if (code == status_ok) code = refused
            if (code == status_ok) then
                if (.not. (all_below(self%tau, self%largest_torque) &
                           .and. all_below(self%m, largest_momentum))) code = status_bad_torque
            end if
            call self%scene%agree(code)
            if (code == status_ok .and. abs(modified) > 0.0_wp) then
                call add_gradients(self, time, kick, modified, code)
                call self%scene%agree(code)
            end if
            if (code /= status_ok) return
            self%torque_known = .true.
        end if
        if (self%compensated) then
            do i = 1, size(self%tau, 2)
                call kick_state(kick, self%tau(:, i), self%m(:, i), self%m_rest(:, i))
                if (abs(modified) > 0.0_wp) then
                    call kick_state(modified, self%g(:, i), self%m(:, i), self%m_rest(:, i))
                end if
            end do
        else
            self%m(:, :) = self%m + kick*self%tau
            if (abs(modified) > 0.0_wp) self%m(:, :) = self%m + modified*self%g
        end if
    end subroutine stage_of_group

    !> The torques g of a modified kick, as for one body: all bodies turn at a time.
    subroutine add_gradients(self, time, kick, modified, code)
        class(group_run), intent(inout) :: self
        real(wp), intent(in) :: time, kick, modified
        integer, intent(out) :: code
        integer :: i, refused

        do i = 1, size(self%tau, 2)
            self%n(:, i) = angular_response(self%core(min(i, size(self%core))), self%tau(:, i))
        end do
        if (self%displaced == 0) then
            call self%scene%torques_change(self%q, time, self%n, self%g, code)
            if (code == status_not_offered) self%displaced = self%on_request
        end if
        if (self%displaced == 1) then
            self%n(:, :) = (2*(modified/kick))*self%n
            call turn_all(self, 1.0_wp)
            call self%scene%torques(self%q_turned, time, self%other, code)
        else if (self%displaced == 2) then
            ! Both, whatever the first one says: others may take part in the torques.
            call turn_all(self, self%reach)
            call self%scene%torques(self%q_turned, time, self%g, code)
            call turn_all(self, -self%reach)
            call self%scene%torques(self%q_turned, time, self%other, refused)
            if (code == status_ok) code = refused
            if (code == status_ok) self%g(:, :) = (self%g - self%other)/(2*self%reach)
        end if
        if (code /= status_ok) return
        do i = 1, size(self%tau, 2)
            if (self%displaced == 1) then
                self%tau(:, i) = self%other(:, i) + cross(self%n(:, i), self%tau(:, i))
                self%g(:, i) = 0.0_wp
            else
                self%g(:, i) = gradient_torque(self%n(:, i), self%tau(:, i), self%g(:, i))
            end if
        end do
        if (.not. (all_below(self%tau, self%largest_torque) &
                   .and. all_below(self%g, self%largest_gradient))) code = status_bad_torque
    end subroutine add_gradients

    !> The attitudes turned by `reach` times n.
    pure subroutine turn_all(self, reach)
        class(group_run), intent(inout) :: self
        real(wp), intent(in) :: reach
        integer :: i

        do i = 1, size(self%q, 2)
            self%q_turned(:, i) = turned(self%q(:, i), reach*self%n(:, i))
        end do
    end subroutine turn_all

    !> Whether the sizes of the three numbers of each column add up to less than `bound`; a NaN or Inf shows
    !> in the sum, which is compared only when there is none.
    pure function all_below(v, bound) result(good)
        real(wp), contiguous, intent(in) :: v(:, :)
        real(wp), intent(in) :: bound
        logical :: good
        real(wp) :: total
        integer :: i

        good = .true.
        do i = 1, size(v, 2)
            total = 0.25_wp*abs(v(1, i)) + 0.25_wp*abs(v(2, i)) + 0.25_wp*abs(v(3, i))
            good = ieee_is_finite(total)
            if (good) good = total <= 0.25_wp*bound
            if (.not. good) return
        end do
    end function all_below

    !> A drift that closes a step.
    subroutine move_group(self, h, code)
        class(group_run), intent(inout) :: self
        real(wp), intent(in) :: h
        integer, intent(out) :: code

        call advance_group(self, h, code)
        call self%scene%agree(code)
    end subroutine move_group

    !> The free bodies for a time h.
    subroutine advance_group(self, h, code)
        class(group_run), intent(inout) :: self
        real(wp), intent(in) :: h
        integer, intent(out) :: code
        integer :: i

        self%torque_known = .false.
        if (.not. self%compensated) then
            call advance_all(self, h, self%m, self%q, code)
        else
            self%m_new(:, :) = self%m
            self%turn(1, :) = 1.0_wp
            self%turn(2:4, :) = 0.0_wp
            call advance_all(self, h, self%m_new, self%turn, code)
            if (code == status_ok) then
                do i = 1, size(self%m, 2)
                    call turn_state(self%core(min(i, size(self%core))), self%turn(:, i), self%m(:, i), &
                                    self%m_rest(:, i), self%q(:, i), self%q_rest(:, i))
                end do
            end if
        end if
        if (associated(self%drift) .and. code == status_ok) then
            if (.not. all(ieee_is_finite(self%m))) code = status_bad_momentum
            if (.not. all(ieee_is_finite(self%q))) code = status_bad_attitude
        end if
    end subroutine advance_group

    !> All bodies, in place: the batch form of the free flow, or the user's drift one by one.
    subroutine advance_all(self, h, m, q, code)
        class(group_run), intent(in) :: self
        real(wp), intent(in) :: h
        real(wp), contiguous, intent(inout) :: m(:, :), q(:, :)
        integer, intent(out) :: code
        integer :: i

        code = status_ok
        if (associated(self%drift)) then
            do i = 1, size(m, 2)
                call self%drift%advance(self%body(min(i, size(self%body))), h, m(:, i), q(:, i), code)
                if (code /= status_ok) return
            end do
        else
            call flow_many(self%core, size(self%core), h, size(m, 2), m, code, q)
        end if
    end subroutine advance_all

    subroutine keep_group(self)
        class(group_run), intent(inout) :: self

        self%kept_m(:, :) = self%m
        self%kept_q(:, :) = self%q
        if (self%compensated) then
            self%kept_m_rest(:, :) = self%m_rest
            self%kept_q_rest(:, :) = self%q_rest
        end if
    end subroutine keep_group

    subroutine go_back_group(self)
        class(group_run), intent(inout) :: self

        self%m(:, :) = self%kept_m
        self%q(:, :) = self%kept_q
        if (self%compensated) then
            self%m_rest(:, :) = self%kept_m_rest
            self%q_rest(:, :) = self%kept_q_rest
        end if
    end subroutine go_back_group

    subroutine show_group(self, step, t, code)
        class(group_run), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t
        integer, intent(out) :: code
        logical :: stop_here

        stop_here = .false.
        call self%observer%observe(step, t, self%m, self%q, stop_here)
        code = merge(status_stopped, status_ok, stop_here)
        call self%scene%agree(code)
    end subroutine show_group

    !> Sizes and values of the state of a group.
    pure function check_group(bodies, m, q, rests) result(code)
        integer, intent(in) :: bodies
        real(wp), intent(in) :: m(:, :), q(:, :)
        real(wp), intent(in), optional :: rests(:, :)
        integer :: code
        integer :: n, i

        n = size(m, 2)
        code = status_bad_count
        if (size(m, 1) /= 3 .or. size(q, 1) /= 4 .or. size(q, 2) /= n) return
        if (bodies /= 1 .and. bodies /= n) return
        if (present(rests)) then
            if (size(rests, 1) /= 7 .or. size(rests, 2) /= n) return
        end if
        code = status_bad_momentum
        if (.not. all(ieee_is_finite(m))) return
        if (present(rests)) then
            if (.not. all(ieee_is_finite(rests))) return
        end if
        code = status_bad_attitude
        do i = 1, n
            if (.not. is_unit_quat(q(:, i))) return
        end do
        code = status_ok
    end function check_group

end module frb_splitting_many
