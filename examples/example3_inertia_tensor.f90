!> A body given by its full inertia tensor, as a design program prints it: the free flow takes the tensor as
!> it is, and principal_axes computes the moments and axes.
!>
!>   fpm run --example example3_inertia_tensor
program example3_inertia_tensor
    use frb, only: wp, rigid_body, principal_axes, free_flow, quat_rotate, status_message
    implicit none

    !> Inertia about the centre of mass, in axes fixed to the body; symmetric, so row or column by column.
    real(wp), parameter :: tensor(3, 3) = reshape([2.0_wp, 0.3_wp, -0.1_wp, &
                                                   0.3_wp, 1.5_wp, 0.2_wp, &
                                                   -0.1_wp, 0.2_wp, 2.5_wp], [3, 3])
    type(rigid_body) :: body
    real(wp) :: moments(3), axes(3, 3)
    real(wp) :: omega(3), m(3), q(4)
    integer :: i, stat

    call principal_axes(tensor, moments, axes, stat)
    if (stat /= 0) error stop 'the tensor was refused'
    do i = 1, 3
        ! The sign of an axis is a matter of choice: print it with its largest component positive.
        print '(a,i0,a,f9.6,a,3f10.6)', 'moment ', i, ' is', moments(i), ' about the axis', &
            axes(:, i)*sign(1.0_wp, axes(maxloc(abs(axes(:, i)), dim=1), i))
    end do

    ! A body is made once and used for every step. Refused input shows in its status.
    body = rigid_body(tensor)
    if (body%status() /= 0) then
        print '(a)', status_message(body%status())
        error stop
    end if

    ! Momentum and attitude stay in the axes of the tensor.
    omega = [0.1_wp, 1.0_wp, 0.2_wp]
    m = matmul(tensor, omega)
    q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    print '(a,3f10.6)', 'momentum in space before', quat_rotate(q, m)
    call free_flow(body, 60.0_wp, m, q)
    print '(a,3f10.6)', 'momentum in space after ', quat_rotate(q, m)
    print '(a,3f10.6)', 'momentum in the body    ', m
    print '(a,4f10.6)', 'attitude                ', q

end program example3_inertia_tensor

! Output:
! moment 1 is 1.317240 about the axis -0.417947  0.889287 -0.185711
! moment 2 is 2.140435 about the axis  0.903858  0.427619  0.013522
! moment 3 is 2.542325 about the axis -0.091439  0.162205  0.982511
! momentum in space before  0.480000  1.570000  0.690000
! momentum in space after   0.480000  1.570000  0.690000
! momentum in the body     -1.758429  0.279433  0.035281
! attitude                 -0.307635 -0.494584  0.557939  0.591144
