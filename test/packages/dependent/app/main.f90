!> One step of each kind, by the library as a dependency.
program main
    use frb, only: wp, frb_step, quat_step
    implicit none
    real(wp), parameter :: moments(3) = [1.0_wp, 2.0_wp, 3.0_wp], m0(3) = [0.1_wp, 0.2_wp, 0.3_wp]
    real(wp) :: m(3), q(4), a(3, 3)

    call quat_step(m, q, 1.0_wp, moments, m0, [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
    call frb_step(m, a, 1.0_wp, moments, m0, &
                  reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3]))
    if (abs(norm2(q) - 1) > 1.0e-14_wp .or. abs(norm2(a) - sqrt(3.0_wp)) > 1.0e-14_wp) error stop 1
end program main
