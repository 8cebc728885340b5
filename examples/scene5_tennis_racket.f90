!> The tennis racket (Dzhanibekov's wing nut): a free body spun almost about its middle axis turns over, again
!> and again. `free_motion` sets the motion up once; then every time costs the same, however far away.
program scene5_tennis_racket
    use frb, only: wp, rigid_body, free_motion
    implicit none
    type(free_motion) :: motion
    real(wp) :: m(3), q(4)
    integer :: i

    motion = free_motion(rigid_body([3.0_wp, 5.0_wp, 7.0_wp]), [0.0_wp, 2.0_wp, 0.01_wp], &
                         [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
    print '(a,f12.7)', 'two flips take', motion%period()
    do i = 0, 10
        call motion%at(10.0_wp*i, m, q)
        print '(a,i4,a,3f11.7)', 't =', 10*i, '   m = ', m
    end do
    print '(a,4f11.7)', 'q(100) = ', q
end program scene5_tennis_racket

! Output:
!   two flips take 149.0763449
!   t =   0   m =   0.0000000  2.0000000  0.0100000
!   t =  10   m =  -0.0181840  1.9997244  0.0295218
!   t =  20   m =  -0.1071222  1.9904144  0.1639371
!   t =  30   m =  -0.5707641  1.7070719  0.8719140
!   t =  40   m =  -0.9817422 -0.8872846  1.4996694
!   t =  50   m =  -0.2345570 -1.9536146  0.3584312
!   t =  60   m =  -0.0411481 -1.9985885  0.0636452
!   t =  70   m =  -0.0057463 -1.9999725  0.0133059
!   t =  80   m =   0.0072318 -1.9999564  0.0149007
!   t =  90   m =   0.0484252 -1.9980449  0.0746435
!   t = 100   m =   0.2744019 -1.9362366  0.4192751
!   q(100) =   0.1283627 -0.8343141 -0.0024165  0.5361317
