!> A square lattice of dipoles that turn about fixed centres, each along axis 3 of its body, in the field of
!> all the others: V = sum over pairs of (p_i . p_j - 3 (p_i . r)(p_j . r)/|r|^2)/|r|^3. No image charges, no
!> damping. The torques cost N^2, the free flow N.
module frb_dipole_lattice
    use frb, only: wp, group_scene, quat_rotate, quat_rotate_back, status_ok
    implicit none
    private

    public :: dipole_lattice

    type, extends(group_scene) :: dipole_lattice
        real(wp), allocatable :: centres(:, :)      ! (3, n), in space
        real(wp) :: moment = 1.0_wp
    contains
        procedure :: torques
        procedure :: potential
    end type dipole_lattice

contains

    !> Dipoles p and the field e of all others at each centre, in space.
    pure subroutine field(self, q, p, e)
        class(dipole_lattice), intent(in) :: self
        real(wp), intent(in) :: q(:, :)
        real(wp), intent(out) :: p(:, :), e(:, :)
        real(wp) :: r(3), r2, r3
        integer :: i, j

        do i = 1, size(q, 2)
            p(:, i) = self%moment*quat_rotate(q(:, i), [0.0_wp, 0.0_wp, 1.0_wp])
        end do
        e = 0.0_wp
        do i = 1, size(q, 2)
            do j = 1, i - 1
                r = self%centres(:, i) - self%centres(:, j)
                r2 = dot_product(r, r)
                r3 = r2*sqrt(r2)
                e(:, i) = e(:, i) + (3*dot_product(p(:, j), r)/r2*r - p(:, j))/r3
                e(:, j) = e(:, j) + (3*dot_product(p(:, i), r)/r2*r - p(:, i))/r3
            end do
        end do
    end subroutine field

    pure subroutine torques(self, q, t, tau, stat)
        class(dipole_lattice), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(out) :: tau(:, :)
        integer, intent(out) :: stat
        real(wp) :: p(3, size(q, 2)), e(3, size(q, 2))
        integer :: i

        associate (unused_t => t)
        end associate
        call field(self, q, p, e)
        do i = 1, size(q, 2)
            tau(:, i) = quat_rotate_back(q(:, i), [p(2, i)*e(3, i) - p(3, i)*e(2, i), &
                                                   p(3, i)*e(1, i) - p(1, i)*e(3, i), &
                                                   p(1, i)*e(2, i) - p(2, i)*e(1, i)])
        end do
        stat = status_ok
    end subroutine torques

    pure subroutine potential(self, q, t, v, stat)
        class(dipole_lattice), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), intent(out) :: v
        integer, intent(out) :: stat
        real(wp) :: p(3, size(q, 2)), e(3, size(q, 2))

        associate (unused_t => t)
        end associate
        call field(self, q, p, e)
        v = -0.5_wp*sum(p*e)
        stat = status_ok
    end subroutine potential

end module frb_dipole_lattice

program scene6_dipoles
    use frb, only: wp, rigid_body, splitting_scheme, integrate, kinetic_energy, total_energy
    use frb_dipole_lattice, only: dipole_lattice
    implicit none
    integer, parameter :: side = 6, n = side**2
    type(dipole_lattice) :: lattice
    type(rigid_body) :: body
    real(wp) :: m(3, n), q(4, n), t
    integer :: i

    body = rigid_body([1.0_wp, 1.0_wp, 0.2_wp])
    allocate (lattice%centres(3, n))
    do i = 1, n
        lattice%centres(:, i) = 2.0_wp*[mod(i - 1, side), (i - 1)/side, 0]
        q(:, i) = [cos(1.0_wp*i), sin(2.0_wp*i), cos(3.0_wp*i), sin(5.0_wp*i)]
        q(:, i) = q(:, i)/norm2(q(:, i))
    end do
    m = 0.0_wp
    t = 0.0_wp
    print '(a)', '    t    T            T + V'
    do i = 0, 5
        print '(f6.1,f10.4,f16.9)', t, kinetic_energy(body, m), total_energy(body, lattice, t, m, q)
        call integrate(body, splitting_scheme('srkn14'), lattice, 0.1_wp, 50, m, q, t=t)
    end do
end program scene6_dipoles

! Output:
!       t    T            T + V
!      0.0    0.0000    -1.815160953
!      5.0    2.7301    -1.815160953
!     10.0    4.0343    -1.815160953
!     15.0    3.9203    -1.815160953
!     20.0    4.3996    -1.815160953
!     25.0    3.1302    -1.815160953
