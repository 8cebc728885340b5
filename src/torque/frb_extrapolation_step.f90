!> One step of `extrapolate`: see frb_extrapolation.
module frb_extrapolation_step
    use frb_extrapolation_lanes, only: lanes, state_of_lanes, form_of_step, chosen_form, begin_sequences, &
        kick_and_drift
    use frb_flow_one, only: flow_one
    use frb_inertia, only: body_core, keep_off_axis
    use frb_kinds, only: wp
    use frb_rotations, only: quat_conjugate, quat_product, quat_rotate
    use frb_status, only: status_ok, status_bad_torque
    use frb_torque, only: body_scene, scene_lanes
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: extrapolated_body, new_extrapolated_body, ask_torque, try_step, accept_step, rounding

    ! Two sets of seven sequences, each of order 14: 2..8, and for the last digits 1..6 and 8, whose weights
    ! are four times smaller. Lanes: 8, 7 + 2, 6 + 3, 5 + 4; 8, 6 + 2, 5 + 3, 4 + 1.
    integer, parameter :: most_stages = 9, stages(2) = [9, 8]
    !> Number of substeps of the sequence that a lane is at in each stage, and which of them; 0: it rests.
    integer, parameter :: number(lanes, most_stages, 2) = reshape([ &
        8, 7, 6, 5, 8, 7, 6, 5, 8, 7, 6, 5, 8, 7, 6, 5, 8, 7, 6, 5, &
        8, 7, 6, 4, 8, 7, 3, 4, 8, 2, 3, 4, 0, 2, 3, 4, 8, 6, 5, 4, &
        8, 6, 5, 4, 8, 6, 5, 4, 8, 6, 5, 4, 8, 6, 5, 1, 8, 6, 3, 0, &
        8, 2, 3, 0, 8, 2, 3, 0, 0, 0, 0, 0], [lanes, most_stages, 2])
    integer, parameter :: which(lanes, most_stages, 2) = reshape([ &
        1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, &
        6, 6, 6, 1, 7, 7, 1, 2, 8, 1, 2, 3, 0, 2, 3, 4, 1, 1, 1, 1, &
        2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 1, 6, 6, 1, 0, &
        7, 1, 2, 0, 8, 2, 3, 0, 0, 0, 0, 0], [lanes, most_stages, 2])
    !> Of a step of one: half of each drift, the kick before it, the time after it.
    real(wp), parameter :: half(lanes, most_stages, 2) = merge(0.5_wp/max(number, 1), 0.0_wp, number > 0)
    real(wp), parameter :: kick(lanes, most_stages, 2) = half*merge(1, 2, which == 1)
    real(wp), parameter :: time_after(lanes, most_stages, 2) = merge(real(which, wp)/max(number, 1), 1.0_wp, &
                                                                    number > 0)
    !> Lanes that begin a sequence with a stage, and whether there are any after a stage.
    real(wp), parameter :: begin(lanes, most_stages, 2) = merge(1.0_wp, 0.0_wp, which == 1)
    logical, parameter :: any_begins(most_stages, 2) = reshape([ &
        .false., .false., .false., .false., .true., .true., .true., .false., .false., &
        .false., .false., .false., .true., .true., .true., .false., .false., .false.], [most_stages, 2])
    !> Lanes that end a sequence with a stage, from the first to the last of them.
    integer, parameter :: first_end(most_stages, 2) = reshape([5, 5, 5, 5, 4, 3, 2, 1, 2, &
                                                               5, 5, 5, 4, 3, 2, 5, 1, 5], [most_stages, 2])
    integer, parameter :: last_end(most_stages, 2) = reshape([4, 4, 4, 4, 4, 3, 2, 1, 4, &
                                                              4, 4, 4, 4, 4, 2, 4, 3, 4], [most_stages, 2])
    !> Weights c_n = n^12/prod_(j /= n) (n^2 - j^2), and those less the weights without the coarsest sequence.
    real(wp), parameter :: weights(8, 2) = reshape( &
        [0.0_wp, 2.0_wp**12/(108864000.0_wp), 3.0_wp**12/(-33264000.0_wp), &
         4.0_wp**12/(23950080.0_wp), 5.0_wp**12/(-31135104.0_wp), 6.0_wp**12/(69189120.0_wp), &
         7.0_wp**12/(-277992000.0_wp), 8.0_wp**12/(2594592000.0_wp), &
         1.0_wp**12/(19051200.0_wp), 2.0_wp**12/(-7257600.0_wp), 3.0_wp**12/(6652800.0_wp), &
         4.0_wp**12/(-10886400.0_wp), 5.0_wp**12/(31135104.0_wp), 6.0_wp**12/(-186278400.0_wp), &
         0.0_wp, 8.0_wp**12/(10897286400.0_wp)], [8, 2])
    integer, parameter :: squares(8) = [1, 4, 9, 16, 25, 36, 49, 64]
    real(wp), parameter :: differences(8, 2) = reshape([weights(:, 1)*4/squares, weights(:, 2)/squares], &
                                                       [8, 2])
    real(wp), parameter :: last_kicks(8) = 0.5_wp/[1, 2, 3, 4, 5, 6, 7, 8]

    !> Attitudes at which the torque is asked for in a step, but for the start.
    integer, parameter :: torques_of_step(2) = [35, 29]
    !> Tolerances below this take the second set.
    real(wp), parameter :: fine = 1.0e-13_wp
    !> Error of a step by rounding, relative: seen in the estimate at half a radian a step.
    real(wp), parameter :: rounding = 5.0e-15_wp

    !> A body on its way: its state in principal axes, what that lacks, and a step that is tried.
    type :: extrapolated_body
        type(body_core) :: core
        logical :: other_axes = .false.                 !! the axes of m, q and torque are not principal
        logical :: compensated = .true.
        integer :: set = 1                              !! of sequences
        real(wp) :: norm = 1.0_wp                       !! square of the norm of q, which is kept
        real(wp) :: x(7) = 0.0_wp                       !! m and q
        real(wp) :: rest(7) = 0.0_wp
        real(wp) :: tau(3) = 0.0_wp                     !! torque at x
        logical :: torque_known = .false.
        real(wp) :: change(7) = 0.0_wp                  !! of x in the step tried
        real(wp) :: error = 0.0_wp                      !! estimate of its error, relative
        logical :: is_finite = .false.                  !! no NaN or Inf came up in it; else error is 1
        logical :: is_free = .false.                    !! there was no torque in it: x + change is exact
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
        if (tolerance < fine) self%set = 2
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
        if (code == status_ok .and. .not. all(ieee_is_finite(self%tau))) code = status_bad_torque
        if (code /= status_ok) self%tau = 0.0_wp
        self%torque_known = .true.
        asked = asked + 1
    end subroutine ask_torque

    !> Tries a step of size h from time t: `change` and `error`. `exact` takes the free flow itself, for
    !> drifts that the series of the lanes do not reach. code: what the torque said; it is asked to the end,
    !> as others may take part in it.
    subroutine try_step(self, scene, t, h, exact, asked, code)
        type(extrapolated_body), intent(inout) :: self
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: t, h
        logical, intent(in) :: exact
        integer(int64), intent(inout) :: asked
        integer, intent(out) :: code
        type(form_of_step) :: form
        type(state_of_lanes) :: now
        real(wp) :: start(7), rest(7), change(7), error(7), sizes(lanes), time(lanes), largest
        integer :: j, l, e, set, refused

        code = status_ok
        set = self%set
        form = chosen_form(self%core, self%x(1:3))
        do e = 1, 3
            start(e) = self%x(form%axis(e))
            rest(e) = self%rest(form%axis(e))
        end do
        start(3) = form%sign3*start(3)
        rest(3) = form%sign3*rest(3)
        do e = 4, 7
            start(e) = self%x(e)
            rest(e) = self%rest(e)
        end do
        sizes = 0.0_wp
        change = 0.0_wp
        error = 0.0_wp
        call begin_sequences(begin(:, 1, set), start, rest, self%tau, now)
        associate (i1 => form%axis(1), i2 => form%axis(2), i3 => form%axis(3))
            do j = 1, stages(set)
                if (exact) then
                    call kick_and_drift_exactly(self%core, form, h, half(:, j, set), kick(:, j, set), now, &
                                                sizes)
                else
                    call kick_and_drift(form, h, half(:, j, set), kick(:, j, set), now%tau(:, i1), &
                                        now%tau(:, i2), now%tau(:, i3), now%m, now%q(:, 1), &
                                        now%q(:, 1 + i1), now%q(:, 1 + i2), now%q(:, 1 + i3), now%m_rest, &
                                        now%q_rest(:, 1), now%q_rest(:, 1 + i1), now%q_rest(:, 1 + i2), &
                                        now%q_rest(:, 1 + i3), sizes)
                end if
                time = t + h*time_after(:, j, set)
                call torque_of_lanes(self, scene, time, now%q, now%tau, refused)
                if (code == status_ok) code = refused
                do l = first_end(j, set), last_end(j, set)
                    call end_sequence(l, number(l, j, set))
                end do
                if (any_begins(j, set)) call begin_sequences(begin(:, j + 1, set), start, rest, self%tau, now)
            end do
            self%change([i1, i2, i3]) = change(1:3)
            self%change(i3) = form%sign3*change(3)
        end associate
        self%change(4:7) = change(4:7)
        asked = asked + torques_of_step(set)
        self%error = 1.0_wp
        self%is_free = .false.
        self%is_finite = ieee_is_finite(sum(sizes) + sum(abs(change)))
        if (.not. self%is_finite) return
        self%is_free = .not. sum(sizes) > 0.0_wp
        if (self%is_free) error = 0.0_wp
        largest = max(maxval(abs(start(1:3))), maxval(abs(start(1:3) + change(1:3))), tiny(largest))
        self%error = sqrt(sum((error(1:3)/largest)**2) + sum(error(4:7)**2))

    contains

        !> Adds what a sequence of n substeps has changed, its last kick included, with its weights.
        subroutine end_sequence(l, n)
            integer, intent(in) :: l, n
            real(wp) :: last(3), result, weight, difference
            integer :: e

            weight = weights(n, set)
            difference = differences(n, set)
            do e = 1, 3
                last(e) = last_kicks(n)*h*now%tau(l, form%axis(e))
                sizes(l) = sizes(l) + abs(last(e))
            end do
            last(3) = form%sign3*last(3)
            do e = 1, 3
                result = (now%m(l, e) - start(e)) + (now%m_rest(l, e) + last(e))
                change(e) = change(e) + weight*result
                error(e) = error(e) + difference*result
            end do
            do e = 1, 4
                result = (now%q(l, e) - start(3 + e)) + now%q_rest(l, e)
                change(3 + e) = change(3 + e) + weight*result
                error(3 + e) = error(3 + e) + difference*result
            end do
        end subroutine end_sequence

    end subroutine try_step

    !> The torques of the lanes, in principal axes; 0 where the scene refuses. The scene is asked for
    !> scene_lanes of them: those beyond `lanes` repeat the first ones.
    subroutine torque_of_lanes(self, scene, time, q, tau, code)
        type(extrapolated_body), intent(in) :: self
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: time(lanes), q(lanes, 4)
        real(wp), intent(inout) :: tau(lanes, 3)
        integer, intent(out) :: code
        real(wp) :: q_scene(scene_lanes, 4), time_scene(scene_lanes), tau_scene(scene_lanes, 3)
        real(wp) :: back(4), one(4)
        integer :: l

        if (self%other_axes) then
            back = quat_conjugate(self%core%axes_q)
            do l = 1, lanes
                one = q(l, :)
                q_scene(l, :) = quat_product(one, back)
            end do
        else
            q_scene(:lanes, :) = q
        end if
        q_scene(lanes + 1:, :) = q_scene(:scene_lanes - lanes, :)
        time_scene(:lanes) = time
        time_scene(lanes + 1:) = time(:scene_lanes - lanes)
        call scene%torque_lanes(q_scene, time_scene, tau_scene, code)
        tau = 0.0_wp
        if (code /= status_ok) return
        tau = tau_scene(:lanes, :)
        if (self%other_axes) then
            do l = 1, lanes
                one(1:3) = tau(l, :)
                tau(l, :) = quat_rotate(back, one(1:3))
            end do
        end if
    end subroutine torque_of_lanes

    !> Kick and drift of the lanes by the free flow itself, for drifts of any length.
    subroutine kick_and_drift_exactly(core, form, h, half, kick, now, sizes)
        type(body_core), intent(in) :: core
        type(form_of_step), intent(in) :: form
        real(wp), intent(in) :: h, half(lanes), kick(lanes)
        type(state_of_lanes), intent(inout) :: now
        real(wp), intent(inout) :: sizes(lanes)
        real(wp) :: m(3), q(4)
        integer :: l, code

        do l = 1, lanes
            sizes(l) = sizes(l) + sum(abs(now%tau(l, :)))
            m(form%axis) = [now%m(l, 1), now%m(l, 2), form%sign3*now%m(l, 3)]
            m = m + h*kick(l)*now%tau(l, :)
            q = now%q(l, :)
            ! What it refuses is not finite, and shows in the result.
            call flow_one(core, 2*h*half(l), m, code, q)
            now%m(l, :) = m(form%axis)
            now%m(l, 3) = form%sign3*now%m(l, 3)
            now%q(l, :) = q
        end do
    end subroutine kick_and_drift_exactly

    !> Takes the step tried. Without any torque in it that is the free flow.
    subroutine accept_step(self, h, code)
        type(extrapolated_body), intent(inout) :: self
        real(wp), intent(in) :: h
        integer, intent(out) :: code
        real(wp), parameter :: noise = 8*epsilon(1.0_wp)
        real(wp) :: excess, old
        integer :: e

        if (self%is_free) then
            call flow_one(self%core, h, self%x(1:3), code, self%x(4:7))
        else
            code = status_ok
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
