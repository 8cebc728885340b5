!> The charts of speed alone: `cost` (the paper's figure 6 made again) and `speed` (the table of ratios).
module frb_chart_cost
    use frb, only: wp
    use frb_chart_methods, only: method, catalogue, find_method, style, family_dmv, family_batch
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, say, quantile
    use frb_chart_timing, only: workload, new_workload, time_over_steps
    use frb_chart_truth, only: new_case, errors_of
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: chart_cost, chart_speed, measure_cost

    !> A body of order one that turns at 1 rad per unit of time, so that h is h omega.
    real(wp), parameter :: moments(3) = [1.0_wp, 1.5_wp, 2.0_wp]
    real(wp), parameter :: direction(3) = [0.5_wp, 0.6_wp, 0.7_wp]
    real(wp), parameter :: start(3) = direction/sqrt(direction(1)**2/moments(1)**2 &
        + direction(2)**2/moments(2)**2 + direction(3)**2/moments(3)**2)

contains

    !> Time per step against h, relative to the cheapest discrete Moser-Veselov method.
    subroutine chart_cost(options)
        type(settings), intent(in) :: options
        type(method), allocatable :: methods(:)
        real(wp), allocatable :: table(:, :, :)
        type(chart_file) :: file
        integer :: i, k

        allocate (methods, source=catalogue())
        call measure_cost(options, 'cost', methods, table)
        call open_table(options, 'cost', 'time per step against step size; a block per method', &
                        'h*omega, ns per step: median, quartiles, relative to the cheapest dmv: '// &
                        'median, quartiles', file)
        do i = 1, size(methods)
            call file%put('# method: '//trim(methods(i)%key))
            do k = 1, size(table, 3)
                write (file%line, '(es12.4,3f12.2,3f10.4)') table(:, i, k)
                call file%put()
            end do
            call file%end_block()
        end do
        call file%finish()
        call draw_cost(options, methods)
    end subroutine chart_cost

    !> The numbers of the chart, table(column, method, step).
    subroutine measure_cost(options, what, methods, table)
        type(settings), intent(in) :: options
        character(*), intent(in) :: what        !! name of the measurement, for the progress on the terminal
        type(method), intent(in) :: methods(:)
        real(wp), allocatable, intent(out) :: table(:, :, :)
        type(workload), allocatable :: works(:)
        real(wp), allocatable :: steps(:), ns(:, :, :)
        integer :: i, k

        allocate (steps, source=[(10.0_wp**(merge(k/1.0_wp, k/3.0_wp, options%quick) - 3), &
                                  k=0, merge(4, 12, options%quick))])
        allocate (works(size(methods)), ns(size(methods), size(steps), merge(3, 9, options%quick)))
        do i = 1, size(methods)
            works(i) = new_workload(methods(i), moments, start, 1.0_wp, &
                                    merge(1000, 1, methods(i)%family == family_batch))
        end do
        call time_over_steps(options, what, works, steps, merge(1.0e-3_wp, 2.0e-3_wp, options%quick), &
                             merge(3, 20, options%quick), ns)
        allocate (table(7, size(methods), size(steps)))
        do k = 1, size(steps)
            call summarise(methods, ns(:, k, :), table(:, :, k))
            table(1, :, k) = steps(k)
        end do
    end subroutine measure_cost

    !> Medians and quartiles of the times and of their ratio to the cheapest rival of the same repetition.
    subroutine summarise(methods, ns, rows)
        type(method), intent(in) :: methods(:)
        real(wp), intent(in) :: ns(:, :)
        real(wp), intent(out) :: rows(:, :)
        real(wp) :: cheapest(size(ns, 2))
        integer :: i

        cheapest = minval(ns, dim=1, mask=spread(methods%family == family_dmv, 2, size(ns, 2)))
        do i = 1, size(methods)
            rows(2:4, i) = [quantile(ns(i, :), 0.5_wp), quantile(ns(i, :), 0.25_wp), quantile(ns(i, :), &
                0.75_wp)]
            rows(5:7, i) = [quantile(ns(i, :)/cheapest, 0.5_wp), quantile(ns(i, :)/cheapest, 0.25_wp), &
                            quantile(ns(i, :)/cheapest, 0.75_wp)]
        end do
    end subroutine summarise

    subroutine draw_cost(options, methods)
        type(settings), intent(in) :: options
        type(method), intent(in) :: methods(:)
        character(*), parameter :: shown(*) = [character(12) :: 'flow', 'flow-batch', 'flow-m', 'flow-a', &
            'quat_step', 'frb_step', 'quat_step-2', 'frb_step-2', 'theta', &
            'hermite', 'dmv2', 'dmv6', 'dmv10', &
            'rotations2', 'rotations4', 'rk4', 'dp-6', 'dp-12']
        type(chart_file) :: file
        integer :: i, j

        call open_script(options, 'cost', 900, 620, file)
        call file%put_lines([character(width) :: 'set logscale xy', 'set format x "10^{%T}"', &
            'set xlabel "step size h ω  [rad]"', &
            'set ylabel "time per step / cheapest discrete Moser-Veselov"', &
            'set key outside right center vertical spacing 1.15 samplen 2.2 Left reverse', &
            'set title "Cost of one step, its accuracy aside"', &
            'set label "Moser-Veselov\ndoes not\nconverge" at 3.6,75 center textcolor rgb '// &
            '"#0072B2"', &
            'set object 1 rectangle from 1.3,0.03 to 10,100 behind fillstyle solid noborder '// &
            'fillcolor rgb "#eef3f8"', 'set yrange [0.03:100]', 'set xrange [0.001:10]', &
            'set arrow 1 from graph 0, first 1 to graph 1, first 1 nohead lc rgb "#666666" dt 3', 'plot \'])
        do j = 1, size(shown)
            do i = 1, size(methods)
                if (methods(i)%key /= shown(j)) cycle
                write (file%line, '(a,i0,a)') '  "cost.dat" index ', i - 1, ' using 1:5'// &
                    style(methods(i))//', \'
                call file%put()
            end do
        end do
        call file%put('  NaN notitle')
        call file%finish()
        call draw(options, 'cost')
    end subroutine draw_cost

    !> The table of ratios that the speed of the free flow is judged by.
    subroutine chart_speed(options)
        type(settings), intent(in) :: options
        character(*), parameter :: names(*) = [character(12) :: 'dmv2', 'dmv4', 'dmv6', 'dmv8', 'dmv10', &
            'flow', &
            'flow-m', 'flow-batch', 'flow-batch', 'flow-m', 'dmv2', 'dmv10', 'flow', 'frb_step', 'quat_step']
        integer, parameter :: bodies(*) = [1, 1, 1, 1, 1, 1, 1, 1000, 1000000, 1000, 1000, 1000, 1000, 1, 1]
        real(wp), parameter :: all_steps(*) = [0.001_wp, 0.003_wp, 0.01_wp, 0.03_wp, 0.1_wp, 0.3_wp, 1.0_wp, &
            3.0_wp, 10.0_wp]
        type(workload), allocatable :: works(:)
        real(wp), allocatable :: steps(:), ns(:, :, :), ratios(:, :)
        character(200) :: line
        real(wp) :: error_m, error_q, width
        type(chart_file) :: file
        integer :: i, k

        allocate (steps, source=all_steps(::merge(2, 1, options%quick)))
        allocate (works(size(names)), ns(size(names), size(steps), merge(3, 9, options%quick)))
        allocate (ratios(size(ns, 3), 9))
        do i = 1, size(names)
            works(i) = new_workload(find_method(trim(names(i))), moments, start, 1.0_wp, bodies(i))
        end do
        call open_table(options, 'speed', &
            'ratios of times per body and step: the median over the repetitions', &
            'h*omega, dmv2 [ns], dmv10 [ns], free flow [ns], flow/dmv10, flow/dmv2, momentum only/dmv10, '// &
            'batch of 1000/cheapest dmv, batch of 1e6/cheapest dmv, batch of 1000/dmv2 over 1000 bodies, '// &
            'scalar flow over 1000 bodies/dmv10 over 1000 bodies, frb_step/flow, quat_step/flow, '// &
            'error of one step of dmv10 [rad] (it does not converge for long steps), spread: the largest '// &
            'distance of the quartiles of a ratio of the row, over its median', file)
        call say('ratios; "1000" and "1e6": so many bodies; dmv: the cheapest order for one body')
        call say(' h omega   dmv2  dmv10   flow flow/dmv10 flow/dmv2  m/dmv10  1000/dmv   1e6/dmv  '// &
            '1000/1000  1000/1000  frb_step quat_step     dmv10  spread')
        call say('             ns     ns     ns                                batch/    batch/   '// &
            'batch/dmv2 flow/dmv10    /flow     /flow     error')
        call time_over_steps(options, 'speed', works, steps, 2.0e-3_wp, merge(2, 10, options%quick), ns)
        do k = 1, size(steps)
            call errors_of(find_method('dmv10'), new_case(moments, start, steps(k)), 1, error_m, error_q)
            if (error_q > 1.0e10_wp) error_q = ieee_value(error_q, ieee_quiet_nan)
            associate (dmv2 => ns(1, k, :), dmv10 => ns(5, k, :), flow => ns(6, k, :), &
                       cheapest => minval(ns(1:5, k, :), dim=1))
                ratios(:, 1) = flow/dmv10
                ratios(:, 2) = flow/dmv2
                ratios(:, 3) = ns(7, k, :)/dmv10
                ratios(:, 4) = ns(8, k, :)/cheapest
                ratios(:, 5) = ns(9, k, :)/cheapest
                ratios(:, 6) = ns(8, k, :)/ns(11, k, :)
                ratios(:, 7) = ns(13, k, :)/ns(12, k, :)
                ratios(:, 8) = ns(14, k, :)/flow
                ratios(:, 9) = ns(15, k, :)/flow
                width = maxval([((quantile(ratios(:, i), 0.75_wp) - quantile(ratios(:, i), 0.25_wp)) &
                                  /middle(ratios(:, i)), i=1, 9)])
                write (line, '(es9.1,3f7.1,9f10.3,es10.1,f8.3)') steps(k), middle(dmv2), middle(dmv10), &
                    middle(flow), (middle(ratios(:, i)), i=1, 9), error_q, width
            end associate
            call file%put(trim(line))
            call say(trim(line))
        end do
        call file%finish()
        call table_of_long_steps(options)
    end subroutine chart_speed

    !> Time of one step of any length, and its ratio to the time of a step of 1 rad in the same run.
    subroutine table_of_long_steps(options)
        type(settings), intent(in) :: options
        real(wp), parameter :: all_steps(*) = [0.001_wp, 0.1_wp, 1.0_wp, 10.0_wp, 1.0e2_wp, 1.0e3_wp, &
            1.0e4_wp, 1.0e5_wp, 1.0e6_wp]
        type(workload) :: works(2)
        real(wp), allocatable :: steps(:), ns(:, :, :)
        character(120) :: line
        type(chart_file) :: file
        integer :: k

        allocate (steps, source=all_steps(::merge(2, 1, options%quick)))
        allocate (ns(2, size(steps), merge(3, 9, options%quick)))
        works(1) = new_workload(find_method('flow'), moments, start, 1.0_wp, 1)
        works(2) = new_workload(find_method('flow-m'), moments, start, 1.0_wp, 1)
        call open_table(options, 'long-steps', &
                        'time of one step of the free flow: median over the repetitions', &
                        'h*omega, quaternion [ns], momentum only [ns], quaternion/that of 1 rad, '// &
                        'momentum only/that of 1 rad', file)
        call say(' h omega     q ns     m ns  q/1 rad  m/1 rad')
        call time_over_steps(options, 'long-steps', works, steps, 2.0e-3_wp, merge(2, 10, options%quick), ns)
        associate (radian => ns(:, minloc(abs(steps - 1.0_wp), dim=1), :))
            do k = 1, size(steps)
                write (line, '(es9.1,2f9.1,2f9.2)') steps(k), middle(ns(1, k, :)), middle(ns(2, k, :)), &
                    middle(ns(1, k, :)/radian(1, :)), middle(ns(2, k, :)/radian(2, :))
                call file%put(trim(line))
                call say(trim(line))
            end do
        end associate
        call file%finish()
    end subroutine table_of_long_steps

    pure function middle(values) result(median)
        real(wp), intent(in) :: values(:)
        real(wp) :: median

        median = quantile(values, 0.5_wp)
    end function middle

end module frb_chart_cost
