!> A Lagrange top (I1 = I2, centre of mass on axis 3, unit weight): it spins, precesses and nods. Its energy
!> and its momenta about the vertical and about its own axis are conserved: the run needs no reference.
program scene3_lagrange_top
    use frb, only: wp, rigid_body, heavy_top, splitting_scheme, integrate, quat_rotate, spatial_momentum, &
        total_energy
    implicit none
    type(rigid_body) :: body
    type(heavy_top) :: top
    real(wp) :: m(3), q(4), t, axis(3), l(3)
    integer :: i

    body = rigid_body([1.0_wp, 1.0_wp, 0.5_wp])
    m = [0.0_wp, 0.0_wp, 4.0_wp]
    q = [cos(0.3_wp), sin(0.3_wp), 0.0_wp, 0.0_wp]      ! leaning by 0.6 radians
    t = 0.0_wp
    print '(a)', '     t      lean   about vertical   about own axis    energy'
    do i = 0, 5
        axis = quat_rotate(q, [0.0_wp, 0.0_wp, 1.0_wp])
        l = spatial_momentum(m, q)
        print '(f6.1,f10.5,3f17.12)', t, acos(axis(3)), l(3), m(3), total_energy(body, top, t, m, q)
        call integrate(body, splitting_scheme('srkn11'), top, 0.05_wp, 20, m, q, t=t)
    end do
end program scene3_lagrange_top

! Output:
!        t      lean   about vertical   about own axis    energy
!      0.0   0.60000   3.301342459639   4.000000000000  16.825335614910
!      1.0   0.67944   3.301342459639   4.000000000000  16.825335614910
!      2.0   0.61596   3.301342459639   4.000000000000  16.825335614910
!      3.0   0.65263   3.301342459639   4.000000000000  16.825335614910
!      4.0   0.65095   3.301342459639   4.000000000000  16.825335614910
!      5.0   0.61738   3.301342459639   4.000000000000  16.825335614910
