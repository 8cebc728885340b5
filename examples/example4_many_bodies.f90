!> Many bodies in one call: equal ones over one time, and different ones, each over a time of its own.
!>
!>   fpm run --example example4_many_bodies
program example4_many_bodies
    use frb, only: wp, rigid_body, free_flow, quat_rotate
    implicit none

    integer, parameter :: n = 10000
    type(rigid_body) :: molecule, asteroids(n)
    real(wp) :: m(3, n), q(4, n), h(n), start(3, n)
    integer :: i

    do i = 1, n
        m(:, i) = [sin(1.0_wp*i), cos(2.0_wp*i), sin(3.0_wp*i)]
        q(:, i) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        asteroids(i) = rigid_body([1.0_wp, 1.2_wp, 1.4_wp + 0.5_wp*i/n])
        h(i) = 100.0_wp*i/n
    end do
    start = m

    ! The momenta alone would be call free_flow(molecule, 0.5_wp, m).
    molecule = rigid_body([0.345_wp, 0.653_wp, 0.998_wp])
    call free_flow(molecule, 0.5_wp, m, q)
    print '(a,4f10.6)', 'the last molecule ', q(:, n)
    call free_flow(asteroids, h, m, q)
    print '(a,4f10.6)', 'the last asteroid ', q(:, n)

    ! In space every momentum is what it was.
    print '(a,l2)', 'momenta in space kept to 1e-14:', all(abs(quat_rotate(q, m) - start) < 1.0e-14_wp)

end program example4_many_bodies

! Output:
! the last molecule   0.912456 -0.150060  0.332231 -0.185819
! the last asteroid   0.284343 -0.219824  0.012627 -0.933095
! momenta in space kept to 1e-14: T
