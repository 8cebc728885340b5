!> The derivative along the unstable axis, for motions on the separatrix: when one has reached this axis to
!> all digits, the group law adds the remaining time in closed form, with hyperbolic functions that may
!> overflow.
!>
!> In sorted axes, with k = -sign(m2 tau) sqrt(alpha/gamma), u = dm1 + k dm3 grows and v = dm1 - k dm3 decays.
!> Where the motion began still closer to the axis, v is the larger one, and u and more are lost in its
!> rounding. But m1 = -k m3, and (a2 |m|^2 - 2 T)/2, |m|^2/2 and the action T h of the step give
!>
!>     -gamma m1 u = alpha m3 dm3 - gamma m1 dm1 = c at the start,   m' dm' = m dm,
!>     m' dtheta' = m dtheta + h dT
module frb_flow_tangent_axis
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    implicit none
    private

    public :: follow_axis

    !> Phi on the axis, in sorted axes: u' = growth u, v' = v/growth.
    type :: axis_map
        integer :: exponent             !! growth = 2^exponent factor
        real(wp) :: factor, decay       !! decay = 1/growth
        real(wp) :: k, alpha, gamma
        real(wp) :: turn_c, turn_s, m1, m2, a2_tau
        logical :: by_constants         !! the motion began closer to the axis than m
        integer :: o1, o2, o3
        real(wp) :: parity
    end type axis_map

    real(wp), parameter :: no_turn(3) = 0.0_wp

