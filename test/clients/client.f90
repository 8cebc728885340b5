! Results of the installed library in a Fortran program, printed as by client.c.
program client
    use, intrinsic :: iso_fortran_env, only: int64
    use frb, only: wp, rigid_body, free_flow, flow_tangent, free_motion, heavy_top, integrate, &
        splitting_scheme
    implicit none
    integer, parameter :: n = 40
    real(wp), parameter :: start(3) = [1.8_wp, 0.4_wp, -0.9_wp], none(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    type(rigid_body) :: body, turned, bodies(n)
    type(free_motion) :: motion
    type(heavy_top) :: top
    real(wp) :: m(3), q(4), many_m(3, n), many_q(4, n), transition(6, 6), by_moments(6, 3)
    integer :: i

    body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
    turned = rigid_body(reshape([0.9_wp, 0.1_wp, 0.05_wp, 0.1_wp, 0.8_wp, -0.02_wp, &
                                 0.05_wp, -0.02_wp, 0.7_wp], [3, 3]))
    m = start
    q = none
    call free_flow(body, 10.0_wp, m, q)
    call say('flow', m)
    call say('flow', q)
    call free_flow(turned, -0.3_wp, m)
    call say('momentum', m)
    do i = 1, n
        bodies(i) = body
        if (mod(i - 1, 3) == 0) bodies(i) = turned
        many_m(:, i) = start
        many_q(:, i) = none
        many_m(1, i) = many_m(1, i) + 0.1_wp*(i - 1)
    end do
    call free_flow(bodies, 0.25_wp, many_m, many_q)
    call free_flow(body, 0.25_wp, many_m, many_q)
    call say('batch', [many_m])
    call say('batch', [many_q])
    motion = free_motion(body, start, none)
    call say('period', [motion%period()])
    call say('precession', [motion%precession()])
    call motion%at([-3.7_wp, 1000.0_wp], many_m(:, :2), many_q(:, :2))
    call say('motion', [many_m(:, :2)])
    call say('motion', [many_q(:, :2)])
    call integrate(body, splitting_scheme('srkn14'), top, 0.1_wp, 100, m, q)
    call say('top', m)
    call say('top', q)
    call flow_tangent(turned, 2.0_wp, m, q, transition, by_moments)
    call say('tangent', m)
    call say('tangent', q)
    call say('tangent', [transpose(transition)])
    call say('tangent', [transpose(by_moments)])

contains

    subroutine say(what, x)
        character(*), intent(in) :: what
        real(wp), intent(in) :: x(:)
        integer :: k

        do k = 1, size(x)
            print '(a,1x,z16.16)', what, transfer(x(k), 0_int64)
        end do
    end subroutine say

end program client
