!> One exact step of a free rigid body: its state after ten units of time, however fast it tumbles.
!>
!>   fpm run --example example1_one_step
program example1_one_step
    use frb, only: wp, frb_step
    implicit none

    !> Principal moments of inertia, in any order and any consistent units.
    real(wp), parameter :: moments(3) = [0.6_wp, 0.8_wp, 1.0_wp]

    !> The size of the step; it may be as long as you like, or negative.
    real(wp), parameter :: h = 10.0_wp

    real(wp) :: m0(3), q0(3, 3)     ! body angular momentum and attitude matrix at the start
    real(wp) :: m(3), q(3, 3)       ! the same at time h
    integer :: i, stat

    ! The momentum is given in the body frame; Q takes body to space, here the two frames agree at first.
    m0 = [1.8_wp, 0.4_wp, -0.9_wp]
    q0 = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

    call frb_step(m, q, h, moments, m0, q0, stat=stat)
    if (stat /= 0) error stop 'the input was refused'

    print '(a,3f14.10)', 'momentum in the body ', m
    do i = 1, 3
        print '(a,3f14.10)', 'attitude, a row of Q ', q(i, :)
    end do

    ! The body tumbles, but in space the angular momentum stays where it was: Q m = Q0 m0.
    print '(a,3f14.10)', 'momentum in space    ', matmul(q, m)

end program example1_one_step

! Output:
! momentum in the body   1.7659625085 -0.6954641970  0.7795549815
! attitude, a row of Q   0.7351681510  0.0372816605  0.6768588239
! attitude, a row of Q   0.6462667001  0.2628396975 -0.7164179268
! attitude, a row of Q  -0.2046146185  0.9641189611  0.1691374787
! momentum in space      1.8000000000  0.4000000000 -0.9000000000
