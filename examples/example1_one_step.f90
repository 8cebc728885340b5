!> One exact step of a free rigid body: its state after ten units of time, however fast it tumbles.
!>
!>   fpm run --example example1_one_step
program example1_one_step
    use frb, only: wp, rigid_body, free_flow, status_message
    implicit none

    !> The size of the step; it may be as long as you like, or negative.
    real(wp), parameter :: h = 10.0_wp

    type(rigid_body) :: body
    real(wp) :: m(3), a(3, 3)       ! body angular momentum and attitude matrix
    integer :: i, stat

    ! Principal moments of inertia, in any order and any consistent units.
    body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])

    ! The momentum is given in the body frame; a takes body to space, here the two frames agree at first. A
    ! quaternion q(4) may stand in the place of a.
    m = [1.8_wp, 0.4_wp, -0.9_wp]
    a = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

    ! Without the last argument a refused input stops the program with one line.
    call free_flow(body, h, m, a, stat)
    if (stat /= 0) print '(a)', status_message(stat)

    print '(a,3f14.10)', 'momentum in the body ', m
    do i = 1, 3
        print '(a,3f14.10)', 'attitude, row of a   ', a(i, :)
    end do

    ! The body tumbles, but in space the angular momentum stays where it was.
    print '(a,3f14.10)', 'momentum in space    ', matmul(a, m)

end program example1_one_step

! Output:
! momentum in the body   1.7659625085 -0.6954641970  0.7795549815
! attitude, row of a     0.7351681510  0.0372816605  0.6768588239
! attitude, row of a     0.6462667001  0.2628396975 -0.7164179268
! attitude, row of a    -0.2046146185  0.9641189611  0.1691374787
! momentum in space      1.8000000000  0.4000000000 -0.9000000000
