!> Time of a step in ns by its length: momentum and attitude, momentum alone, and per body in a batch of 1000
!> and of a million. The least of many runs, so that two versions can be compared by running both in turn.
program steps
    use frb, only: wp, rigid_body, free_flow
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    real(wp), parameter :: h(13) = [1.0e-3_wp, 3.0e-3_wp, 1.0e-2_wp, 3.0e-2_wp, 0.1_wp, 0.3_wp, 0.5_wp, &
                                    1.0_wp, 2.0_wp, 3.0_wp, 10.0_wp, 100.0_wp, 1000.0_wp]
    type(rigid_body) :: body
    integer :: k

    body = rigid_body([1.0_wp, 1.5_wp, 2.2_wp])
    print '(a)', '        h   with q  m alone  n = 1000  n = 1e6'
    do k = 1, size(h)
        print '(f9.3,4f9.1)', h(k), one_body(h(k), .true.), one_body(h(k), .false.), &
            batch(h(k), 1000, 300), batch(h(k), 1000000, 3)
    end do

contains

    function one_body(h, with_attitude) result(ns)
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

    function batch(h, n, runs) result(ns)
        real(wp), intent(in) :: h
        integer, intent(in) :: n, runs
        real(wp) :: ns
        real(wp), allocatable :: m(:, :), q(:, :)
        integer(int64) :: start, finish, rate
        integer :: run, i, stat

        allocate (m(3, n), q(4, n))
        call random_number(m)
        do i = 1, n
            m(:, i) = (m(:, i) - 0.5_wp)/norm2(m(:, i) - 0.5_wp)
            q(:, i) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        end do
        ns = huge(ns)
        do run = 1, runs
            call system_clock(start, rate)
            call free_flow(body, h, m, q, stat)
            call system_clock(finish)
            ns = min(ns, 1.0e9_wp*real(finish - start, wp)/rate/n)
        end do
    end function batch

end program steps
