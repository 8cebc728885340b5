!> One step of a filter for a tumbling satellite without gyroscopes: the state is momentum and attitude, the
!> star tracker measures the attitude alone. `flow_tangent` gives the exact transition of the error state
!> (dm, dtheta), dtheta in body axes; twenty lines make a multiplicative Kalman filter.
module frb_filter
    use frb, only: wp, rigid_body, flow_tangent, quat_product, quat_conjugate
    implicit none
    private

    public :: filter_step

contains

    !> Advances the estimate m, q and its covariance p by h, and corrects it by the measured attitude `seen`,
    !> good to sigma [rad].
    subroutine filter_step(body, h, seen, sigma, m, q, p)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h, seen(4), sigma
        real(wp), intent(inout) :: m(3), q(4), p(6, 6)
        real(wp) :: phi(6, 6), gain(6, 3), s(3, 3), error(4), x(6)

        call flow_tangent(body, h, m, q, phi)
        p = matmul(phi, matmul(p, transpose(phi)))
        s = p(4:6, 4:6)
        s(1, 1) = s(1, 1) + sigma**2
        s(2, 2) = s(2, 2) + sigma**2
        s(3, 3) = s(3, 3) + sigma**2
        gain = matmul(p(:, 4:6), inverse(s))
        error = quat_product(quat_conjugate(q), seen)
        x = matmul(gain, 2*error(2:4)/error(1))
        m = m + x(1:3)
        q = quat_product(q, [1.0_wp, x(4:6)/2])
        q = q/norm2(q)
        p = p - matmul(gain, p(4:6, :))
        p = 0.5_wp*(p + transpose(p))
    end subroutine filter_step

    pure function inverse(a) result(b)
        real(wp), intent(in) :: a(3, 3)
        real(wp) :: b(3, 3)

        b(1, :) = cross(a(:, 2), a(:, 3))
        b(2, :) = cross(a(:, 3), a(:, 1))
        b(3, :) = cross(a(:, 1), a(:, 2))
        b = b/dot_product(b(1, :), a(:, 1))
    end function inverse

    pure function cross(u, v) result(w)
        real(wp), intent(in) :: u(3), v(3)
        real(wp) :: w(3)

        w = [u(2)*v(3) - u(3)*v(2), u(3)*v(1) - u(1)*v(3), u(1)*v(2) - u(2)*v(1)]
    end function cross

end module frb_filter

program scene13_star_tracker
    use frb, only: wp, rigid_body, free_flow, quat_product, quat_conjugate
    use frb_filter, only: filter_step
    implicit none
    integer, parameter :: steps = 60
    real(wp), parameter :: h = 0.5_wp, sigma = 1.0e-3_wp
    type(rigid_body) :: body
    real(wp) :: m_true(3), q_true(4), m(3), q(4), p(6, 6), noise(3), off(4)
    integer :: i, k

    body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
    m_true = [0.5_wp, 0.6_wp, -0.4_wp]
    q_true = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    ! At the start the momentum is unknown, and the attitude almost unknown.
    m = 0.0_wp
    q = [cos(0.1_wp), sin(0.1_wp), 0.0_wp, 0.0_wp]
    p = 0.0_wp
    do i = 1, 3
        p(i, i) = 1.0_wp
        p(3 + i, 3 + i) = 0.1_wp
    end do
    print '(a)', ' time   error of m   predicted   error of q [rad]   predicted'
    do k = 1, steps
        call free_flow(body, h, m_true, q_true)
        noise = sigma*[sin(7.1_wp*k), cos(3.3_wp*k), sin(5.7_wp*k + 1)]*sqrt(2.0_wp)
        call filter_step(body, h, quat_product(q_true, [1.0_wp, noise/2]), sigma, m, q, p)
        if (mod(k, 10) > 0) cycle
        off = quat_product(quat_conjugate(q_true), q)
        print '(f5.1,2es12.1,2es15.1)', k*h, norm2(m - m_true), sqrt(p(1, 1) + p(2, 2) + p(3, 3)), &
            2*norm2(off(2:4)), sqrt(p(4, 4) + p(5, 5) + p(6, 6))
    end do
end program scene13_star_tracker

! Output:
!    time   error of m   predicted   error of q [rad]   predicted
!     5.0     8.4E-04     4.4E-04        1.4E-03        8.9E-04
!    10.0     3.4E-04     4.1E-04        7.7E-04        7.0E-04
!    15.0     1.9E-04     3.1E-04        7.2E-04        5.6E-04
!    20.0     9.8E-05     1.8E-04        3.5E-04        4.3E-04
!    25.0     1.2E-04     3.0E-04        4.8E-04        4.8E-04
!    30.0     4.9E-05     1.6E-04        4.4E-04        3.6E-04
