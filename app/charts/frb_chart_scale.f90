!> The chart `scale`: time per body against the number of bodies, one thread and two.
module frb_chart_scale
    use frb, only: wp
    use frb_chart_methods, only: method, find_method, style
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, progress, &
        quantile, say
    use frb_chart_timing, only: workload, new_workload, run, threads_there
    implicit none
    private

    public :: chart_scale

    real(wp), parameter :: moments(3) = [1.0_wp, 1.5_wp, 2.0_wp]
    real(wp), parameter :: m0(3) = [0.8_wp, 0.9_wp, 1.0_wp]
    real(wp), parameter :: h = 0.1_wp

    !> The curves: method, and number of threads.
    character(*), parameter :: keys(*) = [character(12) :: 'flow', 'flow-batch', 'flow-batch', 'flow-m', &
        'dmv2', 'dmv10']
    integer, parameter :: threads(*) = [1, 1, 2, 1, 1, 1]
    integer, parameter :: curves = size(keys)

    !> Fewer bodies than this are not shared between threads.
    integer, parameter :: fewest_for_threads = 1000

contains

    subroutine chart_scale(options)
        type(settings), intent(in) :: options
        real(wp), allocatable :: ns(:, :, :)
        logical :: two

        two = threads_there() > 1
        if (.not. two) call say('  one thread only: build with --flag "-fopenmp" for two')
        allocate (ns(merge(5, 7, options%quick), curves, merge(6, 8, options%quick)), source=0.0_wp)
        call measure(options, two, ns)
        call write_scale(options, two, ns)
        call draw_scale(options, two)
    end subroutine chart_scale

    !> Whether a curve has a point at a number of bodies.
    pure function is_measured(curve, bodies, two) result(yes)
        integer, intent(in) :: curve, bodies
        logical, intent(in) :: two
        logical :: yes

        yes = threads(curve) == 1 .or. (two .and. bodies >= fewest_for_threads)
    end function is_measured

    !> Times for 1, 10, 100, ... bodies; the curves take turns in every repetition.
    subroutine measure(options, two, ns)
        type(settings), intent(in) :: options
        logical, intent(in) :: two
        real(wp), intent(inout) :: ns(:, :, :)  !! (repetition, curve, power of ten) [ns]
        type(workload) :: work
        integer :: steps(curves), i, k, n, r

        do k = 1, size(ns, 3)
            n = 10**(k - 1)
            work = new_workload(find_method('flow'), moments, m0, h, n)
            ! The wall clock with threads: processor time would count threads that wait for work.
            work%by_the_wall = two
            do i = 1, curves
                if (.not. is_measured(i, n, two)) cycle
                call choose_curve(i)
                work%nsteps = 1
                do
                    if (run(work) > merge(0.5e-3_wp, 2.0e-3_wp, options%quick)) exit
                    work%nsteps = work%nsteps*2
                end do
                steps(i) = work%nsteps
            end do
            do r = 1, size(ns, 1)
                do i = 1, curves
                    if (.not. is_measured(i, n, two)) cycle
                    call choose_curve(i)
                    work%nsteps = steps(i)
                    ns(r, i, k) = 1.0e9_wp*run(work)/(real(steps(i), wp)*n)
                end do
                call progress(options, 'scale', (k - 1)*size(ns, 1) + r, size(ns, 3)*size(ns, 1))
            end do
        end do

    contains

        subroutine choose_curve(curve)
            integer, intent(in) :: curve

            work%with = find_method(trim(keys(curve)))
            work%threads = threads(curve)
        end subroutine choose_curve

    end subroutine measure

    !> The table: a block for each curve.
    subroutine write_scale(options, two, ns)
        type(settings), intent(in) :: options
        logical, intent(in) :: two
        real(wp), intent(in) :: ns(:, :, :)
        type(chart_file) :: file
        integer :: i, k

        call open_table(options, 'scale', &
            'time per body and step against the number of bodies, h = 0.1; a block '// &
            'per method', 'bodies, ns per body and step: median, quartiles', file)
        do i = 1, curves
            write (file%line, '(a,i0,a)') '# method: '//trim(keys(i))//', ', threads(i), ' thread(s)'
            call file%put()
            do k = 1, size(ns, 3)
                if (is_measured(i, 10**(k - 1), two)) then
                    write (file%line, '(i9,3f10.2)') 10**(k - 1), quantile(ns(:, i, k), 0.5_wp), &
                        quantile(ns(:, i, k), 0.25_wp), quantile(ns(:, i, k), 0.75_wp)
                    call file%put()
                else if (k == 1) then
                    call file%put('NaN NaN NaN NaN')
                end if
            end do
            call file%end_block()
        end do
        if (two) then
            write (file%line, '(a,f6.3)') '# one thread / two threads at the largest number: ', &
                quantile(ns(:, 2, size(ns, 3))/ns(:, 3, size(ns, 3)), 0.5_wp)
            call file%put()
        end if
        call file%finish()
    end subroutine write_scale

    subroutine draw_scale(options, two)
        type(settings), intent(in) :: options
        logical, intent(in) :: two
        type(method) :: with
        character(:), allocatable :: label
        type(chart_file) :: file
        integer :: i

        call open_script(options, 'scale', 900, 520, file)
        call file%put_lines([character(width) :: &
            'set logscale xy', 'set format x "10^{%T}"', 'set xrange [0.7:1.5e7]', 'set yrange [3:1000]', &
            'set xlabel "number of bodies"', 'set ylabel "time per body and step  [ns]"', &
            'set title "Many bodies, h = 0.1"', &
            'set key outside right center vertical samplen 2.2 Left reverse', 'plot \'])
        do i = 1, curves
            if (threads(i) > 1 .and. .not. two) cycle
            with = find_method(trim(keys(i)))
            label = trim(with%label)
            if (threads(i) > 1) then
                label = label//', 2 threads'
                with%symbol = 4
                with%dash = 3
            end if
            write (file%line, '(a,i0,a)') '  "scale.dat" index ', i - 1, ' using 1:2'//style(with, label)// &
                ', \'
            call file%put()
        end do
        call file%put('  NaN notitle')
        call file%finish()
        call draw(options, 'scale')
    end subroutine draw_scale

end module frb_chart_scale
