!> One body under torque to a given accuracy: Strang's splitting with the exact free flow, extrapolated.
!>
!> S(h) is kick by h/2, drift by h, kick by h/2. Over a step H the results of S(H/n)^n for seven n are
!> combined with the weights c_n = prod_(j /= n) n^2/(n^2 - j^2): as S is symmetric in time, its error has
!> even powers of h only, and seven sequences give order 14 (a multi-product expansion: S. A. Chin, Celest.
!> Mech. Dyn. Astron. 106 (2010) 391). Without the coarsest sequence they give order 12: the difference is the
!> estimate of the error of a step. The sequences n = 4..9, 13 share the lanes of a vector of four: 13, 4 + 9,
!> 5 + 8, 6 + 7, so a step takes as long as 13 drifts. (A vector of eight takes twice as long with AVX2.)
!> Tolerances below 1e-13 and from 1e-5 on take other sequences: see frb_extrapolation_sets.
module frb_extrapolation
    use frb_extrapolation_control, only: first_step, without_sliver, series_reach, within_reach, &
        few_terms_angle, step_factor
    use frb_extrapolation_step, only: extrapolated_body, new_extrapolated_body, ask_torque, try_step, &
        accept_step, rounding
    use frb_free_flow, only: core_of, rigid_body
    use frb_kinds, only: is_number, wp
    use frb_rotations, only: is_unit_quat, norm3, quat_conjugate, quat_product, quat_rotate
    use frb_status, only: return_or_stop, status_ok, status_bad_attitude, status_bad_count, &
        status_bad_momentum, &
        status_bad_option, status_bad_time, status_bad_torque, status_stopped, status_too_rough
    use frb_torque, only: body_scene, body_observer
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: extrapolate, extrapolation_report

    !> Report of a run of `extrapolate`.
    type :: extrapolation_report
        integer(int64) :: steps = 0         !! steps taken
        integer(int64) :: rejected = 0      !! steps rejected
        integer(int64) :: torques = 0       !! number of attitudes for which the scene computed a torque
        real(wp) :: tolerance = 0.0_wp      !! the tolerance in use: not below the rounding of a step
        real(wp) :: largest_error = 0.0_wp  !! largest estimate of the error of a step taken, relative
        real(wp) :: shortest = 0.0_wp       !! shortest step taken but the last
        real(wp) :: longest = 0.0_wp        !! longest step taken
    end type extrapolation_report

    !> Moves a body under torque by `time` to a given accuracy, in place:
    !> `call extrapolate(body, scene, time, m, q, tolerance, t, observer, step, compensated, stat, report)`.
    !>
    !> `tolerance` bounds the estimated error of each step, relative to the largest entries of m and of q; any
    !> value from 1 to 0. A tolerance below 5e-15, the rounding of a step, counts as 5e-15: `report` has the
    !> tolerance in use, the largest estimate, steps and torques. The estimate has the size of the error; for
    !> loose tolerances it is up to six times too low. Errors of steps add up and grow with the motion: on the
    !> Hairer-Vilmart top 1e-10 gives 2e-11 at T = 10 and 5e-10 at T = 100.
    !>
    !> Without any torque the free flow moves the body, in one step, exactly. (A pulse of torque between the
    !> times of a step is missed: then bound the step by `step`.) Where a torque is switched on or off, the
    !> steps become short.
    !>
    !> `step` > 0 switches the adaptation off: equal steps of at most this size; the tolerance only chooses
    !> the sequences. `observer` sees the start and every step. `compensated`, the default, carries the
    !> rounding error of m and q to the next step; it costs nothing. For states at many times without an
    !> observer, call `extrapolate` for one interval after another, with `t`.
    !>
    !> One call of the scene's `torque_lanes` is for eight attitudes and times, of which the last four repeat
    !> the first four. A step has 28 to 53 different attitudes, one of them by `torque`. The default
    !> `torque_lanes` calls `torque` four times.
    !>
    !> frb_splitting says when to use which method. This one is not symplectic and not reversible: the energy
    !> drifts by the error of the steps, which can be near rounding up to about T = 1e5.
    !>
    !> Refused with `stat`, the state untouched: a body that could not be made; m not finite; q not finite or
    !> its norm more than 1e-6 off one; time, t or step not finite, |time| > 1e300, step < 0 or too small to
    !> count (`status_bad_time`); tolerance negative or not finite (`status_bad_option`). A run that ends
    !> early leaves m, q and t of the last step. It ends by the code that a torque returns; a torque that is
    !> not finite (`status_bad_torque`) or so rough that 10 000 steps in a row are a millionth of the step for
    !> a smooth torque (`status_too_rough`); a momentum along the axis of a linear rotor
    !> (`status_bad_momentum`); an observer (`status_stopped`; without `stat` the call then returns).
    !>
    !> n bodies that do not interact, all in the same scene: m is (3, n), q is (4, n), the body a scalar or
    !> body(n), without an observer. Each body has its own steps; a body that is refused keeps the state it
    !> reached, and the others go on. (Bodies side by side in the lanes would not be faster: the sequences of
    !> one body fill all places, and two vectors take twice as long as one.)
    interface extrapolate
        module procedure extrapolate_body
        module procedure extrapolate_alike
        module procedure extrapolate_bodies
    end interface extrapolate

