!> A top in a gravity field: exact free motion (drift) between changes of the momentum by the torque (kick).
!>
!>   fpm run --example example2_kick_drift
program example2_kick_drift
    use frb, only: wp, rigid_body, free_flow, quat_rotate, quat_rotate_back
    implicit none

    real(wp), parameter :: moments(3) = [0.6_wp, 0.8_wp, 1.0_wp]

    !> Weight times the distance of the centre of mass from the fixed point, upwards in space. The centre of
    !> mass lies on body axis 3, so the potential energy is gravity . (q e3 q*).
    real(wp), parameter :: gravity(3) = [0.0_wp, 0.0_wp, 1.0_wp]
    real(wp), parameter :: axis(3) = [0.0_wp, 0.0_wp, 1.0_wp]

    real(wp), parameter :: h = 0.01_wp
    integer, parameter :: steps = 1000

    type(rigid_body) :: body
    real(wp) :: m(3), q(4), energy0
    integer :: i

    body = rigid_body(moments)
    m = [1.8_wp, 0.4_wp, -0.9_wp]
    q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    energy0 = energy()

    ! Half a drift, a kick, half a drift: the error of a step is of order h^3, and the step is reversible.
    do i = 1, steps
        call free_flow(body, h/2, m, q)
        m = m + h*torque(q)
        call free_flow(body, h/2, m, q)
    end do

    print '(a,3f10.6)', 'momentum at t = 10 ', m
    print '(a,3f10.6)', 'axis of the top    ', quat_rotate(q, axis)
    print '(a,f10.6)', 'energy             ', energy()
    print '(a,l2)', 'energy kept to 1e-4', abs(energy() - energy0) < 1.0e-4_wp

contains

    !> Torque in the body frame at the attitude q: with u = q* gravity q it is u x e3.
    pure function torque(q)
        real(wp), intent(in) :: q(4)
        real(wp) :: torque(3), u(3)

        u = quat_rotate_back(q, gravity)
        torque = [u(2), -u(1), 0.0_wp]
    end function torque

    !> Kinetic and potential energy.
    real(wp) function energy()
        energy = sum(m**2/moments)/2 + dot_product(gravity, quat_rotate(q, axis))
    end function energy

end program example2_kick_drift

! Output:
! momentum at t = 10   1.922547  0.772019 -0.201126
! axis of the top      0.255978  0.631260  0.732111
! energy               4.204999
! energy kept to 1e-4 T
