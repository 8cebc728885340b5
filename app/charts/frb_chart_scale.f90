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

contains

    subroutine chart_scale(options)
        type(settings), intent(in) :: options
        character(*), parameter :: keys(*) = [character(12) :: 'flow', 'flow-batch', 'flow-batch', 'flow-m', &
            'dmv2', 'dmv10']
        integer, parameter :: threads(*) = [1, 1, 2, 1, 1, 1]
        integer, parameter :: curves = size(keys)
        type(workload) :: work
        real(wp), allocatable :: ns(:, :, :)
        integer, allocatable :: steps(:)
        type(chart_file) :: file
        integer :: counts, repetitions, i, k, n, r
        logical :: two

        two = threads_there() > 1
        if (.not. two) call say('  one thread only: build with --flag "-fopenmp" for two')
        counts = merge(6, 8, options%quick)
        repetitions = merge(5, 7, options%quick)
        allocate (ns(repetitions, curves, counts), steps(curves))
        ns = 0.0_wp
        do k = 1, counts
            n = 10**(k - 1)
            work = new_workload(find_method('flow'), moments, m0, h, n)
            ! The wall clock with threads: processor time would count threads that wait for work.
            work%by_the_wall = two
            do i = 1, curves
                if (threads(i) > 1 .and. (.not. two .or. n < 1000)) cycle
                call choose_curve(i)
                work%nsteps = 1
                do
                    if (run(work) > merge(0.5e-3_wp, 2.0e-3_wp, options%quick)) exit
                    work%nsteps = work%nsteps*2
                end do
                steps(i) = work%nsteps
            end do
            do r = 1, repetitions
                do i = 1, curves
                    if (threads(i) > 1 .and. (.not. two .or. n < 1000)) cycle
                    call choose_curve(i)
                    work%nsteps = steps(i)
                    ns(r, i, k) = 1.0e9_wp*run(work)/(real(steps(i), wp)*n)
                end do
                call progress(options, 'scale', (k - 1)*repetitions + r, counts*repetitions)
            end do
        end do
        call open_table(options, 'scale', &
            'time per body and step against the number of bodies, h = 0.1; a block '// &
            'per method', 'bodies, ns per body and step: median, quartiles', file)
        do i = 1, curves
            write (file%line, '(a,i0,a)') '# method: '//trim(keys(i))//', ', threads(i), ' thread(s)'
            call file%put()
            do k = 1, counts
                if (threads(i) > 1 .and. (.not. two .or. k <= 3)) then
                    if (k == 1) call file%put('NaN NaN NaN NaN')
                    cycle
                end if
                write (file%line, '(i9,3f10.2)') 10**(k - 1), quantile(ns(:, i, k), 0.5_wp), &
                    quantile(ns(:, i, &
                    k), 0.25_wp), quantile(ns(:, i, k), 0.75_wp)
                call file%put()
            end do
            call file%end_block()
        end do
        if (two) then
            write (file%line, '(a,f6.3)') '# one thread / two threads at the largest number: ', &
                quantile(ns(:, 2, counts)/ns(:, 3, counts), 0.5_wp)
            call file%put()
        end if
        call file%finish()
        call draw_scale()

    contains

        subroutine choose_curve(curve)
            integer, intent(in) :: curve

            work%with = find_method(trim(keys(curve)))
            work%threads = threads(curve)
        end subroutine choose_curve

        subroutine draw_scale()
            type(method) :: with
            character(:), allocatable :: label

            call open_script(options, 'scale', 900, 520, file)
            call file%put_lines([character(width) :: &
                'set logscale xy', 'set format x "10^{%T}"', 'set xrange [0.7:1.5e7]', &
                'set yrange [3:1000]', &
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
                write (file%line, '(a,i0,a)') '  "scale.dat" index ', i - 1, ' using 1:2'//style(with, &
                    label)// &
                    ', \'
                call file%put()
            end do
            call file%put('  NaN notitle')
            call file%finish()
            call draw(options, 'scale')
        end subroutine draw_scale

    end subroutine chart_scale

end module frb_chart_scale
