!> The free flow of one body, whatever its axes: momentum alone or with a quaternion.
module frb_flow_one
    use frb_flow_axes, only: flow_in_principal_axes
    use frb_flow_momentum, only: flow_momentum => flow_one
    use frb_flow_state, only: flow_state => flow_one
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok
    implicit none
    private

    public :: flow_body

    !> Advances the state of any body by h, `call flow_body(body, h, m, code [, q])`; code says why the input
    !> was refused, if it was.
    interface flow_body
        module procedure flow_body_momentum
        module procedure flow_body_state
    end interface flow_body

contains

    !> The momentum alone.
    pure subroutine flow_body_momentum(body, h, m, code)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code

        code = body%status
        if (code /= status_ok) return
        if (body%needs_rotation) then
            call flow_in_principal_axes(body, h, m, code)
        else
            call flow_momentum(body, h, m, code, 1.0_wp)
        end if
    end subroutine flow_body_momentum

    !> Momentum and attitude.
    pure subroutine flow_body_state(body, h, m, code, q)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout) :: q(4)

        code = body%status
        if (code /= status_ok) return
        if (body%needs_rotation) then
            call flow_in_principal_axes(body, h, m, code, q)
        else
            call flow_state(body, h, m, code, 1.0_wp, q)
        end if
    end subroutine flow_body_state

end module frb_flow_one
