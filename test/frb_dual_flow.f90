!> The closed form of the free flow in dual numbers: the step of frb_flow_one, differentiated by machine.
!> First form, series for short steps, the integral of the third kind by Gauss's rule.
module frb_dual_flow
    use frb_dual_numbers, only: dual, variable, operator(+), operator(-), operator(*), operator(/), sqrt, &
        sin, cos
    use frb_elliptic, only: gauss_legendre
    use frb_kinds, only: wp
    implicit none
    private

    public :: dual_step

contains

    !> Derivatives of (m', theta') by m and by the moments I1 <= I2 <= I3, after a short step h from m.
    subroutine dual_step(moments, m0, h, by_m, by_moments)
        real(wp), intent(in) :: moments(3), m0(3), h
        real(wp), intent(out) :: by_m(6, 3), by_moments(6, 3)
        type(dual) :: m(3), inertia(3), alpha, beta, gamma, p, r, nu, s, c, d, n(3), d0, angle, q(4)
        real(wp) :: turns(3, 6)
        integer :: k

        do k = 1, 3
            m(k) = variable(m0(k), k)
            inertia(k) = variable(moments(k), 3 + k)
        end do
        alpha = (inertia(3) - inertia(2))/(inertia(2)*inertia(3))
        beta = (inertia(3) - inertia(1))/(inertia(1)*inertia(3))
        gamma = (inertia(2) - inertia(1))/(inertia(1)*inertia(2))
        p = gamma*(beta*m(1)*m(1) + alpha*m(2)*m(2))
        nu = gamma*m(2)*m(2) + beta*m(3)*m(3)
        r = alpha*nu
        nu = gamma*nu
        s = sine(p, r, 0.5_wp*h)
        c = sqrt(1.0_wp - p*s*s)
        d = sqrt(1.0_wp - r*s*s)
        d0 = 1.0_wp - alpha*gamma*m(2)*m(2)*s*s
        n(1) = (m(1)*d - alpha*m(2)*m(3)*s*c)/d0
        n(2) = (m(2)*c*d + beta*m(3)*m(1)*s)/d0
        n(3) = (m(3)*c - gamma*m(1)*m(2)*s*d)/d0
        angle = (dual(1.0_wp)/inertia(1))*h - 2.0_wp*(beta*nu*third_kind(p, r, nu, s))
        q = turn(m, angle, [d, dual(), -gamma*s*d*n(2), -beta*s*n(3)])
        d0 = 1.0_wp - alpha*gamma*n(2)*n(2)*s*s
        m(1) = m(1) - 2.0_wp*(alpha*n(2)*n(3)*s*c)/d0
        m(2) = m(2) + 2.0_wp*(beta*n(3)*n(1)*s)/d0
        m(3) = m(3) - 2.0_wp*(gamma*n(1)*n(2)*s*d)/d0
        ! dtheta = 2 conj(q) dq
        do k = 1, 6
            turns(1, k) = q(1)%v*q(2)%d(k) - q(2)%v*q(1)%d(k) - q(3)%v*q(4)%d(k) + q(4)%v*q(3)%d(k)
            turns(2, k) = q(1)%v*q(3)%d(k) - q(3)%v*q(1)%d(k) - q(4)%v*q(2)%d(k) + q(2)%v*q(4)%d(k)
            turns(3, k) = q(1)%v*q(4)%d(k) - q(4)%v*q(1)%d(k) - q(2)%v*q(3)%d(k) + q(3)%v*q(2)%d(k)
        end do
        do k = 1, 3
            by_m(1:3, k) = m%d(k)
            by_moments(1:3, k) = m%d(3 + k)
        end do
        by_m(4:6, :) = 2*turns(:, 1:3)
        by_moments(4:6, :) = 2*turns(:, 4:6)
    end subroutine dual_step

    !> s at t by its series in e1 = P + R, e2 = P R, for P t^2, R t^2 below 0.01.
    pure function sine(p, r, t) result(s)
        type(dual), intent(in) :: p, r
        real(wp), intent(in) :: t
        type(dual) :: s
        type(dual) :: e1, e2

        e1 = (p + r)*(t*t)
        e2 = p*r*t**4
        s = (1.0_wp - e1*(1/6.0_wp) + (e1*e1 + 12.0_wp*e2)*(1/120.0_wp) &
             - (e1*e1*e1 + 132.0_wp*e1*e2)*(1/5040.0_wp) &
             + (e1*e1*e1*e1 + 1224.0_wp*e1*e1*e2 + 3024.0_wp*e2*e2)*(1/362880.0_wp))*t
    end function sine

    !> The integral of x^2/((1 + nu x^2) sqrt((1 - P x^2) (1 - R x^2))) from 0 to s.
    function third_kind(p, r, nu, s) result(integral)
        type(dual), intent(in) :: p, r, nu, s
        type(dual) :: integral
        integer, parameter :: points = 6
        real(wp) :: nodes(points), weights(points)
        type(dual) :: x, y
        integer :: i

        call gauss_legendre(points, nodes, weights)
        integral = dual()
        do i = 1, points
            x = s*(0.5_wp*(1 + nodes(i)))
            y = x*x
            integral = integral + s*(0.5_wp*weights(i))*y &
                       /((1.0_wp + nu*y)*sqrt((1.0_wp - p*y)*(1.0_wp - r*y)))
        end do
    end function third_kind

    !> The quaternion e z: e the turn by |m| psi about m, z of any norm.
    pure function turn(m, psi, z) result(q)
        type(dual), intent(in) :: m(3), psi, z(4)
        type(dual) :: q(4)
        type(dual) :: norm, half, e(4)

        norm = sqrt(m(1)*m(1) + m(2)*m(2) + m(3)*m(3))
        half = 0.5_wp*(psi*norm)
        e(1) = cos(half)
        e(2:4) = m*(sin(half)/norm)
        q(1) = e(1)*z(1) - e(2)*z(2) - e(3)*z(3) - e(4)*z(4)
        q(2) = e(1)*z(2) + e(2)*z(1) + e(3)*z(4) - e(4)*z(3)
        q(3) = e(1)*z(3) + e(3)*z(1) + e(4)*z(2) - e(2)*z(4)
        q(4) = e(1)*z(4) + e(4)*z(1) + e(2)*z(3) - e(3)*z(2)
        q = q*(dual(1.0_wp)/sqrt(z(1)*z(1) + z(2)*z(2) + z(3)*z(3) + z(4)*z(4)))
    end function turn

end module frb_dual_flow
