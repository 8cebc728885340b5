!> The derivative along the unstable axis: when a motion has reached this axis to all digits, the group law
!> adds the remaining time in closed form, with hyperbolic functions that may overflow.
module frb_flow_tangent_axis
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    implicit none
    private

    public :: follow_axis

    !> Phi on the axis, in sorted axes: dm1' = growth (c dm1 + k13 s dm3), dm3' = growth (k31 s dm1 + c dm3).
    type :: axis_map
        integer :: exponent     !! growth = 2^exponent
        real(wp) :: c, s        !! cosh, sinh of lambda tau over growth
        real(wp) :: k13, k31, turn_c, turn_s, m2, a2_tau
        integer :: o1, o2, o3
        real(wp) :: parity
    end type axis_map

contains

    !> Continues the derivatives for the time tau from a state on the middle axis. By the group law
    !> Phi(h + tau) = Phi(tau) Phi(h). Entries beyond the largest number are Inf, never NaN: terms that grow
    !> and terms that do not are added last.
    pure subroutine follow_axis(body, tau, m, elements, q, transition, jacobian, by_inertia)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: tau, m(3)
        include 'tangent_results.inc'
        type(axis_map) :: map
        real(wp) :: column(6)
        integer :: k

        map = new_map(body, tau, m)
        if (.not. present(q)) then
            do k = 1, 3
                column = [jacobian(:, k), 0.0_wp, 0.0_wp, 0.0_wp]
                call apply(map, column)
                jacobian(:, k) = column(1:3)
            end do
            return
        end if
        do k = 1, 6
            column = transition(:, k)
            call apply(map, column)
            transition(:, k) = column
        end do
        if (present(by_inertia)) then
            do k = 1, elements
                call follow_inertia(body, map, k, by_inertia(:, k))
            end do
        end if
    end subroutine follow_axis

    !> cosh and sinh as a power of 2 and factors.
    pure function new_map(body, tau, m) result(map)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: tau, m(3)
        type(axis_map) :: map
        real(wp), parameter :: log_2 = 0.693147180559945309417232121458176568_wp
        integer, parameter :: most = 100000     ! beyond any number
        real(wp) :: x, f, over

        map%o1 = body%order(1)
        map%o2 = body%order(2)
        map%o3 = body%order(3)
        map%parity = body%parity
        map%m2 = sign(norm2(m), m(map%o2))
        map%a2_tau = body%a(2)*tau
        x = abs(map%m2*tau)*sqrt(body%alpha)*sqrt(body%gamma)
        f = x/log_2
        map%exponent = most
        if (f < real(most, wp)) map%exponent = int(f)
        f = exp(min(x - map%exponent*log_2, 1.0_wp))
        over = 0.0_wp
        if (x < 300.0_wp) over = exp(-2*x)
        map%c = 0.5_wp*f*(1 + over)
        map%s = sign(0.5_wp*f*(1 - over), tau*map%m2)
        if (x < 0.1_wp) map%s = sign(scale(sinh(x), -map%exponent), tau*map%m2)
        map%k13 = -sqrt(body%alpha/body%gamma)
        map%k31 = -sqrt(body%gamma/body%alpha)
        map%turn_c = cos(map%a2_tau*map%m2)
        map%turn_s = sin(map%a2_tau*map%m2)
    end function new_map

    !> Phi on a column (dm, dtheta) in the axes of the body. From J = E + m'^ W: dtheta1' = -(dm3' - (E
    !> dm)_3)/m2 + (E dtheta)_1 and dtheta3' = (dm1' - (E dm)_1)/m2 + (E dtheta)_3.
    pure subroutine apply(map, column)
        type(axis_map), intent(in) :: map
        real(wp), intent(inout) :: column(6)
        real(wp) :: m1, m3, t1, t3, e1, e3, n1, n3, over

        over = 1/map%m2
        m1 = column(map%o1)
        m3 = map%parity*column(map%o3)
        t1 = column(3 + map%o1)
        t3 = map%parity*column(3 + map%o3)
        n1 = map%c*m1 + map%k13*(map%s*m3)
        n3 = map%k31*(map%s*m1) + map%c*m3
        ! E is the turn by -a2 m2 tau about axis 2.
        e1 = map%turn_c*m1 - map%turn_s*m3
        e3 = map%turn_s*m1 + map%turn_c*m3
        column(map%o1) = scale(n1, map%exponent)
        column(map%o3) = map%parity*scale(n3, map%exponent)
        column(3 + map%o1) = scale(-over*n3, map%exponent) &
                             + (over*e3 + (map%turn_c*t1 - map%turn_s*t3))
        column(3 + map%o2) = column(3 + map%o2) + map%a2_tau*column(map%o2)
        column(3 + map%o3) = map%parity*(scale(over*n1, map%exponent) &
                                         + (-over*e1 + (map%turn_s*t1 + map%turn_c*t3)))
    end subroutine apply

    !> The column of an element of the inertia. On the axis that of axis 2 alone turns the body; an element
    !> off the diagonal is a turn phi of the axes, which changes the column by (-phi x m, phi) before Phi and
    !> back after it: phi = e3/gamma for A_12, e1/alpha for A_23, along the axis, so without effect, for A_13.
    pure subroutine follow_inertia(body, map, element, column)
        type(body_core), intent(in) :: body
        type(axis_map), intent(in) :: map
        integer, intent(in) :: element
        real(wp), intent(inout) :: column(6)
        integer, parameter :: without(4:6) = [3, 2, 1]      ! the axis that is not in 12, 13, 23
        real(wp) :: turn(6), factor

        turn = 0.0_wp
        if (element > 3) then
            if (without(element) == map%o3) then
                factor = -body%a(1)*body%a(2)/body%gamma
                turn(map%o1) = factor*map%m2
                turn(3 + map%o3) = map%parity*factor
            else if (without(element) == map%o1) then
                factor = -body%a(2)*body%a(3)/body%alpha*map%parity
                turn(map%o3) = -map%parity*factor*map%m2
                turn(3 + map%o1) = factor
            end if
        end if
        column = column + turn
        call apply(map, column)
        column = column - turn
        if (element == map%o2) then
            column(3 + map%o2) = column(3 + map%o2) - body%a(2)*(map%a2_tau*map%m2)
        end if
    end subroutine follow_inertia

end module frb_flow_tangent_axis
