!> The stopwatch of the charts: all methods in one process and in turn, so that a disturbance hits all of them
!> and all their repetitions alike.
module frb_chart_timing
    use frb, only: wp, free_flow
    use frb_chart_methods, only: method, advance, constants, new_constants, family_flow, family_batch, &
        family_momentum, family_dmv
    use frb_chart_output, only: settings, progress, random_direction
    use frb_dmv, only: dmv_steps
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: workload, new_workload, time_in_turn, time_over_steps, run, clock, threads_there

    !> A method at work: a chain of steps of one body, or steps of many bodies.
    type :: workload
        type(method) :: with
        real(wp) :: moments(3) = 1.0_wp
        real(wp) :: h = 1.0_wp
        integer :: bodies = 1
        integer :: nsteps = 1               !! steps per round
        integer :: threads = 1              !! of the batch form; more than one needs -fopenmp
        logical :: by_the_wall = .false.    !! measured by the wall clock, as needed for several threads
        integer :: rounds = 1               !! how often the nsteps are taken, each time from the start
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

    !> Nanoseconds per body and step, ns(work, repetition). A repetition is cut into slices of `seconds`, and
    !> the slices of all works and repetitions take turns. So each repetition is spread over the whole run:
    !> another program on the processor, for a tenth of a second or half a minute, slows all points alike.
    subroutine time_in_turn(options, what, works, seconds, slices, ns)
        type(settings), intent(in) :: options
        character(*), intent(in) :: what
        type(workload), intent(inout) :: works(:)
        real(wp), intent(in) :: seconds
        integer, intent(in) :: slices
        real(wp), intent(out) :: ns(:, :)
        integer :: i, slice, repetition, turn

        do i = 1, size(works)
            call lengthen(works(i), seconds, .true.)
        end do
        ns = 0.0_wp
        turn = 0
        do slice = 1, slices
            do repetition = 1, size(ns, 2)
                turn = turn + 1
                do i = 1, size(works)
                    ns(i, repetition) = ns(i, repetition) + nanoseconds(works(i), turn)/slices
                end do
                call progress(options, what, turn, slices*size(ns, 2))
            end do
        end do
    end subroutine time_in_turn

    !> As `time_in_turn`, for several sizes h of the step, ns(work, h, repetition); a slice is one chain.
    subroutine time_over_steps(options, what, works, h, seconds, slices, ns)
        type(settings), intent(in) :: options
        character(*), intent(in) :: what
        type(workload), intent(inout) :: works(:)
        real(wp), intent(in) :: h(:)
        real(wp), intent(in) :: seconds
        integer, intent(in) :: slices
        real(wp), intent(out) :: ns(:, :, :)
        integer :: nsteps(size(works), size(h))
        integer :: i, k, slice, repetition, turn

        do k = 1, size(h)
            do i = 1, size(works)
                works(i)%h = h(k)
                works(i)%nsteps = 1
                call lengthen(works(i), seconds, .false.)
                nsteps(i, k) = works(i)%nsteps
            end do
        end do
        ns = 0.0_wp
        turn = 0
        do slice = 1, slices
            do repetition = 1, size(ns, 3)
                turn = turn + 1
                do k = 1, size(h)
                    do i = 1, size(works)
                        works(i)%h = h(k)
                        works(i)%nsteps = nsteps(i, k)
                        ns(i, k, repetition) = ns(i, k, repetition) + nanoseconds(works(i), turn)/slices
                    end do
                end do
                call progress(options, what, turn, slices*size(ns, 3))
            end do
        end do
    end subroutine time_over_steps

    !> Raises the number of rounds, or of steps, until the work takes about `seconds`.
    subroutine lengthen(work, seconds, by_rounds)
        type(workload), intent(inout) :: work
        real(wp), intent(in) :: seconds
        logical, intent(in) :: by_rounds
        real(wp) :: took
        integer :: multiple

        do
            took = run(work)
            if (took >= seconds/4) exit
            multiple = 1 + min(15, int(seconds/max(took, 1.0e-7_wp)))
            if (by_rounds) then
                work%rounds = work%rounds*multiple
            else
                work%nsteps = work%nsteps*multiple
            end if
            if (multiple == 1) exit
        end do
    end subroutine lengthen

    !> Time of one slice, per body and step; every turn has the stack at another place.
    function nanoseconds(work, turn) result(ns)
        type(workload), intent(inout) :: work
        integer, intent(in) :: turn
        real(wp) :: ns
        integer, parameter :: places = 64

        ns = 1.0e9_wp*run_below(work, mod(turn, places))/(real(work%nsteps, wp)*work%rounds*work%bodies)
    end function nanoseconds

    !> `run` with the stack `pages` pages further down. The place of the working storage of a batch changes
    !> its time by up to 15 %, and one process would keep one place: an average over many places is fair.
    recursive function run_below(work, pages) result(seconds)
        type(workload), intent(inout) :: work
        integer, intent(in) :: pages
        real(wp) :: seconds
        real(wp), volatile :: page(512)     ! volatile and set after the call: else the compiler removes it

        if (pages > 0) then
            seconds = run_below(work, pages - 1)
        else
            seconds = run(work)
        end if
        page(1) = seconds
    end function run_below

    !> Time of all rounds [s].
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

    !> Processor time [s], which other programs on the machine do not lengthen, or time of the wall clock.
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

    !> Every body takes nsteps steps. In each step all bodies move: no step waits for the one before.
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
