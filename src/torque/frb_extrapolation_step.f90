!> One step of `extrapolate`: see frb_extrapolation.
module frb_extrapolation_step
    use frb_extrapolation_lanes, only: lanes, state_of_lanes, form_of_step, chosen_form, start_lanes, &
        end_sequences, kick_and_drift, kick_and_drift_few
    use frb_extrapolation_sets, only: stages, half, kick, time_after, begin, any_ends, last_weights, &
        last_differences, torques_of_step, set_for
    use frb_flow_state, only: flow_state => flow_one
    use frb_inertia, only: body_core, keep_off_axis
    use frb_kinds, only: is_number, wp
    use frb_rotations, only: quat_conjugate, quat_product, quat_rotate
    use frb_status, only: status_ok, status_bad_torque
    use frb_torque, only: body_scene, scene_lanes
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: extrapolated_body, new_extrapolated_body, ask_torque, try_step, accept_step, rounding

    !> Error of a step by rounding, relative: seen in the estimate at half a radian a step.
    real(wp), parameter :: rounding = 5.0e-15_wp

    !> A body in a run: its state in principal axes, the rounding error of the state, and a step that is
    !> tried.
    type :: extrapolated_body
        type(body_core) :: core
        logical :: other_axes = .false.                 !! the axes of m, q and torque are not principal
        logical :: compensated = .true.
        integer :: set = 1                              !! of sequences
        real(wp) :: norm = 1.0_wp                       !! square of the norm of q, a constant
        real(wp) :: x(7) = 0.0_wp                       !! m and q
        real(wp) :: rest(7) = 0.0_wp
        real(wp) :: tau(3) = 0.0_wp                     !! torque at x
        logical :: torque_known = .false.
        real(wp) :: change(7) = 0.0_wp                  !! of x in the step tried
        real(wp) :: error = 0.0_wp                      !! estimate of its error, relative
        logical :: is_finite = .false.                  !! the step has no NaN or Inf; else error is 1
        logical :: is_free = .false.                    !! the step has no torque: x + change is exact
    end type extrapolated_body