contains

    !> One body.
    subroutine extrapolate_body(body, scene, time, m, q, tolerance, t, observer, step, compensated, stat, &
                                report)
        type(rigid_body), intent(in) :: body
        class(body_scene), intent(inout) :: scene                   !! the torque
        real(wp), intent(in) :: time                                !! how far, of either sign
        real(wp), intent(inout) :: m(3)                             !! angular momentum, body frame
        real(wp), intent(inout) :: q(4)                             !! attitude, unit quaternion
        real(wp), intent(in) :: tolerance                           !! relative error of a step, >= 0
        real(wp), intent(inout), optional :: t                      !! time at the start, goes on; from 0
        class(body_observer), intent(inout), optional :: observer   !! sees the start and every step
        real(wp), intent(in), optional :: step                      !! > 0: steps of at most this size
        logical, intent(in), optional :: compensated                !! default .true.
        integer, intent(out), optional :: stat                      !! status code
        type(extrapolation_report), intent(out), optional :: report
        type(extrapolated_body) :: moved
        type(extrapolation_report) :: told
        real(wp) :: t_now, fixed
        integer :: code

        t_now = 0.0_wp
        if (present(t)) t_now = t
        fixed = 0.0_wp
        if (present(step)) fixed = step
        code = body%status()
        if (code == status_ok) code = check_times(time, t_now, fixed, tolerance)
        if (code == status_ok .and. .not. all(is_number(m))) code = status_bad_momentum
        if (code == status_ok .and. .not. is_unit_quat(q)) code = status_bad_attitude
        call scene%agree(code)
        if (code == status_ok) then
            associate (core => core_of(body))
                told%tolerance = max(tolerance, rounding)
                moved = new_extrapolated_body(core, m, q, .true., told%tolerance)
                if (present(compensated)) moved%compensated = compensated
                call run_steps(moved, scene, time, fixed, t_now, told, code, observer)
                call state_of(moved, m, q)
            end associate
            if (present(t)) t = t_now
        end if
        if (present(report)) report = told
        call return_or_stop(code, 'extrapolate', stat)
    end subroutine extrapolate_body

    !> n bodies that are alike.
    subroutine extrapolate_alike(body, scene, time, m, q, tolerance, t, step, compensated, stat, report)
        type(rigid_body), intent(in) :: body
        include 'bodies_arguments.inc'

        call extrapolate_bodies([body], scene, time, m, q, tolerance, t, step, compensated, stat, report)
    end subroutine extrapolate_alike

    !> n bodies, one after another.
    subroutine extrapolate_bodies(body, scene, time, m, q, tolerance, t, step, compensated, stat, report)
        type(rigid_body), intent(in) :: body(:)                     !! n bodies, or one for all
        include 'bodies_arguments.inc'
        type(extrapolation_report) :: one, told
        real(wp) :: t_now
        integer :: code, refused, i

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(q, 1) == 4 .and. size(q, 2) == size(m, 2) &
            .and. (size(body) == 1 .or. size(body) == size(m, 2))) code = status_ok
        t_now = 0.0_wp
        if (code == status_ok) then
            do i = 1, size(m, 2)
                t_now = 0.0_wp
                if (present(t)) t_now = t
                call extrapolate_body(body(min(i, size(body))), scene, time, m(:, i), q(:, i), tolerance, &
                                      t_now, step=step, compensated=compensated, stat=refused, report=one)
                if (code == status_ok) code = refused
                told%torques = told%torques + one%torques
                told%rejected = told%rejected + one%rejected
                told%tolerance = max(told%tolerance, one%tolerance)
                told%largest_error = max(told%largest_error, one%largest_error)
                told%longest = max(told%longest, one%longest)
                told%shortest = merge(one%shortest, min(told%shortest, one%shortest), told%steps == 0)
                told%steps = told%steps + one%steps
            end do
            if (code == status_ok .and. present(t) .and. size(m, 2) > 0) t = t_now
        end if
        if (present(report)) report = told
        call return_or_stop(code, 'extrapolate', stat)
    end subroutine extrapolate_bodies

    !> `status_ok`, or the error in times and tolerance.
    pure function check_times(time, start, fixed, tolerance) result(code)
        real(wp), intent(in) :: time, start, fixed, tolerance
        integer :: code
        real(wp), parameter :: longest = 1.0e300_wp, most_steps = 1.0e15_wp

        code = status_bad_time
        if (.not. all(is_number([time, start, fixed]))) return
        if (abs(time) > longest .or. abs(start) > longest .or. fixed < 0.0_wp) return
        if (fixed > 0.0_wp .and. fixed < abs(time)/most_steps) return
        code = status_bad_option
        if (.not. is_number(tolerance)) return
        if (tolerance < 0.0_wp) return
        code = status_ok
    end function check_times

    !> The steps of a run, from time `t_now` on; `t_now` and the state are those of the last step taken.
    subroutine run_steps(moved, scene, time, fixed, t_now, told, code, observer)
        type(extrapolated_body), intent(inout) :: moved
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: time, fixed
        real(wp), intent(inout) :: t_now
        type(extrapolation_report), intent(inout) :: told
        integer, intent(out) :: code
        class(body_observer), intent(inout), optional :: observer
        real(wp) :: start, left, left_before, h, least, guess, ratio, before, longest, few_terms
        integer :: short_steps
        logical :: accepted, last

        start = t_now
        left = time
        code = status_ok
        guess = 0.0_wp
        h = 0.0_wp
        before = 0.0_wp
        few_terms = few_terms_angle(moved%set, told%tolerance)
        if (fixed > 0.0_wp) few_terms = 0.0_wp
        short_steps = 0
        if (present(observer)) call show(moved, scene, 0_int64, t_now, observer, code)
        do while (code == status_ok .and. abs(left) > 0.0_wp)
            call know_torque(moved, scene, t_now, told%torques, code)
            if (code /= status_ok) exit
            if (.not. guess > 0.0_wp) then
                guess = first_step(moved, scene, t_now, left, told%tolerance, told%torques)
                h = guess
            end if
            least = 4*epsilon(h)*max(abs(t_now), abs(left), tiny(h)/epsilon(h))
            longest = series_reach(moved)
            if (fixed > 0.0_wp) then
                h = abs(left)/max(1_int64, ceiling(abs(left)/fixed*(1 - 8*epsilon(h)), int64))
            else
                h = max(least, within_reach(longest, without_sliver(h, abs(left))))
            end if
            last = h >= abs(left)
            if (last) h = abs(left)
            call try_step(moved, scene, t_now, sign(h, time), h > 1.01_wp*longest, &
                          h*moved%core%beta*norm3(moved%x(1:3)) < few_terms, told%torques, code)
            call agree_on_step(moved, scene, code)
            if (code /= status_ok) exit
            ! Only NaN can cause rejected steps without end.
            ratio = min(moved%error, 1.0_wp)/told%tolerance
            accepted = ratio <= 1.0_wp .or. fixed > 0.0_wp .or. h <= least
            if (accepted .and. .not. moved%is_finite) code = status_bad_torque
            if (code /= status_ok) exit
            if (.not. accepted) then
                told%rejected = told%rejected + 1
                h = h*max(0.2_wp, min(step_factor(ratio, moved%set), 0.9_wp))
                before = min(before, h)
                cycle
            end if
            call accept_step(moved, sign(h, time), code)
            left_before = left
            left = merge(0.0_wp, left - sign(h, time), last)
            ! With flags as -Ofast, where NaN can be equal to anything, only bits end the loop.
            if (transfer(abs(left), 0_int64) == transfer(abs(left_before), 0_int64)) code = status_bad_time
            t_now = merge(start + time, start + (time - left), last)
            call note_step(told, h, moved%error, last)
            ! The guess has no meaning if there was no torque at the start.
            short_steps = merge(short_steps + 1, 0, h < 1.0e-6_wp*min(guess, longest) &
                                .and. .not. fixed > 0.0_wp)
            if (code == status_ok .and. short_steps > 10000) code = status_too_rough
            if (code == status_ok .and. present(observer)) then
                call show(moved, scene, told%steps, t_now, observer, code)
            end if
            if (last) exit
            h = h*min(step_factor(ratio, moved%set), 4.0_wp)
            ! The geometric mean of this size and the size found after the step before: changes of the
            ! estimate from step to step have less effect, which saves 8 % of the steps.
            if (before > 0.0_wp) h = sqrt(h)*sqrt(before)
            before = h
        end do
    end subroutine run_steps

    !> The torque at the start of a step, unless it is known: on all processes, or on none.
    subroutine know_torque(moved, scene, t_now, asked, code)
        type(extrapolated_body), intent(inout) :: moved
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: t_now
        integer(int64), intent(inout) :: asked
        integer, intent(out) :: code

        code = status_ok
        if (moved%torque_known) return
        call ask_torque(moved, scene, t_now, asked, code)
        call scene%agree(code)
    end subroutine know_torque

    !> All processes agree upon the code of a tried step, and upon whether it is finite: else one of them
    !> would reject a step that others accept.
    subroutine agree_on_step(moved, scene, code)
        type(extrapolated_body), intent(inout) :: moved
        class(body_scene), intent(inout) :: scene
        integer, intent(inout) :: code
        integer :: finite

        call scene%agree(code)
        if (code /= status_ok) return
        finite = merge(status_ok, status_bad_torque, moved%is_finite)
        call scene%agree(finite)
        moved%is_finite = finite == status_ok
        if (.not. moved%is_finite) moved%error = 1.0_wp
    end subroutine agree_on_step

    !> Adds an accepted step to the report.
    pure subroutine note_step(told, h, error, last)
        type(extrapolation_report), intent(inout) :: told
        real(wp), intent(in) :: h, error
        logical, intent(in) :: last

        told%steps = told%steps + 1
        told%largest_error = max(told%largest_error, error)
        told%longest = max(told%longest, h)
        if (told%steps == 1) then
            told%shortest = h
        else if (.not. last) then
            told%shortest = min(told%shortest, h)
        end if
    end subroutine note_step

    !> m and q in the axes of the body.
    pure subroutine state_of(moved, m, q)
        type(extrapolated_body), intent(in) :: moved
        real(wp), intent(out) :: m(3), q(4)

        m = moved%x(1:3)
        q = moved%x(4:7)
        if (moved%other_axes) then
            m = quat_rotate(moved%core%axes_q, m)
            q = quat_product(q, quat_conjugate(moved%core%axes_q))
        end if
    end subroutine state_of

    !> Shows the state to the observer; `code` is that of the scene, or `status_stopped`.
    subroutine show(moved, scene, step, t_now, observer, code)
        type(extrapolated_body), intent(in) :: moved
        class(body_scene), intent(inout) :: scene
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t_now
        class(body_observer), intent(inout) :: observer
        integer, intent(out) :: code
        real(wp) :: m(3), q(4)
        logical :: stop_here

        call state_of(moved, m, q)
        stop_here = .false.
        call observer%observe(step, t_now, m, q, stop_here)
        code = merge(status_stopped, status_ok, stop_here)
        call scene%agree(code)
    end subroutine show

end module frb_extrapolation
