!> The charts of error against work: `work-precision` (error at t = 10 against the time spent) and `growth`
!> (error against the number of steps the same time is cut into).
module frb_chart_precision
    use frb, only: wp
    use frb_chart_methods, only: method, methods_without, style, family_flow, family_batch, &
        family_momentum, family_matrix, family_dp, family_paper_a, family_paper_q
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, progress, &
        either, quantile, uniform, random_direction
    use frb_chart_timing, only: workload, new_workload, time_in_turn
    use frb_chart_truth, only: free_case, new_case, errors_of
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: chart_work_precision, chart_growth

    !> Smallest error drawn: a result that is right to the last bit has the error 0.
    real(wp), parameter :: floor_of_errors = 1.0e-17_wp

    type :: point
        real(wp) :: setting = 0.0_wp        !! number of steps, or the tolerance
        real(wp) :: ns(3) = 0.0_wp          !! time to t = 10 [ns]: median, quartiles
        real(wp) :: error_m = 0.0_wp
        real(wp) :: error_q = 0.0_wp
    end type point

contains

    !> Error of the attitude at t = 10 against the time spent on getting there, three bodies.
    subroutine chart_work_precision(options)
        type(settings), intent(in) :: options
        real(wp), parameter :: bodies(3, 3) = reshape([0.92_wp, 0.96_wp, 1.0_wp, 0.345_wp, 0.653_wp, 1.0_wp, &
                                                       0.05_wp, 0.97_wp, 1.0_wp], [3, 3])
        character(*), parameter :: names(3) = [character(9) :: 'round', 'flat', 'elongated']
        real(wp), parameter :: m0(3) = [1.8_wp, 0.4_wp, -0.9_wp]
        type(method), allocatable :: methods(:)
        type(point), allocatable :: points(:, :)
        integer, allocatable :: counts(:)
        type(chart_file) :: file
        integer :: b

        allocate (methods, source=curves())
        allocate (points(16, size(methods)), counts(size(methods)))
        do b = 1, 3
            call measure(options, methods, new_case(bodies(:, b), m0, 10.0_wp), points, counts)
            call open_table(options, 'work-precision-'//trim(names(b)), &
                'errors at t = 10 against the time to get there, from m = (1.8, 0.4, -0.9); a block '// &
                'per method, '// &
                'last the envelope', 'number of steps or tolerance; time [ns]: median, quartiles; '// &
                'error of attitude [rad]; error of momentum', file)
            write (file%line, '(a,3f8.4)') '# moments:', bodies(:, b)
            call file%put()
            call write_points(file, methods, points, counts)
            call file%finish()
        end do
        call draw_work_precision(options, methods, names, bodies)
    end subroutine chart_work_precision

    !> The methods of these charts; the tolerances of the adaptive method make one curve.
    function curves() result(chosen)
        type(method), allocatable :: chosen(:)
        integer :: i

        allocate (chosen, source=methods_without([family_momentum, family_matrix], ['dp-12']))
        do i = 1, size(chosen)
            if (chosen(i)%family == family_dp) then
                chosen(i)%key = 'dp'
                chosen(i)%label = 'DoPri 8(5,3)'
            end if
        end do
    end function curves

    !> The methods that are drawn; the others, whose curves lie on top of these, are in the tables only.
    elemental function drawn(with) result(yes)
        type(method), intent(in) :: with
        logical :: yes

        yes = .true.
        if (with%family == family_paper_a) yes = with%points == 0
        if (with%family == family_paper_q) yes = with%option == 1
    end function drawn

    !> Times and errors of every method at every number of steps.
    subroutine measure(options, methods, item, points, counts)
        type(settings), intent(in) :: options
        type(method), intent(in) :: methods(:)
        type(free_case), intent(in) :: item
        type(point), intent(out) :: points(:, :)
        integer, intent(out) :: counts(:)
        type(workload), allocatable :: works(:)
        real(wp), allocatable :: ns(:, :)
        type(method) :: with
        integer :: i, k, n, total, steps

        total = 0
        allocate (works(size(points)))
        do i = 1, size(methods)
            with = methods(i)
            counts(i) = 14
            if (with%exact) counts(i) = 4
            if (with%family == family_flow) counts(i) = 5
            if (with%family == family_batch) counts(i) = 3
            if (with%points > 0) counts(i) = 11
            if (options%quick) counts(i) = (counts(i) + 1)/2
            do k = 1, counts(i)
                n = merge(2*k - 1, k, options%quick)
                steps = 5*2**(n - 1)
                if (with%exact) steps = 10**(n - 1)
                if (with%points > 0) steps = 2**(n - 1)
                points(k, i)%setting = steps
                if (with%family == family_dp) then
                    steps = 1
                    with%tolerance = 10.0_wp**(-2 - n)
                    points(k, i)%setting = with%tolerance
                end if
                total = total + 1
                works(total) = new_workload(with, item%moments, item%m0, item%t/steps, &
                                            merge(1000, 1, with%family == family_batch))
                works(total)%nsteps = steps
                call errors_of(with, item, steps, points(k, i)%error_m, points(k, i)%error_q)
            end do
        end do
        allocate (ns(total, merge(5, 9, options%quick)))
        call time_in_turn(options, 'work-precision', works(:total), merge(0.5e-3_wp, 2.0e-3_wp, &
            options%quick), merge(1, 4, options%quick), ns)
        total = 0
        do i = 1, size(methods)
            do k = 1, counts(i)
                total = total + 1
                points(k, i)%ns = works(total)%nsteps*[quantile(ns(total, :), 0.5_wp), &
                    quantile(ns(total, :), 0.25_wp), quantile(ns(total, :), 0.75_wp)]
            end do
        end do
    end subroutine measure

    !> The blocks of a table, and at its end the envelope: points that no other point beats in time and error.
    subroutine write_points(file, methods, points, counts)
        type(chart_file), intent(inout) :: file
        type(method), intent(in) :: methods(:)
        type(point), intent(in) :: points(:, :)
        integer, intent(in) :: counts(:)
        real(wp) :: best_error, time, last_time
        integer :: i, k, place(2)

        do i = 1, size(methods)
            call file%put('# method: '//trim(methods(i)%key))
            do k = 1, counts(i)
                write (file%line, '(es10.2,3es13.4,2es12.3)') points(k, i)%setting, points(k, i)%ns, &
                    max(floor_of_errors, points(k, i)%error_q), max(floor_of_errors, points(k, i)%error_m)
                call file%put()
            end do
            call file%end_block()
        end do
        call file%put('# envelope: time [ns], error of attitude [rad], method')
        best_error = 1.0e3_wp
        last_time = 0.0_wp
        do
            time = huge(1.0_wp)
            place = 0
            do i = 1, size(methods)
                do k = 1, counts(i)
                    if (points(k, i)%ns(1) < time .and. points(k, i)%ns(1) >= last_time .and. &
                        max(floor_of_errors, points(k, i)%error_q) < best_error) then
                        time = points(k, i)%ns(1)
                        place = [k, i]
                    end if
                end do
            end do
            if (place(1) == 0) exit
            if (last_time <= 0.0_wp) then
                write (file%line, '(2es13.4,a)') time, best_error, ' top'
                call file%put()
            end if
            best_error = max(floor_of_errors, points(place(1), place(2))%error_q)
            last_time = time
            write (file%line, '(2es13.4,1x,a)') time, best_error, trim(methods(place(2))%key)
            call file%put()
        end do
        write (file%line, '(2es13.4,a)') 1.0e9_wp, best_error, ' right'
        call file%put()
    end subroutine write_points

    subroutine draw_work_precision(options, methods, names, bodies)
        type(settings), intent(in) :: options
        type(method), intent(in) :: methods(:)
        character(*), intent(in) :: names(:)
        real(wp), intent(in) :: bodies(:, :)
        character(60) :: title
        type(chart_file) :: file
        integer :: b, i

        call open_script(options, 'work-precision', 1000, 940, file)
        call file%put_lines([character(width) :: &
            'set multiplot', 'set logscale xy', 'set format x "10^{%T}"', &
            'set format y "10^{%T}"', &
            'set yrange [1e-16:30]', 'set xrange [10:5e6]', 'set ytics 1e-16,1e2', 'set mytics 1', &
            'set xlabel "time spent to reach t = 10  [ns]" offset 0,0.4', &
            'unset key', 'set lmargin 0; set rmargin 0; set tmargin 0; set bmargin 0'])
        do b = 1, size(names)
            write (title, '(a,2(f5.3,a),f5.3,a)') ': I = (', bodies(1, b), ', ', bodies(2, b), ', ', &
                bodies(3, b), ')'
            call file%put('set title "'//trim(names(b))//' body'//trim(title)//'" offset 0,-0.6')
            write (file%line, '(a,f5.3,a,f5.3)') 'set origin ', merge(0.08, 0.57, mod(b, 2) == 1), ',', &
                merge(0.56, 0.06, b < 3)
            call file%put()
            call file%put(either(mod(b, 2) == 1, 'set ylabel "error of attitude  [rad]" offset 2.5,0', &
                                 'unset ylabel'))
            call file%put_lines([character(width) :: 'set size 0.40,0.40', 'plot \'])
            write (file%line, '(a,i0,a)') '  "work-precision-'//trim(names(b))//'.dat" index ', &
                size(methods), &
                ' using 1:2 with steps lc rgb "#dddddd" lw 10 notitle, \'
            call file%put()
            do i = size(methods), 1, -1
                if (.not. drawn(methods(i))) cycle
                write (file%line, '(a,i0,a)') '  "work-precision-'//trim(names(b))//'.dat" index ', i - 1, &
                    ' using 2:5'//style(methods(i), '')//either(i == 1, '', ', \')
                call file%put()
            end do
        end do
        call file%put_lines([character(width) :: &
            'set origin 0.53,0.05', 'set size 0.47,0.45', 'unset border', 'unset tics', &
            'unset xlabel', &
            'unset ylabel', 'unset title', 'unset grid', 'unset logscale', 'set xrange [0:1]', &
            'set yrange [0:1]', &
            'set key center center maxrows 12 samplen 2.2 spacing 1.1 Left reverse', 'plot \', &
            '  NaN with lines lc rgb "#dddddd" lw 10 title "best of all methods", \'])
        do i = 1, size(methods)
            if (.not. drawn(methods(i))) cycle
            call file%put('  NaN'//style(methods(i))//either(i == size(methods), '', ', \'))
        end do
        call file%put('unset multiplot')
        call file%finish()
        call draw(options, 'work-precision')
    end subroutine draw_work_precision

    !> Error of the attitude after a fixed time against the number of steps: median over bodies.
    subroutine chart_growth(options)
        type(settings), intent(in) :: options
        real(wp), parameter :: duration = 16.0_wp
        type(method), allocatable :: methods(:)
        type(free_case), allocatable :: cases(:)
        real(wp), allocatable :: errors(:, :)
        real(wp) :: moments(3), m0(3), x
        integer(int64) :: seed
        type(chart_file) :: file
        integer :: b, i, k, n, most

        allocate (methods, source=pack(curves(), drawn(curves())))
        allocate (cases(merge(5, 9, options%quick)))
        allocate (errors(2, size(cases)))
        seed = 6021023_int64
        do b = 1, size(cases)
            moments(3) = 1.0_wp
            call uniform(seed, x)
            moments(2) = 0.5_wp + 0.45_wp*x
            call uniform(seed, x)
            moments(1) = (1 - moments(2)) + x*(2*moments(2) - 1)
            call random_direction(seed, m0)
            cases(b) = new_case(moments, m0*0.5_wp, duration)
        end do
        most = merge(6, 12, options%quick)
        call open_table(options, 'growth', &
            'errors at t = 16 against the number of steps, |m| = 1/2, median and '// &
            'largest over 9 bodies (5 with --quick); a block per method', &
            'steps, error of attitude [rad]: median, '//'largest; error of momentum: median, largest', file)
        do i = 1, size(methods)
            if (left_out(methods(i))) cycle
            call file%put('# method: '//trim(methods(i)%key))
            do k = 0, most
                n = nint(10.0_wp**(0.5_wp*k))
                do b = 1, size(cases)
                    call errors_of(methods(i), cases(b), n, errors(1, b), errors(2, b))
                end do
                write (file%line, '(i8,4es12.3)') n, max(floor_of_errors, quantile(errors(2, :), 0.5_wp)), &
                    max(floor_of_errors, maxval(errors(2, :))), max(floor_of_errors, quantile(errors(1, :), &
                    0.5_wp)), max(floor_of_errors, maxval(errors(1, :)))
                call file%put()
                call progress(options, 'growth', (i - 1)*(most + 1) + k + 1, size(methods)*(most + 1))
            end do
            call file%end_block()
        end do
        call file%finish()
        call progress(options, 'growth', 1, 1)
        call open_script(options, 'growth', 900, 640, file)
        call file%put_lines([character(width) :: &
            'set logscale xy', 'set format x "10^{%T}"', 'set format y "10^{%T}"', &
            'set xrange [0.8:1.2e6]', 'set yrange [1e-17:10]', 'set mytics 1', &
            'set xlabel "number of steps to t = 16"', &
            'set ylabel "error of attitude, median of 9 bodies  [rad]"', &
            'set title "Cutting the same time into more steps"', &
            'set key outside right center vertical spacing 1.1 samplen 2.2 Left reverse', 'plot \', &
            '  1.1e-16*sqrt(x) with lines lc rgb "#777777" lw 1 dt 3 title "2^{-53} N^{1/2}", \', &
            '  1.1e-16*x with lines lc rgb "#777777" lw 1 dt 2 title "2^{-53} N", \'])
        k = 0
        do i = 1, size(methods)
            if (left_out(methods(i))) cycle
            write (file%line, '(a,i0,a)') '  "growth.dat" index ', k, ' using 1:2'// &
                style(methods(i))//', \'
            call file%put()
            k = k + 1
        end do
        call file%put('  NaN notitle')
        call file%finish()
        call draw(options, 'growth')
    end subroutine chart_growth

    !> The adaptive method has no number of steps to set; the batch repeats the free flow.
    pure function left_out(with) result(yes)
        type(method), intent(in) :: with
        logical :: yes

        yes = with%family == family_dp .or. with%family == family_batch
    end function left_out

end module frb_chart_precision