contains

    !> A body in the state (m, q), axes of the body.
    pure function new_extrapolated_body(core, m, q, compensated, tolerance) result(self)
        type(body_core), intent(in) :: core
        real(wp), intent(in) :: m(3), q(4)
        logical, intent(in) :: compensated
        real(wp), intent(in) :: tolerance
        type(extrapolated_body) :: self

        self%core = core
        self%compensated = compensated
        self%set = set_for(tolerance)
        self%norm = sum(q*q)
        ! The constants of a linear rotor are those of a sphere, in any axes.
        self%other_axes = core%needs_rotation .and. .not. core%linear
        self%x = [m, q]
        if (self%other_axes) then
            self%x = [quat_rotate(quat_conjugate(core%axes_q), m), quat_product(q, core%axes_q)]
        end if
    end function new_extrapolated_body

    !> The torque at the state of the body and time t.
    subroutine ask_torque(self, scene, t, asked, code)
        type(extrapolated_body), intent(inout) :: self
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: t
        integer(int64), intent(inout) :: asked          !! attitudes at which the torque was asked for
        integer, intent(out) :: code

        if (self%other_axes) then
            call scene%torque(quat_product(self%x(4:7), quat_conjugate(self%core%axes_q)), t, self%tau, code)
            if (code == status_ok) self%tau = quat_rotate(quat_conjugate(self%core%axes_q), self%tau)
        else
            call scene%torque(self%x(4:7), t, self%tau, code)
        end if
        if (code == status_ok .and. .not. all(is_number(self%tau))) code = status_bad_torque
        if (code /= status_ok) self%tau = 0.0_wp
        self%torque_known = .true.
        asked = asked + 1
    end subroutine ask_torque

    !> Tries a step of size h from time t: `change` and `error`. `exact` uses the free flow itself, for drifts
    !> too long for the series of the lanes; `few` uses the first terms of the series only. code: the first
    !> code of the torque that is not status_ok. All torques are computed even then: other processes may take
    !> part in them.
    subroutine try_step(self, scene, t, h, exact, few, asked, code)
        type(extrapolated_body), intent(inout) :: self
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: t, h
        logical, intent(in) :: exact, few
        integer(int64), intent(inout) :: asked
        integer, intent(out) :: code
        type(form_of_step) :: form
        type(state_of_lanes) :: state
        real(wp) :: start(7), rest(7), change(7), error(7), largest
        integer :: j, e, set, refused

        code = status_ok
        set = self%set
        form = chosen_form(self%core, self%x(1:3))
        start = in_form(form, self%x)
        rest = in_form(form, self%rest)
        call start_lanes(start, rest, self%tau, state)
        do j = 1, stages(set)
            if (exact) then
                call kick_and_drift_exactly(self%core, form, h, half(:, j, set), kick(:, j, set), state)
            else if (few) then
                call kick_and_drift_few(form, h, half(:, j, set), kick(:, j, set), state)
            else
                call kick_and_drift(form, h, half(:, j, set), kick(:, j, set), state)
            end if
            call torque_of_lanes(self, scene, t, h, time_after(:, j, set), state, refused)
            if (code == status_ok) code = refused
            if (any_ends(j, set)) then
                call end_sequences(form, h, half(:, j, set), last_weights(:, j, set), &
                                   last_differences(:, j, set), begin(:, j + 1, set), start, rest, &
                                   self%tau, state)
            end if
        end do
        do e = 1, 7
            change(e) = sum(state%change(:, e))
            error(e) = sum(state%error(:, e))
        end do
        self%change(form%axis) = change(1:3)
        self%change(form%axis(3)) = form%sign3*change(3)
        self%change(4:7) = change(4:7)
        asked = asked + torques_of_step(set)
        self%error = 1.0_wp
        self%is_free = .false.
        self%is_finite = is_number(sum(state%sizes) + sum(abs(change)))
        if (.not. self%is_finite) return
        self%is_free = .not. sum(state%sizes) > 0.0_wp
        if (self%is_free) error = 0.0_wp
        largest = max(maxval(abs(start(1:3))), maxval(abs(start(1:3) + change(1:3))), tiny(largest))
        self%error = sqrt(sum((error(1:3)*(1/largest))**2) + sum(error(4:7)**2))
    end subroutine try_step

    !> (m, q) with m in the axes of the form.
    pure function in_form(form, x) result(y)
        type(form_of_step), intent(in) :: form
        real(wp), intent(in) :: x(7)
        real(wp) :: y(7)

        y(1) = x(form%axis(1))
        y(2) = x(form%axis(2))
        y(3) = form%sign3*x(form%axis(3))
        y(4:7) = x(4:7)
    end function in_form

    !> The torques of the lanes at time t + h times `after`, in principal axes; 0 where the scene refuses.
    subroutine torque_of_lanes(self, scene, t, h, after, state, code)
        type(extrapolated_body), intent(in) :: self
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: t, h, after(lanes)
        type(state_of_lanes), intent(inout) :: state
        integer, intent(out) :: code
        real(wp) :: time(scene_lanes), q_body(scene_lanes, 4), back(4), one(4)
        integer :: l

        do l = 1, lanes
            time(l) = t + h*after(l)
            time(lanes + l) = t + h*after(l)
        end do
        if (self%other_axes) then
            back = quat_conjugate(self%core%axes_q)
            do l = 1, lanes
                one = state%q(l, :)
                q_body(l, :) = quat_product(one, back)
                q_body(lanes + l, :) = q_body(l, :)
            end do
            call scene%torque_lanes(q_body, time, state%tau, code)
            do l = 1, lanes
                one(1:3) = state%tau(l, :)
                state%tau(l, :) = quat_rotate(back, one(1:3))
            end do
        else
            call scene%torque_lanes(state%q, time, state%tau, code)
        end if
        if (code /= status_ok) state%tau = 0.0_wp
    end subroutine torque_of_lanes

    !> Kick and drift of the lanes by the free flow itself, for drifts of any length.
    subroutine kick_and_drift_exactly(core, form, h, half, kick, state)
        type(body_core), intent(in) :: core
        type(form_of_step), intent(in) :: form
        real(wp), intent(in) :: h, half(lanes), kick(lanes)
        type(state_of_lanes), intent(inout) :: state
        real(wp) :: m(3), q(4)
        integer :: l, code

        do l = 1, lanes
            state%sizes(l) = state%sizes(l) + sum(abs(state%tau(l, :)))
            m(form%axis) = [state%m(l, 1), state%m(l, 2), form%sign3*state%m(l, 3)]
            m = m + h*kick(l)*state%tau(l, :)
            q = state%q(l, :)
            ! A state that it refuses is not finite, and so is the result.
            code = status_ok
            call flow_state(core, 2*h*half(l), m, code, 1.0_wp, q)
            state%m(l, :) = m(form%axis)
            state%m(l, 3) = form%sign3*state%m(l, 3)
            state%q(l, :) = q
            state%q(lanes + l, :) = q
        end do
    end subroutine kick_and_drift_exactly

    !> Makes the tried step. A step without any torque is made by the free flow.
    subroutine accept_step(self, h, code)
        type(extrapolated_body), intent(inout) :: self
        real(wp), intent(in) :: h
        integer, intent(out) :: code
        real(wp), parameter :: noise = 8*epsilon(1.0_wp)
        real(wp) :: excess, old
        integer :: e

        code = status_ok
        if (self%is_free) then
            call flow_state(self%core, h, self%x(1:3), code, 1.0_wp, self%x(4:7))
        else
            excess = 0.5_wp*(sum((self%x(4:7) + self%change(4:7))**2)/self%norm - 1)
            if (abs(excess) > noise) self%change(4:7) = self%change(4:7) &
                - excess*(self%x(4:7) + self%change(4:7))
            do e = 1, 7
                old = self%x(e)
                self%x(e) = old + self%change(e)
                if (self%compensated) self%rest(e) = self%change(e) - (self%x(e) - old)
            end do
        end if
        if (code == status_ok) call keep_off_axis(self%core, self%x(1:3), code)
        self%torque_known = .false.
    end subroutine accept_step

end module frb_extrapolation_step
