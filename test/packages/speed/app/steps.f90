!> Time of a step in ns by its length, of one body and per body in batches; bodies by tensor, different
!> bodies, and the derivative. The least of many runs, so that two versions can be compared by running both
!> in turn.
program steps
    use frb, only: wp, rigid_body, free_flow, free_flow_columns, flow_tangent
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    real(wp), parameter :: h(13) = [1.0e-3_wp, 3.0e-3_wp, 1.0e-2_wp, 3.0e-2_wp, 0.1_wp, 0.3_wp, 0.5_wp, &
                                    1.0_wp, 2.0_wp, 3.0_wp, 10.0_wp, 100.0_wp, 1000.0_wp]
    real(wp), parameter :: tensor(3, 3) = reshape([1.2_wp, 0.2_wp, 0.1_wp, 0.2_wp, 1.5_wp, -0.3_wp, &
                                                   0.1_wp, -0.3_wp, 2.0_wp], [3, 3])
    type(rigid_body) :: body, turned, bodies(1000)
    integer :: k

    body = rigid_body([1.0_wp, 1.5_wp, 2.2_wp])
    turned = rigid_body(tensor)
    do k = 1, size(bodies)
        bodies(k) = rigid_body([1.0_wp, 1.5_wp + 1.0e-4_wp*k, 2.2_wp])
    end do
    print '(a)', 'one body: with q, m alone, by a tensor; derivatives of m and q, of m alone'
    do k = 1, size(h)
        print '(f9.3,5f9.1)', h(k), one_body(body, h(k), .true.), one_body(body, h(k), .false.), &
            one_body(turned, h(k), .true.), derivative(h(k), .true.), derivative(h(k), .false.)
    end do
    print '(/,a)', 'a body in a batch of 1, 8, 1000, 1e6; of 1000: m alone, columns, momenta of mixed sizes, &
        &different bodies, by a tensor'
    do k = 1, size(h)
        print '(f9.3,9f9.1)', h(k), batch(body, h(k), 1), batch(body, h(k), 8), batch(body, h(k), 1000), &
            batch(body, h(k), 1000000), momenta(h(k)), columns(h(k)), batch(body, h(k), 1000, mixed=.true.), &
            different(h(k)), batch(turned, h(k), 1000)
    end do
    print '(/,a)', 'derivatives of 8 bodies, of 512 with momenta of one size, of mixed sizes'
    do k = 1, size(h)
        print '(f9.3,3f9.1)', h(k), derivatives(h(k), 8, .false.), derivatives(h(k), 512, .false.), &
            derivatives(h(k), 512, .true.)
    end do

