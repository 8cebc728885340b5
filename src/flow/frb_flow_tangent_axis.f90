!> The derivative along the unstable axis, for motions on the separatrix: when one has reached this axis to
!> all digits, the group law adds the remaining time in closed form, with hyperbolic functions that may
!> overflow.
!>
!> In sorted axes, with k = -sign(m2 tau) sqrt(alpha/gamma), u = (dm1 + k dm3)/2 grows and v = (dm1 - k dm3)/2
!> decays. Of a motion that arrives at the axis, m1 = -k m3, and (a2 |m|^2 - 2 T)/2, |m|^2/2 and the action
!> T h of the step are known without rounding:
!>
!>     -2 gamma m1 u = alpha m3 dm3 - gamma m1 dm1 = c at the start,   m' dm' = m dm,
!>     m' dtheta' = m dtheta + h dT
!>
!> The columns of the first part of the step give the same, but where the motion began still closer to the
!> axis, v is so much larger than u that u is lost in its rounding. So are dm2' and dtheta2' beside u.
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
        real(wp) :: log_growth
        real(wp) :: k, alpha, gamma
        real(wp) :: turn_c, turn_s, m1, m2, a2_tau
        logical :: leaving              !! the motion has not turned yet: constants do not help
        logical :: closer               !! it has, and began closer to the axis than m
        integer :: o1, o2, o3
        real(wp) :: parity
    end type axis_map

    !> What is known of a column without rounding.
    type :: known_numbers
        real(wp) :: c, m_dm, u          !! c, m dm, u
        logical :: has_u
        real(wp) :: action              !! m dtheta + h dT
    end type known_numbers

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
        type(known_numbers) :: known(3)
        real(wp) :: column(6), a(3)
        integer :: k

        map = new_map(body, tau, m0, m)
        a(body%order) = body%a
        known%c = 0.0_wp
        known(map%o1)%c = -body%gamma*m0(map%o1)
        known(map%o3)%c = body%alpha*m0(map%o3)
        known%m_dm = m0
        known%u = 0.0_wp
        known%has_u = map%closer
        known(map%o2)%has_u = .not. map%leaving
        if (map%closer) then
            known(map%o1)%u = 0.5_wp*(m0(map%o1)/map%m1)
            known(map%o3)%u = -0.5_wp*(body%alpha/body%gamma)*(m0(map%o3)/map%m1)
        end if
        known%action = h*a*m0
        if (.not. present(q)) then
            do k = 1, 3
                column = [jacobian(:, k), 0.0_wp, 0.0_wp, 0.0_wp]
                if (k == map%o2) call shift(map, 2*m0(k)/map%m2**2, column)
                call apply(map, known(k), no_turn, column)
                jacobian(:, k) = column(1:3)
            end do
            return
        end if
        do k = 1, 3
            if (k == map%o2) call shift(map, 2*m0(k)/map%m2**2, transition(:, k))
            call turn_column(map, transition(4:6, 3 + k))
            call apply(map, known(k), transition(4:6, 3 + k), transition(:, k))
        end do
        if (present(by_inertia)) then
            do k = 1, elements
                call follow_inertia(body, map, h, m0, k, by_inertia(:, k))
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
        map%a2_tau = body%a(2)*tau
        x = abs(map%m2*tau)*sqrt(body%alpha)*sqrt(body%gamma)
        f = x/log_2
        map%exponent = most
        if (f < real(most, wp)) map%exponent = int(f)
        map%factor = exp(min(x - map%exponent*log_2, 1.0_wp))
        map%decay = 0.0_wp
        if (x < 600.0_wp) map%decay = exp(-x)
        map%log_growth = x
        map%k = -sign(sqrt(body%alpha/body%gamma), tau*map%m2)
        map%closer = abs(map%m1) > abs(m0(map%o1))
        map%leaving = map%closer .and. sign(1.0_wp, map%m1)*map%k*map%parity*m(map%o3) > 0.0_wp
        map%closer = map%closer .and. .not. map%leaving
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

    !> Adds to v what a change of log growth, half of `relative` to it, makes of m1 in the time tau.
    pure subroutine shift(map, relative, column)
        type(axis_map), intent(in) :: map
        real(wp), intent(in) :: relative
        real(wp), intent(inout) :: column(6)
        real(wp) :: v

        if (map%leaving) return
        v = -0.5_wp*(map%log_growth*relative)*map%m1
        column(map%o1) = column(map%o1) + v
        column(map%o3) = column(map%o3) - map%parity*v/map%k
    end subroutine shift

    !> Phi on a column (dm, dtheta) in the axes of the body, given what E of the whole step makes of the dm at
    !> the start. From J = E + m'^ W: dtheta1' = -(dm3' - (E dm)_3)/m2, dtheta3' = (dm1' - (E dm)_1)/m2.
    pure subroutine apply(map, known, turned, column)
        type(axis_map), intent(in) :: map
        type(known_numbers), intent(in) :: known
        real(wp), intent(in) :: turned(3)           !! E dm
        real(wp), intent(inout) :: column(6)
        real(wp) :: m1, m3, e1, e3, n1, n3, over, u, v

        over = 1/map%m2
        m1 = column(map%o1)
        m3 = map%parity*column(map%o3)
        e1 = over*turned(map%o1)
        e3 = over*map%parity*turned(map%o3)
        u = 0.5_wp*(m1 + map%k*m3)
        if (known%has_u) u = known%u
        v = 0.5_wp*(m1 - map%k*m3)
        if (map%leaving) then
            column(3 + map%o2) = column(3 + map%o2) + map%a2_tau*column(map%o2)
        else
            column(3 + map%o2) = over*(known%action - over*known%c/(map%gamma*map%k) &
                                       - (map%decay*map%m1)*(e3 + e1/map%k))
            column(map%o2) = over*(known%m_dm + 0.5_wp*known%c*(1/map%gamma - 1/map%alpha))
            ! m1 v is as small as m1^2, and without digits, unless v is the larger one.
            if (map%closer) column(map%o2) = column(map%o2) - over*(v*map%decay)*(map%m1*map%decay) &
                                             *(1 + map%gamma/map%alpha)
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
    !> c is f(m0) - f(m'), f = m dA m/2 less its part in |m|^2: what f loses in the time tau adds to u. The
    !> action loses the integral of omega_i omega_j by I_ij: one of m_i m_j is a component of m.
    pure subroutine follow_inertia(body, map, h, m0, element, column)
        type(body_core), intent(in) :: body
        type(axis_map), intent(in) :: map
        real(wp), intent(in) :: h, m0(3)
        integer, intent(in) :: element
        real(wp), intent(inout) :: column(6)
        integer, parameter :: without(4:6) = [3, 2, 1]      ! the axis that is not in 12, 13, 23
        type(known_numbers) :: known
        real(wp) :: turn(6), factor, over, lost, integral, a(3), n0(3), n(3), end(3)

        a = body%a
        n0 = m0(body%order)
        n = [map%m1, map%m2, -map%parity*map%m1/map%k]
        end = map%decay*n
        ! With m1 = 0 nothing is lost, and a compiler may divide where the quotient is not used.
        over = -0.5_wp/(body%gamma*merge(map%m1, 1.0_wp, abs(map%m1) > 0.0_wp))
        turn = 0.0_wp
        lost = form(over*n, n)
        ! The integral of m1^2: the derivative of m2 is beta m1 m3, m3^2 = m1^2 gamma/alpha.
        integral = sqrt(body%alpha/body%gamma)*(n(2) - n0(2))/body%beta
        integral = sign(integral, integral*sign(1.0_wp, n0(1))*sign(1.0_wp, map%parity*n0(3)))
        if (element == map%o1) then
            call shift(map, -a(1)**2/body%gamma, column)
            known%action = -0.5_wp*a(1)**2*(h*n0(1)**2 + integral)
        else if (element == map%o2) then
            call shift(map, a(2)**2*(1/body%gamma - 1/body%alpha), column)
            integral = (1 + body%gamma/body%alpha)*integral
            known%action = -0.5_wp*a(2)**2*(h*(2*n0(2)**2 + (n0(1)**2 + n0(3)**2)) - integral)
            column(3 + map%o2) = column(3 + map%o2) - body%a(2)*(map%a2_tau*map%m2)
        else if (element == map%o3) then
            call shift(map, a(3)**2/body%alpha, column)
            known%action = -0.5_wp*a(3)**2*(h*n0(3)**2 + integral*(body%gamma/body%alpha))
        else if (without(element) == map%o3) then
            factor = -a(1)*a(2)/body%gamma
            turn(map%o1) = factor*map%m2
            turn(3 + map%o3) = map%parity*factor
            known%action = end(3)*turn(3 + map%o3) &
                           + a(1)*a(2)*(map%parity*(end(3) - n0(3))/body%gamma - h*n0(1)*n0(2))
            lost = 0.0_wp
        else if (without(element) == map%o1) then
            factor = -a(2)*a(3)/body%alpha*map%parity
            turn(map%o3) = -map%parity*factor*map%m2
            turn(3 + map%o1) = factor
            known%action = end(1)*factor &
                           + a(2)*a(3)*(map%parity*(end(1) - n0(1))/body%alpha - h*n0(2)*n0(3))
            lost = 0.0_wp
        else
            known%action = -a(1)*a(3)*(map%parity*(n(2) - n0(2))/body%beta + h*n0(1)*n0(3))
        end if
        known%m_dm = 0.0_wp
        known%has_u = map%closer
        known%c = form(n0, n0)
        if (map%closer) known%u = form(over*n0, n0) - map%decay**2*lost
        column = column + turn
        if (.not. map%leaving) then
            lost = (1 - map%decay**2)*lost
            column(map%o1) = column(map%o1) + lost
            column(map%o3) = column(map%o3) + map%parity*lost/map%k
        end if
        call apply(map, known, no_turn, column)
        column = column - turn

    contains

        !> f as a form of two vectors in sorted axes: a small component is not squared.
        pure function form(p, q) result(f)
            real(wp), intent(in) :: p(3), q(3)
            real(wp) :: f

            if (element == map%o1) then
                f = 0.5_wp*a(1)**2*(p(1)*q(1))
            else if (element == map%o2) then
                f = -0.5_wp*a(2)**2*(p(1)*q(1) + p(3)*q(3))
            else if (element == map%o3) then
                f = 0.5_wp*a(3)**2*(p(3)*q(3))
            else if (without(element) == map%o3) then
                f = a(1)*a(2)*(p(1)*q(2))
            else if (without(element) == map%o1) then
                f = a(2)*a(3)*(q(2)*p(3))
            else
                f = a(1)*a(3)*(p(1)*q(3))
            end if
        end function form

    end subroutine follow_inertia

end module frb_flow_tangent_axis
