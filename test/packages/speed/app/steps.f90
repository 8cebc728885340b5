!> Time of a step in ns by its length: momentum and attitude, momentum alone, and per body in batches; the
!> same of a body by its tensor, and with the derivative. The least of many runs, so that two versions can be
!> compared by running both in turn.
program steps
    use frb, only: wp, rigid_body, free_flow, flow_tangent
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    real(wp), parameter :: h(13) = [1.0e-3_wp, 3.0e-3_wp, 1.0e-2_wp, 3.0e-2_wp, 0.1_wp, 0.3_wp, 0.5_wp, &
                                    1.0_wp, 2.0_wp, 3.0_wp, 10.0_wp, 100.0_wp, 1000.0_wp]
    real(wp), parameter :: tensor(3, 3) = reshape([1.2_wp, 0.2_wp, 0.1_wp, 0.2_wp, 1.5_wp, -0.3_wp, &
                                                   0.1_wp, -0.3_wp, 2.0_wp], [3, 3])
    type(rigid_body) :: body, turned
    integer :: k

    body = rigid_body([1.0_wp, 1.5_wp, 2.2_wp])
    turned = rigid_body(tensor)
    print '(11a9)', 'h', 'with q', 'm alone', 'n = 1', 'n = 8', '1000', '1e6', 'tensor', '1000', 'deriv.', &
        '512'
    do k = 1, size(h)
        print '(f9.3,10f9.1)', h(k), one_body(body, h(k), .true.), one_body(body, h(k), .false.), &
            batch(body, h(k), 1, 100), batch(body, h(k), 8, 100), batch(body, h(k), 1000, 100), &
            batch(body, h(k), 1000000, 3), one_body(turned, h(k), .true.), batch(turned, h(k), 1000, 100), &
            derivative(h(k)), derivatives(h(k), 512)
    end do

contains

    function one_body(body, h, with_attitude) result(ns)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        logical, intent(in) :: with_attitude
        integer, parameter :: steps = 10000
        real(wp) :: ns, m(3), q(4)
        integer(int64) :: start, finish, rate
        integer :: run, i, stat

        ns = huge(ns)
        do run = 1, 60
            m = [0.6_wp, 0.5_wp, 0.8_wp]
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call system_clock(start, rate)
            if (with_attitude) then
                do i = 1, steps
                    call free_flow(body, h, m, q, stat)
                end do
            else
                do i = 1, steps
                    call free_flow(body, h, m, stat)
                end do
            end if
            call system_clock(finish)
            ns = min(ns, 1.0e9_wp*real(finish - start, wp)/rate/steps)
        end do
    end function one_body

    function batch(body, h, n, runs) result(ns)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        integer, intent(in) :: n, runs
        real(wp) :: ns
        real(wp), allocatable :: m(:, :), q(:, :)
        integer(int64) :: start, finish, rate
        integer :: run, i, calls, stat

        call states(n, m, q)
        calls = max(1, 4000/n)      ! the clock takes as long as a small batch
        ns = huge(ns)
        do run = 1, runs
            call system_clock(start, rate)
            do i = 1, calls
                call free_flow(body, h, m, q, stat)
            end do
            call system_clock(finish)
            ns = min(ns, 1.0e9_wp*real(finish - start, wp)/rate/calls/n)
        end do
    end function batch

    function derivative(h) result(ns)
        real(wp), intent(in) :: h
        integer, parameter :: steps = 1000
        real(wp) :: ns, m(3), q(4), transition(6, 6)
        integer(int64) :: start, finish, rate
        integer :: run, i, stat

        ns = huge(ns)
        do run = 1, 60
            m = [0.6_wp, 0.5_wp, 0.8_wp]
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call system_clock(start, rate)
            do i = 1, steps
                call flow_tangent(body, h, m, q, transition, stat)
            end do
            call system_clock(finish)
            ns = min(ns, 1.0e9_wp*real(finish - start, wp)/rate/steps)
        end do
    end function derivative

    function derivatives(h, n) result(ns)
        real(wp), intent(in) :: h
        integer, intent(in) :: n
        real(wp) :: ns
        real(wp), allocatable :: m(:, :), q(:, :), transition(:, :, :)
        integer(int64) :: start, finish, rate
        integer :: run, stat

        call states(n, m, q)
        allocate (transition(6, 6, n))
        ns = huge(ns)
        do run = 1, 300
            call system_clock(start, rate)
            call flow_tangent(body, h, m, q, transition, stat)
            call system_clock(finish)
            ns = min(ns, 1.0e9_wp*real(finish - start, wp)/rate/n)
        end do
    end function derivatives

    !> Momenta of norm one in all directions, attitudes 1.
    subroutine states(n, m, q)
        integer, intent(in) :: n
        real(wp), allocatable, intent(out) :: m(:, :), q(:, :)
        integer :: i

        allocate (m(3, n), q(4, n))
        call random_number(m)
        do i = 1, n
            m(:, i) = (m(:, i) - 0.5_wp)/norm2(m(:, i) - 0.5_wp)
            q(:, i) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        end do
    end subroutine states

end program steps