contains

    !> Continues the derivatives for the time tau, the last part of h, from a state m on the middle axis; m0:
    !> momentum at the start. By the group law Phi(h) = Phi(tau) Phi(h - tau). Entries beyond the largest
    !> number are Inf, never NaN: terms that grow and terms that do not are added last.
    pure subroutine follow_axis(body, h, tau, m0, m, elements, q, transition, jacobian, by_inertia)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h, tau, m0(3), m(3)
        include 'tangent_results.inc'
        type(axis_map) :: map
        real(wp) :: column(6), constant(3), action(3)
        integer :: k

        map = new_map(body, tau, m0, m)
        constant(map%o1) = -body%gamma*m0(map%o1)
        constant(map%o2) = 0.0_wp
        constant(map%o3) = body%alpha*m0(map%o3)
        if (.not. present(q)) then
            do k = 1, 3
                column = [jacobian(:, k), 0.0_wp, 0.0_wp, 0.0_wp]
                call apply(map, map%by_constants .or. k == map%o2, constant(k), m0(k), no_turn, column)
                jacobian(:, k) = column(1:3)
            end do
            return
        end if
        action(body%order) = h*body%a
        action = action*m0
        do k = 1, 3
            call turn_column(map, transition(4:6, 3 + k))
            call apply(map, map%by_constants .or. k == map%o2, constant(k), m0(k), transition(4:6, 3 + k), &
                       transition(:, k), action(k))
        end do
        if (present(by_inertia)) then
            do k = 1, elements
                call follow_inertia(body, map, m0, k, by_inertia(:, k))
            end do
        end if
    end subroutine follow_axis

    !> The growth as a power of 2 and a factor.
    pure function new_map(body, tau, m0, m) result(map)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: tau, m0(3), m(3)
        type(axis_map) :: map
        real(wp), parameter :: log_2 = 0.693147180559945309417232121458176568_wp
        integer, parameter :: most = 100000     ! beyond any number
        real(wp) :: x, f

        map%o1 = body%order(1)
        map%o2 = body%order(2)
        map%o3 = body%order(3)
        map%parity = body%parity
        map%alpha = body%alpha
        map%gamma = body%gamma
        map%m1 = m(map%o1)
        map%m2 = sign(norm2(m), m(map%o2))
        map%by_constants = abs(map%m1) > abs(m0(map%o1))
        map%a2_tau = body%a(2)*tau
        x = abs(map%m2*tau)*sqrt(body%alpha)*sqrt(body%gamma)
        f = x/log_2
        map%exponent = most
        if (f < real(most, wp)) map%exponent = int(f)
        map%factor = exp(min(x - map%exponent*log_2, 1.0_wp))
        map%decay = 0.0_wp
        if (x < 600.0_wp) map%decay = exp(-x)
        map%k = -sign(sqrt(body%alpha/body%gamma), tau*map%m2)
        map%turn_c = cos(map%a2_tau*map%m2)
        map%turn_s = sin(map%a2_tau*map%m2)
    end function new_map

    !> E of the time tau, the turn by -a2 m2 tau about axis 2, on dtheta.
    pure subroutine turn_column(map, theta)
        type(axis_map), intent(in) :: map
        real(wp), intent(inout) :: theta(3)
        real(wp) :: t1, t3

        t1 = theta(map%o1)
        t3 = map%parity*theta(map%o3)
        theta(map%o1) = map%turn_c*t1 - map%turn_s*t3
        theta(map%o3) = map%parity*(map%turn_s*t1 + map%turn_c*t3)
    end subroutine turn_column

    !> Phi on a column (dm, dtheta) in the axes of the body, given what E of the whole step makes of the dm at
    !> the start. From J = E + m'^ W: dtheta1' = -(dm3' - (E dm)_3)/m2, dtheta3' = (dm1' - (E dm)_1)/m2.
    pure subroutine apply(map, by_constants, constant, norm, turned, column, action)
        type(axis_map), intent(in) :: map
        logical, intent(in) :: by_constants
        real(wp), intent(in) :: constant, norm      !! at the start, c and m dm
        real(wp), intent(in) :: turned(3)           !! E dm
        real(wp), intent(inout) :: column(6)
        real(wp), intent(in), optional :: action    !! m dtheta + h dT
        real(wp) :: m1, m3, e1, e3, n1, n3, over, u, v

        over = 1/map%m2
        m1 = column(map%o1)
        m3 = map%parity*column(map%o3)
        e1 = over*turned(map%o1)
        e3 = over*map%parity*turned(map%o3)
        u = 0.5_wp*(m1 + map%k*m3)
        v = 0.5_wp*(m1 - map%k*m3)
        column(3 + map%o2) = column(3 + map%o2) + map%a2_tau*column(map%o2)
        if (by_constants) then
            u = 0.0_wp
            if (abs(constant) > 0.0_wp) u = -0.5_wp*constant/(map%gamma*map%m1)
            column(map%o2) = over*(norm + 0.5_wp*constant*(1/map%gamma - 1/map%alpha) &
                                   - (v*map%decay)*(map%m1*map%decay)*(1 + map%gamma/map%alpha))
            if (present(action)) column(3 + map%o2) = over*(action - over*constant/(map%gamma*map%k) &
                                                            - (map%decay*map%m1)*(e3 + e1/map%k))
        end if
        v = (v*map%decay)*map%decay
        n1 = map%factor*(u + v)
        n3 = map%factor*((u - v)/map%k)
        column(map%o1) = scale(n1, map%exponent)
        column(map%o3) = map%parity*scale(n3, map%exponent)
        column(3 + map%o1) = scale(-over*n3, map%exponent) + e3
        column(3 + map%o3) = map%parity*(scale(over*n1, map%exponent) - e1)
    end subroutine apply

    !> The column of an element of the inertia. On the axis that of axis 2 alone turns the body; an element
    !> off the diagonal is a turn phi of the axes, which changes the column by (-phi x m, phi) before Phi and
    !> back after it: phi = e3/gamma for A_12, e1/alpha for A_23, along the axis, so without effect, for A_13.
    !> The form f of the constant of the motion changes too: c is f(m0) - f(m).
    pure subroutine follow_inertia(body, map, m0, element, column)
        type(body_core), intent(in) :: body
        type(axis_map), intent(in) :: map
        real(wp), intent(in) :: m0(3)
        integer, intent(in) :: element
        real(wp), intent(inout) :: column(6)
        integer, parameter :: without(4:6) = [3, 2, 1]      ! the axis that is not in 12, 13, 23
        real(wp) :: turn(6), factor, f0, f, a(3), n0(3), n(3)

        turn = 0.0_wp
        a = body%a
        n0 = m0(body%order)
        n = [map%m1, 0.0_wp, -map%parity*map%m1/map%k]
        f = 0.0_wp
        if (element == map%o1) then
            f0 = 0.5_wp*(a(1)*n0(1))**2
            f = 0.5_wp*(a(1)*n(1))**2
        else if (element == map%o2) then
            f0 = -0.5_wp*a(2)**2*(n0(1)**2 + n0(3)**2)
            f = -0.5_wp*a(2)**2*(n(1)**2 + n(3)**2)
        else if (element == map%o3) then
            f0 = 0.5_wp*(a(3)*n0(3))**2
            f = 0.5_wp*(a(3)*n(3))**2
        else if (without(element) == map%o3) then
            factor = -a(1)*a(2)/body%gamma
            turn(map%o1) = factor*map%m2
            turn(3 + map%o3) = map%parity*factor
            f0 = a(1)*a(2)*(n0(1)*n0(2))
        else if (without(element) == map%o1) then
            factor = -a(2)*a(3)/body%alpha*map%parity
            turn(map%o3) = -map%parity*factor*map%m2
            turn(3 + map%o1) = factor
            f0 = a(2)*a(3)*(n0(2)*n0(3))
        else
            f0 = a(1)*a(3)*(n0(1)*n0(3))
            f = a(1)*a(3)*(n(1)*n(3))
        end if
        column = column + turn
        ! What f loses in the time tau adds to u.
        f0 = f0 - map%decay**2*f
        if (abs(f) > 0.0_wp) then
            f = 0.5_wp*(1 - map%decay**2)*f/(map%gamma*map%m1)
            column(map%o1) = column(map%o1) - f
            column(map%o3) = column(map%o3) - map%parity*f/map%k
        end if
        call apply(map, map%by_constants, f0, 0.0_wp, no_turn, column)
        column = column - turn
        if (element == map%o2) then
            column(3 + map%o2) = column(3 + map%o2) - body%a(2)*(map%a2_tau*map%m2)
        end if
    end subroutine follow_inertia

end module frb_flow_tangent_axis