contains

    function one_body(body, h, with_attitude) result(ns)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        logical, intent(in) :: with_attitude
        integer, parameter :: steps = 10000
        real(wp) :: ns, m(3), q(4)
        integer(int64) :: start
        integer :: run, i, stat

        ns = huge(ns)
        do run = 1, 60
            m = [0.6_wp, 0.5_wp, 0.8_wp]
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call system_clock(start)
            if (with_attitude) then
                do i = 1, steps
                    call free_flow(body, h, m, q, stat)
                end do
            else
                do i = 1, steps
                    call free_flow(body, h, m, stat)
                end do
            end if
            ns = min(ns, since(start)/steps)
        end do
    end function one_body

    function derivative(h, with_attitude) result(ns)
        real(wp), intent(in) :: h
        logical, intent(in) :: with_attitude
        integer, parameter :: steps = 1000
        real(wp) :: ns, m(3), q(4), transition(6, 6), jacobian(3, 3)
        integer(int64) :: start
        integer :: run, i, stat

        ns = huge(ns)
        do run = 1, 60
            m = [0.6_wp, 0.5_wp, 0.8_wp]
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call system_clock(start)
            if (with_attitude) then
                do i = 1, steps
                    call flow_tangent(body, h, m, q, transition, stat)
                end do
            else
                do i = 1, steps
                    call flow_tangent(body, h, m, jacobian, stat)
                end do
            end if
            ns = min(ns, since(start)/steps)
        end do
    end function derivative

    function batch(body, h, n, mixed) result(ns)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        integer, intent(in) :: n
        logical, intent(in), optional :: mixed
        real(wp) :: ns
        real(wp), allocatable :: m(:, :), q(:, :)
        integer(int64) :: start
        integer :: run, i, calls, stat

        call states(n, m, q, mixed)
        calls = max(1, 4000/n)      ! the clock takes as long as a small batch
        ns = huge(ns)
        do run = 1, merge(3, 100, n > 10000)
            call system_clock(start)
            do i = 1, calls
                call free_flow(body, h, m, q, stat)
            end do
            ns = min(ns, since(start)/calls/n)
        end do
    end function batch

    function momenta(h) result(ns)
        real(wp), intent(in) :: h
        integer, parameter :: n = 1000
        real(wp) :: ns
        real(wp), allocatable :: m(:, :), q(:, :)
        integer(int64) :: start
        integer :: run, i, stat

        call states(n, m, q)
        ns = huge(ns)
        do run = 1, 100
            call system_clock(start)
            do i = 1, 4
                call free_flow(body, h, m, stat)
            end do
            ns = min(ns, since(start)/4/n)
        end do
    end function momenta

    function columns(h) result(ns)
        real(wp), intent(in) :: h
        integer, parameter :: n = 1000
        real(wp) :: ns, c(n, 7)
        real(wp), allocatable :: m(:, :), q(:, :)
        integer(int64) :: start
        integer :: run, i, stat

        call states(n, m, q)
        c(:, :3) = transpose(m)
        c(:, 4:) = transpose(q)
        ns = huge(ns)
        do run = 1, 100
            call system_clock(start)
            do i = 1, 4
                call free_flow_columns(body, h, c(:, 1), c(:, 2), c(:, 3), c(:, 4), c(:, 5), c(:, 6), &
                                       c(:, 7), stat)
            end do
            ns = min(ns, since(start)/4/n)
        end do
    end function columns

    function different(h) result(ns)
        real(wp), intent(in) :: h
        real(wp) :: ns
        real(wp), allocatable :: m(:, :), q(:, :)
        integer(int64) :: start
        integer :: run, i, stat

        call states(size(bodies), m, q)
        ns = huge(ns)
        do run = 1, 100
            call system_clock(start)
            do i = 1, 4
                call free_flow(bodies, h, m, q, stat)
            end do
            ns = min(ns, since(start)/4/size(bodies))
        end do
    end function different

    function derivatives(h, n, mixed) result(ns)
        real(wp), intent(in) :: h
        integer, intent(in) :: n
        logical, intent(in) :: mixed
        real(wp) :: ns
        real(wp), allocatable :: m(:, :), q(:, :), transition(:, :, :)
        integer(int64) :: start
        integer :: run, i, calls, stat

        call states(n, m, q, mixed)
        calls = max(1, 512/n)
        allocate (transition(6, 6, n))
        ns = huge(ns)
        do run = 1, 300
            call system_clock(start)
            do i = 1, calls
                call flow_tangent(body, h, m, q, transition, stat)
            end do
            ns = min(ns, since(start)/calls/n)
        end do
    end function derivatives

    !> Momenta in all directions, of norm one or, `mixed`, with normally distributed components; attitudes 1.
    subroutine states(n, m, q, mixed)
        integer, intent(in) :: n
        real(wp), allocatable, intent(out) :: m(:, :), q(:, :)
        logical, intent(in), optional :: mixed
        real(wp) :: uniform(12)
        integer :: i, j

        allocate (m(3, n), q(4, n))
        do i = 1, n
            do j = 1, 3
                call random_number(uniform)
                m(j, i) = sum(uniform) - 6      ! close to the normal distribution
            end do
            q(:, i) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        end do
        m = sqrt(1/3.0_wp)*m
        if (present(mixed)) then
            if (mixed) return
        end if
        do i = 1, n
            m(:, i) = m(:, i)/norm2(m(:, i))
        end do
    end subroutine states

    !> Nanoseconds since a count of the clock.
    function since(start) result(ns)
        integer(int64), intent(in) :: start
        real(wp) :: ns
        integer(int64) :: finish, rate

        call system_clock(finish, rate)
        ns = 1.0e9_wp*real(finish - start, wp)/real(rate, wp)
    end function since

end program steps
