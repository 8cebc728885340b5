!> A step of one body whose own axes are not principal.
module frb_flow_axes
    use frb_flow_momentum, only: flow_momentum => flow_one
    use frb_flow_state, only: flow_state => flow_one
    use frb_inertia, only: body_core, from_principal, keep_off_axis, to_principal
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_momentum, status_bad_attitude
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: flow_in_principal_axes, turn_back

contains

    !> A step of a body whose own axes are not principal, or of a linear rotor. A linear rotor has the
    !> constants of a sphere, which hold in any axes. For other bodies the momentum is rotated to principal
    !> axes, and only increments are rotated back, so that rounding of the rotation does not add up over many
    !> steps.
    pure recursive subroutine flow_in_principal_axes(body, h, m, code, q)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)
        real(wp), parameter :: large = huge(1.0_wp)/16
        real(wp) :: change(3), upright(3), turn(4), size_q
        logical :: fast

        code = status_bad_momentum
        if (.not. all(ieee_is_finite(m))) return
        if (present(q)) then
            code = status_bad_attitude
            size_q = sum(0.25_wp*abs(q))
            if (.not. ieee_is_finite(size_q)) return
            if (size_q <= 0.0_wp) return
        end if
        code = status_ok
        if (body%linear) then
            upright = m
            call keep_off_axis(body, upright, code)
            if (code /= status_ok) return
            if (present(q)) then
                call flow_state(body, h, upright, code, 1.0_wp, q)
            else
                call flow_momentum(body, h, upright, code, 1.0_wp)
            end if
            if (code == status_ok) m = upright
            return
        end if
        fast = maxval(abs(m)) > large
        if (fast) fast = ieee_is_finite(h)
        if (fast) fast = abs(h) < large
        if (fast) then
            ! The change of m, up to twice as large as m, could overflow.
            change = 0.125_wp*m
            call flow_in_principal_axes(body, 8*h, change, code, q)
            if (code == status_ok) m = 8*change
            return
        end if
        ! The change of m, not rounded to the digits of m: with nearly principal axes the small part that the
        ! rotation adds would be rounded away in every step, and |m| would drift.
        change = to_principal(body, m)
        if (present(q)) then
            turn = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call flow_state(body, h, change, code, 0.0_wp, turn)
            if (code == status_ok) call turn_back(body, change, turn, m, q)
        else
            call flow_momentum(body, h, change, code, 0.0_wp)
            if (code == status_ok) m = m + from_principal(body, change)
        end if
    end subroutine flow_in_principal_axes

    !> Adds a change of the momentum and a turn of norm one, both in principal axes, to m and q in body axes:
    !> as increments, so that rounding errors are those of the increments.
    pure subroutine turn_back(body, change, turn, m, q)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: change(3)
        real(wp), intent(in) :: turn(4)
        real(wp), intent(inout) :: m(3), q(4)
        real(wp) :: w(3), w0

        m = m + from_principal(body, change)
        w = from_principal(body, turn(2:4))
        w0 = turn(1) - 1
        if (turn(1) > 0.5_wp) w0 = -sum(w*w)/(1 + sqrt(1 - sum(w*w)))
        q = q + [q(1)*w0 - (q(2)*w(1) + q(3)*w(2) + q(4)*w(3)), &
                 q(1)*w(1) + q(2)*w0 + (q(3)*w(3) - q(4)*w(2)), &
                 q(1)*w(2) + q(3)*w0 + (q(4)*w(1) - q(2)*w(3)), &
                 q(1)*w(3) + q(4)*w0 + (q(2)*w(2) - q(3)*w(1))]
    end subroutine turn_back

end module frb_flow_axes
