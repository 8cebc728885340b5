!> The tennis racket (Dzhanibekov's wing nut): a free body spun almost about its middle axis turns over, again
!> and again. No torque, so every state is one call of the free flow, whatever the time.
program scene5_tennis_racket
    use frb, only: wp, rigid_body, free_flow
    implicit none
    type(rigid_body) :: body
    real(wp) :: m(3), q(4)
    integer :: i

    body = rigid_body([3.0_wp, 5.0_wp, 9.0_wp])
    do i = 0, 10
        m = [0.0_wp, 2.0_wp, 0.01_wp]
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call free_flow(body, 10.0_wp*i, m, q)
        print '(a,i4,a,3f11.7)', 't =', 10*i, '   m = ', m
    end do
    print '(a,4f11.7)', 'q(100) = ', q
end program scene5_tennis_racket

! Output:
!   t =   0   m =   0.0000000  2.0000000  0.0100000
!   t =  10   m =  -0.0355491  1.9992100  0.0446722
!   t =  20   m =  -0.3128026  1.9378819  0.3832339
!   t =  30   m =  -1.2582525 -0.2049430  1.5410707
!   t =  40   m =  -0.2559746 -1.9586201  0.3136630
!   t =  50   m =  -0.0287511 -1.9994833  0.0366052
!   t =  60   m =   0.0016911 -1.9999982  0.0102122
!   t =  70   m =   0.0438534 -1.9987977  0.0546323
!   t =  80   m =   0.3812356 -1.9069999  0.4670234
!   t =  90   m =   1.2070177  0.5981392  1.4783226
!   t = 100   m =   0.2090943  1.9724855  0.2562823
!   q(100) =   0.9729650 -0.0717137 -0.2164463  0.0367039
