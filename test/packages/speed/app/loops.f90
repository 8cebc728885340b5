!> A scene whose torque costs next to nothing, so that the loop around it shows.
module frb_easy_scene
    use frb, only: wp, group_scene, status_ok
    implicit none
    private

    public :: easy

    type, extends(group_scene) :: easy
    contains
        procedure :: torques
    end type easy

contains

    subroutine torques(self, q, t, tau, stat)
        class(easy), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(out) :: tau(:, :)
        integer, intent(out) :: stat

        tau = 0.1_wp*q(2:4, :)
        stat = status_ok
    end subroutine torques

end module frb_easy_scene

!> Ratios of time within one process: a call through the C interface to the Fortran call, and the user's own
!> loop over a splitting plan to `integrate`, for different bodies.
program loops
    use frb_easy_scene, only: easy
    use frb, only: wp, rigid_body, free_flow, integrate, splitting_scheme, splitting_plan
    use, intrinsic :: iso_c_binding, only: c_double, c_int, c_loc, c_ptr
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none

    interface
        !> The step of one body in C.
        function frb_flow(body, h, m, q) bind(c) result(stat)
            import :: c_double, c_int, c_ptr
            implicit none
            type(c_ptr), value :: body, m, q
            real(c_double), value :: h
            integer(c_int) :: stat
        end function frb_flow
    end interface

    integer, parameter :: n = 1000
    character(6), parameter :: names(4) = [character(6) :: 'strang', 'srkn6', 'srkn14', 'aba864']
    integer :: k

    do k = -3, 1
        print '(a,es8.1,a,f6.3)', 'a call from C, h =', 10.0_wp**k, ':', through_c(10.0_wp**k)
    end do
    do k = 1, size(names)
        print '(a,f6.3)', 'own loop / integrate, '//names(k)//':', own_loop(trim(names(k)))
    end do

contains

    !> Time of a step of one body called as from C, over that called from Fortran.
    function through_c(h) result(ratio)
        real(wp), intent(in) :: h
        integer, parameter :: steps = 10000
        type(rigid_body), target :: body
        real(wp), target :: m(3), q(4)
        real(wp) :: ratio, least(2)
        integer(int64) :: start, finish
        integer :: run, way, i, stat

        body = rigid_body([1.0_wp, 1.5_wp, 2.2_wp])
        least = huge(least)
        do run = 1, 100
            do way = 1, 2
                m = [0.6_wp, 0.5_wp, 0.8_wp]
                q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
                call system_clock(start)
                if (way == 1) then
                    do i = 1, steps
                        stat = frb_flow(c_loc(body), h, c_loc(m), c_loc(q))
                    end do
                else
                    do i = 1, steps
                        call free_flow(body, h, m, q, stat)
                    end do
                end if
                call system_clock(finish)
                least(way) = min(least(way), real(finish - start, wp))
            end do
        end do
        ratio = least(1)/least(2)
    end function through_c

    !> Time of the user's own loop over the plan of a scheme, over that of `integrate`.
    function own_loop(name) result(ratio)
        character(*), intent(in) :: name
        type(rigid_body) :: body(n)
        type(splitting_plan) :: plan
        type(easy) :: scene
        real(wp) :: ratio, least(2), m(3, n), q(4, n), tau(3, n)
        integer(int64) :: start, finish
        integer :: run, step, i, stat

        do i = 1, n
            body(i) = rigid_body([1.0_wp, 1.5_wp, 2.0_wp + 1.0e-4_wp*i])
        end do
        plan = splitting_plan(splitting_scheme(name), 0.01_wp)
        least = huge(least)
        do run = 1, 40
            call begin(m, q)
            call system_clock(start)
            do step = 1, 10
                do i = 1, plan%stages
                    if (abs(plan%drift(i)) > 0) call free_flow(body, plan%drift(i), m, q, stat)
                    call scene%torques(q, 0.0_wp, tau, stat)
                    m = m + plan%kick(i)*tau
                end do
                if (abs(plan%drift(plan%stages + 1)) > 0) then
                    call free_flow(body, plan%drift(plan%stages + 1), m, q, stat)
                end if
            end do
            call system_clock(finish)
            least(1) = min(least(1), real(finish - start, wp))
            call begin(m, q)
            call system_clock(start)
            call integrate(body, splitting_scheme(name), scene, 0.01_wp, 10, m, q)
            call system_clock(finish)
            least(2) = min(least(2), real(finish - start, wp))
        end do
        ratio = least(1)/least(2)
    end function own_loop

    subroutine begin(m, q)
        real(wp), intent(out) :: m(3, n), q(4, n)

        m = 0.5_wp
        q = spread([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 2, n)
    end subroutine begin

end program loops
