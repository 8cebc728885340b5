!> The stopwatch of the charts: all methods in one process, repetition after repetition in turn, so that a
!> disturbance hits all of them alike.
module frb_chart_timing
    use frb, only: wp, free_flow
    use frb_chart_methods, only: method, advance, constants, new_constants, family_flow, family_batch, &
        family_momentum, family_dmv
    use frb_chart_output, only: settings, progress, random_direction
    use frb_dmv, only: dmv_steps
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: workload, new_workload, time_in_turn, run, clock, threads_there

    !> A method at work: a chain of steps of one body, or steps of many bodies.
    type :: workload
        type(method) :: with
        real(wp) :: moments(3) = 1.0_wp
        real(wp) :: h = 1.0_wp
        integer :: bodies = 1
        integer :: nsteps = 1               !! steps per repetition
        integer :: threads = 1              !! of the batch form; more than one needs -fopenmp
        logical :: by_the_wall = .false.    !! measured on the wall, as several threads must be
        integer :: rounds = 1               !! times the nsteps are taken, each from the start
        type(constants) :: ready            !! of the body, formed once
        real(wp), allocatable :: m0(:, :)   !! (3, bodies)
        real(wp), allocatable :: m(:, :)
        real(wp), allocatable :: q(:, :)
    end type workload

contains

    !> Work for one body from m0, or for many with momenta of the same norm in random directions.
    function new_workload(with, moments, m0, h, bodies) result(work)
        type(method), intent(in) :: with
        real(wp), intent(in) :: moments(3), m0(3), h
        integer, intent(in) :: bodies
        type(workload) :: work
        integer(int64) :: seed
        integer :: i

        work%with = with
        work%moments = moments
        work%ready = new_constants(moments)
        work%h = h
        work%bodies = bodies
        allocate (work%m0(3, bodies), work%m(3, bodies), work%q(4, bodies))
        work%m0(:, 1) = m0
        seed = 20080215_int64
        do i = 2, bodies
            call random_direction(seed, work%m0(:, i))
            work%m0(:, i) = work%m0(:, i)*norm2(m0)
        end do
    end function new_workload

    !> Nanoseconds per body and step, ns(work, repetition). The number of steps of each work is first set so
    !> that a repetition takes about `seconds`, unless `fixed_steps`: then only the rounds are.
    subroutine time_in_turn(options, what, works, seconds, fixed_steps, ns)
        type(settings), intent(in) :: options
        character(*), intent(in) :: what
        type(workload), intent(inout) :: works(:)
        real(wp), intent(in) :: seconds
        logical, intent(in) :: fixed_steps
        real(wp), intent(out) :: ns(:, :)
        real(wp) :: took
        integer :: i, repetition, multiple

        do i = 1, size(works)
            do
                took = run(works(i))
                if (took >= seconds/4) exit
                multiple = 1 + min(15, int(seconds/max(took, 1.0e-7_wp)))
                if (fixed_steps) then
                    works(i)%rounds = works(i)%rounds*multiple
                else
                    works(i)%nsteps = works(i)%nsteps*multiple
                end if
                if (multiple == 1) exit
            end do
        end do
        do repetition = 1, size(ns, 2)
            do i = 1, size(works)
                took = run(works(i))
                ns(i, repetition) = 1.0e9_wp*took/(real(works(i)%nsteps, wp)*works(i)%rounds*works(i)%bodies)
            end do
            call progress(options, what, repetition, size(ns, 2))
        end do
    end subroutine time_in_turn

    !> Seconds one repetition takes.
    function run(work) result(seconds)
        type(workload), intent(inout) :: work
        real(wp) :: seconds
        real(wp) :: start, finish
        integer :: pass
        logical :: many

        many = work%bodies > 1 .or. work%with%family == family_batch
        seconds = 0.0_wp
        if (many) then
            work%m = work%m0
            work%q = 0.0_wp
            work%q(1, :) = 1.0_wp
        end if
        start = clock(work%by_the_wall)
        do pass = 1, work%rounds
            if (many) then
                call advance_many(work)
            else
                work%m(:, 1) = work%m0(:, 1)
                work%q(:, 1) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
                call advance(work%with, work%moments, work%h, work%nsteps, work%m(:, 1), work%q(:, 1), &
                             ready=work%ready)
            end if
        end do
        finish = clock(work%by_the_wall)
        seconds = finish - start
    end function run

    !> Seconds of processor time, which other programs on the machine do not lengthen, or seconds on the wall.
    function clock(by_the_wall) result(seconds)
        logical, intent(in) :: by_the_wall
        real(wp) :: seconds
        integer(int64) :: ticks, rate

        if (by_the_wall) then
            call system_clock(ticks, rate)
            seconds = real(ticks, wp)/real(rate, wp)
        else
            call cpu_time(seconds)
        end if
    end function clock

    !> Threads this build can use: 1 without -fopenmp.
    function threads_there() result(count)
        !$ use omp_lib, only: omp_get_num_procs
        integer :: count

        count = 1
        !$ count = omp_get_num_procs()
    end function threads_there

    !> Every body takes nsteps steps; the bodies are independent, so nothing waits for the step before.
    subroutine advance_many(work)
        !$ use omp_lib, only: omp_set_num_threads
        type(workload), intent(inout) :: work
        integer :: i, step

        !$ call omp_set_num_threads(work%threads)
        select case (work%with%family)
        case (family_batch)
            do step = 1, work%nsteps
                call free_flow(work%ready%body, work%h, work%m, work%q)
            end do
        case (family_flow)
            do step = 1, work%nsteps
                do i = 1, work%bodies
                    call free_flow(work%ready%body, work%h, work%m(:, i), work%q(:, i))
                end do
            end do
        case (family_momentum)
            do step = 1, work%nsteps
                call free_flow(work%ready%body, work%h, work%m)
            end do
        case (family_dmv)
            do step = 1, work%nsteps
                do i = 1, work%bodies
                    call dmv_steps(work%ready%rival, work%with%option, work%h, 1, work%m(:, i), work%q(:, i))
                end do
            end do
        case default
            do i = 1, work%bodies
                call advance(work%with, work%moments, work%h, work%nsteps, work%m(:, i), work%q(:, i))
            end do
        end select
    end subroutine advance_many

end module frb_chart_timing
