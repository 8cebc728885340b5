!> A satellite on a circular orbit of unit rate: the gravity gradient turns its long axis towards the Earth.
!> V = 3/2 u . I u with u = Q^T e, e the direction to the centre of the Earth, which turns once per orbit; the
!> torque is 3 u x I u. Nothing else acts: no drag, no flexing, a spherical Earth.
module frb_satellite
    use frb, only: wp, body_scene, quat_rotate, quat_rotate_back, status_ok
    implicit none
    private

    public :: gravity_gradient, to_earth

    type, extends(body_scene) :: gravity_gradient
        real(wp) :: moments(3) = 1.0_wp
    contains
        procedure :: torque
        procedure :: potential
    end type gravity_gradient

contains

    !> Direction to the centre of the Earth at time t, in space.
    pure function to_earth(t) result(e)
        real(wp), intent(in) :: t
        real(wp) :: e(3)

        e = [-cos(t), -sin(t), 0.0_wp]
    end function to_earth

    pure subroutine torque(self, q, t, tau, stat)
        class(gravity_gradient), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat
        real(wp) :: u(3)

        u = quat_rotate_back(q, to_earth(t))
        tau = 3*[(self%moments(3) - self%moments(2))*u(2)*u(3), &
                 (self%moments(1) - self%moments(3))*u(3)*u(1), &
                 (self%moments(2) - self%moments(1))*u(1)*u(2)]
        stat = status_ok
    end subroutine torque

    pure subroutine potential(self, q, t, v, stat)
        class(gravity_gradient), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: v
        integer, intent(out) :: stat

        v = 1.5_wp*sum(self%moments*quat_rotate_back(q, to_earth(t))**2)
        stat = status_ok
    end subroutine potential

end module frb_satellite

program scene4_satellite
    use frb, only: wp, rigid_body, splitting_scheme, integrate, quat_rotate, total_energy, spatial_momentum
    use frb_satellite, only: gravity_gradient, to_earth
    implicit none
    type(gravity_gradient) :: scene
    type(rigid_body) :: body
    real(wp) :: m(3), q(4), t, pointing, jacobi, l(3)
    integer :: i

    scene%moments = [0.2_wp, 0.9_wp, 1.0_wp]
    body = rigid_body(scene%moments)
    ! Axis 1 points 0.3 radians off the Earth in the plane of the orbit and a little out of it; one turn per
    ! orbit.
    q = [cos(0.15_wp), 0.0_wp, 0.05_wp, sin(0.15_wp)]
    q = q/norm2(q)
    m = [0.0_wp, 0.0_wp, 1.0_wp]
    t = 0.0_wp
    print '(a)', 'quarter orbits   axis 1 off the Earth   T + V - L3'
    do i = 0, 8
        pointing = acos(abs(dot_product(quat_rotate(q, [1.0_wp, 0.0_wp, 0.0_wp]), to_earth(t))))
        l = spatial_momentum(m, q)
        jacobi = total_energy(body, scene, t, m, q) - l(3)      ! conserved in the frame that turns
        print '(i8,f22.6,f23.12)', i, pointing, jacobi
        call integrate(body, splitting_scheme('srkn14'), scene, acos(-1.0_wp)/40, 20, m, q, t=t)
    end do
end program scene4_satellite

! Output:
!   quarter orbits   axis 1 off the Earth   T + V - L3
!          0              0.316083        -0.092096868943
!          1              0.209807        -0.092096868943
!          2              0.115956        -0.092096868943
!          3              0.293246        -0.092096868943
!          4              0.269108        -0.092096868943
!          5              0.063293        -0.092096868943
!          6              0.221834        -0.092096868943
!          7              0.298422        -0.092096868943
!          8              0.147593        -0.092096868943
