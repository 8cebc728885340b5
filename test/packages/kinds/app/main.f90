!> A program with other default kinds: calls all routines that use LAPACK, a step of the paper, the free flow.
program main
    use frb, only: wp, eint_gauss, ellint_pi, free_flow, order_report, principal_axes, quat_step, &
        rigid_body, splitting_scheme, status_ok
    implicit none
    real(wp), parameter :: small = 1.0e-13_wp
    type(order_report) :: report
    type(splitting_scheme) :: scheme
    real(wp) :: tensor(3, 3), moments(3), axes(3, 3), m(3), q(4), m2(3), q2(4), difference
    integer :: stat

    tensor = reshape([2.0_wp, 0.5_wp, 0.25_wp, 0.5_wp, 3.0_wp, -0.5_wp, 0.25_wp, -0.5_wp, 4.0_wp], [3, 3])
    call principal_axes(tensor, moments, axes, stat)
    if (stat /= status_ok) error stop 'principal_axes: refused'
    difference = maxval(abs(matmul(tensor, axes(:, 2)) - moments(2)*axes(:, 2)))
    if (difference > small) error stop 'principal_axes: wrong'
    difference = eint_gauss(0.1_wp, 0.9_wp, 0.3_wp, 0.5_wp, 20, stat=stat)
    difference = difference - ellint_pi(0.1_wp, 0.9_wp, 0.3_wp, 0.5_wp)
    if (abs(difference) > small) error stop 'eint_gauss: wrong'
    if (stat /= status_ok) error stop 'eint_gauss: refused'
    scheme = splitting_scheme('srkn14')
    report = scheme%conditions()
    if (report%nystroem_order /= 6) error stop 'conditions: wrong'
    m = [0.3_wp, 0.4_wp, 1.2_wp]
    q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    call quat_step(m2, q2, 0.7_wp, moments, m, q)
    call free_flow(rigid_body(moments), 0.7_wp, m, q)
    if (maxval(abs([m - m2, q - q2])) > small) error stop 'free_flow: not as quat_step'
    if (kind(1.0) /= wp .or. kind(1) == 4) error stop 'the default kinds are not changed'
end program main
