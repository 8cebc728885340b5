!> The choice of step sizes of `extrapolate`: see frb_extrapolation.
module frb_extrapolation_control
    use frb_extrapolation_sets, only: powers, reaches, stages
    use frb_extrapolation_step, only: extrapolated_body, ask_torque, accept_step
    use frb_kinds, only: wp
    use frb_rotations, only: norm3
    use frb_status, only: status_ok
    use frb_torque, only: body_scene
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: first_step, without_sliver, series_reach, within_reach, &
        few_terms_angle, step_factor

contains

    !> The first step to be tried, from the torque at the start; if this is zero, from the torque at the state
    !> of the free body after half a radian.
    function first_step(moved, scene, t, left, tolerance, asked) result(h)
        type(extrapolated_body), intent(in) :: moved
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: t, left
        real(wp), intent(in) :: tolerance
        integer(int64), intent(inout) :: asked          !! attitudes at which the torque was asked for
        real(wp) :: h

        if (maxval(abs(moved%tau)) > 0.0_wp) then
            h = step_for(moved, moved%tau, tolerance)
        else
            h = step_for(moved, torque_ahead(moved, scene, t, left, asked), tolerance)
        end if
    end function first_step

    function torque_ahead(moved, scene, t, left, asked) result(torque)
        type(extrapolated_body), intent(in) :: moved
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: t, left
        integer(int64), intent(inout) :: asked
        real(wp) :: torque(3)
        type(extrapolated_body) :: ahead
        real(wp) :: h, rate
        integer :: code

        ahead = moved
        h = left/2
        rate = norm3(moved%core%a*moved%x(moved%core%order))
        if (rate > 1/abs(left)) h = sign(0.5_wp/rate, left)
        ahead%is_free = .true.
        call accept_step(ahead, h, code)
        ! If the scene refuses this state, it does so again when a step reaches it.
        if (code == status_ok) call ask_torque(ahead, scene, t + h, asked, code)
        call scene%agree(code)
        torque = merge(ahead%tau, 0.0_wp, code == status_ok)
    end function torque_ahead

    !> The step h, or near the end an equal part of the time left, so that no very short step remains; a
    !> little longer than h if this saves a step.
    pure function without_sliver(h, left) result(chosen)
        real(wp), intent(in) :: h, left
        real(wp) :: chosen

        chosen = h
        if (h < left .and. h > 0.3_wp*left) chosen = left/ceiling(0.92_wp*(left/h))
    end function without_sliver

    !> The step whose error is about the tolerance under a torque: the error of a step is some constant
    !> (|n|/Omega) h (Omega h)^(power - 1), n the angular acceleration by the torque, Omega the rate of all
    !> changes: the largest rate of the body, and what the torque adds to it in a step.
    pure function step_for(moved, torque, tolerance) result(h)
        type(extrapolated_body), intent(in) :: moved
        real(wp), intent(in) :: torque(3), tolerance
        real(wp) :: h
        real(wp), parameter :: constants(*) = [3.0e-15_wp, 2.0e-15_wp, 2.0e-10_wp]
        real(wp), parameter :: least = 1.0e-100_wp
        real(wp) :: acceleration, rate, ratio

        acceleration = norm3(moved%core%a*torque(moved%core%order))
        h = huge(h)
        if (.not. acceleration > 0.0_wp) return
        rate = hypot(moved%core%a(1)*norm3(moved%x(1:3)), 1.5_wp*sqrt(acceleration))
        ! rate^2/acceleration, kept from overflow.
        ratio = min(rate, 1/least)*(rate/max(acceleration, least*rate))
        h = (tolerance/constants(moved%set)*ratio)**(1.0_wp/powers(moved%set))/rate
    end function step_for

    !> The longest step for the series of the lanes: the half angle of its shortest drifts is then below 0.5.
    pure function series_reach(moved) result(h)
        type(extrapolated_body), intent(in) :: moved
        real(wp) :: h
        real(wp), parameter :: longest = 1.0e300_wp
        real(wp) :: rate

        h = longest
        rate = moved%core%a(1)*norm3(moved%x(1:3))
        if (rate > 8/longest) h = reaches(moved%set)/rate
    end function series_reach

    !> beta |m| h up to which the first terms of the series suffice for a step h. The terms left out are at
    !> most some 2e-14 (11 beta |m| h/stages)^10.5, as measured on four bodies with all sets: 0.002 tolerance.
    pure function few_terms_angle(set, tolerance) result(angle)
        integer, intent(in) :: set
        real(wp), intent(in) :: tolerance
        real(wp) :: angle

        angle = (stages(set)/11.0_wp)*(1.0e11_wp*tolerance)**(1/10.5_wp)
    end function few_terms_angle

    !> The step h, or the longest step of the series if it is not much shorter: the free flow takes about four
    !> times as long as the series.
    pure function within_reach(reach, h) result(chosen)
        real(wp), intent(in) :: reach, h
        real(wp) :: chosen

        chosen = h
        if (h > reach .and. h < 5*reach) chosen = reach
    end function within_reach

    !> Factor from a step with an error of `ratio` times the tolerance to the next step. 0.77: under a strong
    !> torque the estimate changes by a factor of ten from step to step, and a rejected step costs as much as
    !> any other.
    pure function step_factor(ratio, set) result(factor)
        real(wp), intent(in) :: ratio
        integer, intent(in) :: set      !! of sequences
        real(wp) :: factor

        factor = 0.77_wp*max(ratio, 1.0e-9_wp)**(-1.0_wp/powers(set))
    end function step_factor

end module frb_extrapolation_control
