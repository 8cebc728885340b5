!> The charts with torque: `heavy-top` and `heavy-top-weak` (error of the attitude against time spent and
!> against torques, T = 10, 100, 10 000) and `heavy-top-energy` (error of the energy against time, T = 1e5).
module frb_chart_heavy_top
    use frb, only: wp, rigid_body, heavy_top, total_energy
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, progress, &
        either, quantile
    use frb_chart_solvers, only: solver, top_at_start, all_solvers, name_of, setting_of, run_solver, &
        settings_of_solver, start_q, one_top
    use frb_top_truth, only: qp, taylor_top
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: chart_heavy_top

    integer, parameter :: durations(3) = [10, 100, 10000]
    integer, parameter :: samples = 60      !! of the energy

contains

    subroutine chart_heavy_top(options)
        type(settings), intent(in) :: options
        type(solver), allocatable :: solvers(:)
        integer :: number, i, spans

        allocate (solvers, source=all_solvers())
        spans = merge(2, 3, options%quick)
        do number = 1, 2
            do i = 1, spans
                call measure(options, solvers, one_top(number), durations(i))
                call progress(options, 'heavy-top', 3*(number - 1) + i, 6)
            end do
            call draw_errors(options, solvers, one_top(number), spans)
        end do
        call chart_energy(options)
    end subroutine chart_heavy_top

    !> Error, time and torques of all solvers and settings, the solvers in turn.
    subroutine measure(options, solvers, top, span)
        type(settings), intent(in) :: options
        type(solver), intent(in) :: solvers(:)
        type(top_at_start), intent(in) :: top
        integer, intent(in) :: span
        type(chart_file) :: file
        real(qp) :: m_end(3), q_end(4)
        real(wp) :: m(3), q(4), seconds, duration, enough
        real(wp), dimension(settings_of_solver, size(solvers)) :: errors, torques, setting
        real(wp) :: ns(3, settings_of_solver, size(solvers))
        real(wp), allocatable :: times(:, :)
        integer :: i, k, r, rounds(size(solvers))

        duration = real(span, wp)
        m_end = top%m0
        q_end = start_q
        call taylor_top(real(top%moments, qp), real(top%force, qp), real(span, qp), m_end, q_end)
        enough = merge(0.3e-3_wp, 1.0e-3_wp, options%quick)
        ! Long spans once, in a run of its own: they last long enough to be timed.
        allocate (times(merge(1, merge(3, 9, options%quick), span > 1000), size(solvers)))
        do k = 1, settings_of_solver
            do i = 1, size(solvers)
                setting(k, i) = setting_of(solvers(i), top, k)
                call run_solver(solvers(i), top, duration, setting(k, i), 1, m, q, seconds, torques(k, i))
                errors(k, i) = 10.0_wp      ! also where a solver has come to NaN
                if (all(ieee_is_finite(q))) then
                    errors(k, i) = max(1.0e-17_wp, real(2*min(norm2(q - q_end), norm2(q + q_end)), wp))
                end if
                rounds(i) = max(1, min(1000, int(enough/max(seconds, 1.0e-7_wp))))
            end do
            do r = 1, size(times, 1)
                do i = 1, size(solvers)
                    call run_solver(solvers(i), top, duration, setting(k, i), rounds(i), m, q, times(r, i), &
                        torques(k, i))
                end do
            end do
            do i = 1, size(solvers)
                ns(:, k, i) = 1.0e9_wp*[quantile(times(:, i), 0.5_wp), quantile(times(:, i), 0.25_wp), &
                                        quantile(times(:, i), 0.75_wp)]
            end do
        end do
        call open_table(options, table_of(top, span), 'error of the attitude: '//trim(top%title)// &
            '; a block per solver; splittings with joined drifts', &
            'step or tolerance, time [ns]: median, quartiles; torques, error of attitude [rad]', file)
        do i = 1, size(solvers)
            call file%put('# '//name_of(solvers(i)))
            do k = 1, settings_of_solver
                write (file%line, '(es11.3,3es13.4,2es12.3)') setting(k, i), ns(:, k, i), torques(k, i), &
                    errors(k, i)
                call file%put()
            end do
            call file%end_block()
        end do
        call file%finish()
    end subroutine measure

    pure function table_of(top, span) result(name)
        type(top_at_start), intent(in) :: top
        integer, intent(in) :: span
        character(:), allocatable :: name
        character(8) :: digits

        write (digits, '(i0)') span
        name = 'heavy-top-'//trim(top%name)//'-'//trim(digits)
    end function table_of

    !> A row of panels for each span: against time, against torques; the legend below.
    subroutine draw_errors(options, solvers, top, spans)
        type(settings), intent(in) :: options
        type(solver), intent(in) :: solvers(:)
        type(top_at_start), intent(in) :: top
        integer, intent(in) :: spans
        character(:), allocatable :: name
        character(8) :: digits
        type(chart_file) :: file
        real(wp) :: high
        integer :: s, column, i

        name = either(top%name == 'strong', 'heavy-top', 'heavy-top-'//trim(top%name))
        call open_script(options, name, 1000, 160 + 340*spans, file)
        high = (340.0_wp*spans)/(160 + 340*spans)
        call file%put_lines([character(width) :: 'set multiplot', 'set logscale xy', &
            'set format x "10^{%T}"', 'set format y "10^{%T}"', 'set yrange [1e-15:10]', &
            'set ytics 1e-15,1e3', 'set mytics 1', 'unset key', &
            'set lmargin 0; set rmargin 0; set tmargin 0; set bmargin 0'])
        do s = 1, spans
            write (digits, '(i0)') durations(s)
            do column = 1, 2
                write (file%line, '(2(a,f6.4))') 'set origin ', merge(0.085, 0.57, column == 1), ',', &
                    1 - high*s/spans + 0.17_wp*high/spans
                call file%put()
                write (file%line, '(a,f6.4)') 'set size 0.40,', 0.70_wp*high/spans
                call file%put()
                call file%put('set title "'//trim(top%title)//', t = '//trim(digits)//'" offset 0,-0.6')
                if (column == 1) then
                    call file%put_lines([character(width) :: 'set xlabel "time spent  [ns]" offset 0,0.4', &
                        'set ylabel "error of attitude  [rad]" offset 2.5,0', 'plot \'])
                else
                    call file%put_lines([character(width) :: 'set xlabel "torques" offset 0,0.4', &
                        'unset ylabel', 'plot \'])
                end if
                do i = 1, size(solvers)
                    write (file%line, '(a,i0,a)') '  "'//table_of(top, durations(s))//'.dat" index ', i - 1, &
                        either(column == 1, ' using 2:6', ' using 5:6')//curve(solvers(i))//' notitle'// &
                        either(i == size(solvers), '', ', \')
                    call file%put()
                end do
            end do
        end do
        call file%put_lines([character(width) :: 'unset border', 'unset tics', 'unset xlabel', &
            'unset ylabel', 'unset title', 'unset grid', 'unset logscale', 'set xrange [0:1]', &
            'set yrange [0:1]', 'set origin 0.02,0.0'])
        write (file%line, '(a,f6.4)') 'set size 0.96,', 1 - high
        call file%put()
        call file%put_lines([character(width) :: &
            'set key center center maxrows 4 samplen 2.2 spacing 1.1 Left reverse', 'plot \'])
        do i = 1, size(solvers)
            call file%put('  NaN'//curve(solvers(i))//' title "'//name_of(solvers(i))//'"'// &
                either(i == size(solvers), '', ', \'))
        end do
        call file%put('unset multiplot')
        call file%finish()
        call draw(options, name)
    end subroutine draw_errors

    !> How a solver's line looks.
    function curve(which) result(clause)
        type(solver), intent(in) :: which
        character(:), allocatable :: clause
        character(80) :: text

        write (text, '(4(a,i0),a)') ' with linespoints lt ', which%colour, ' dt ', which%dash, ' pt ', &
            which%symbol, ' lw ', which%width, ' ps 0.6'
        clause = trim(text)
    end function curve

    !> The largest error of the energy so far, at times spread evenly on a logarithmic scale; each span from
    !> one to the next is a run of its own, with the same step or tolerance.
    subroutine chart_energy(options)
        type(settings), intent(in) :: options
        type(solver), parameter :: solvers(5) = [ &
            solver('srkn14', 'flow', 8, 1, 7, 2), solver('fg6a', 'flow', 6, 1, 5, 3), &
            solver('fg6b', 'flow', 3, 1, 9, 3), solver('extrapolate', '', 2, 1, 7, 4), &
            solver('dop853', '', 1, 1, 5, 3)]
        ! Steps of about the same time each, and tolerances.
        real(wp), parameter :: setting(5, 2) = reshape([0.25_wp, 0.1_wp, 0.1_wp, 1.0e-12_wp, 1.0e-10_wp, &
                                                        2.0_wp, 0.8_wp, 0.8_wp, 1.0e-10_wp, 1.0e-10_wp], &
                                                       [5, 2])
        type(top_at_start) :: top
        type(chart_file) :: file
        real(wp) :: seconds(5), longest
        character(20) :: words
        integer :: number, i

        longest = merge(1.0e3_wp, 1.0e5_wp, options%quick)
        do number = 1, 2
            top = one_top(number)
            call open_table(options, 'heavy-top-energy-'//trim(top%name), 'energy of a heavy top: '// &
                trim(top%title)//'; a block per solver', 'time, largest error of the energy so far', file)
            do i = 1, size(solvers)
                call follow_energy(file, solvers(i), top, setting(i, number), longest, seconds(i))
            end do
            call file%finish()
        end do
        call open_script(options, 'heavy-top-energy', 1000, 480, file)
        call file%put_lines([character(width) :: 'set multiplot layout 1,2', 'set logscale xy', &
            'set format x "10^{%T}"', 'set format y "10^{%T}"', 'set yrange [1e-18:1e-5]', 'set mytics 1', &
            'set xlabel "t"', 'set ylabel "largest error of the energy"', &
            'set key bottom right Left reverse samplen 2.2', 'set xrange [4:*]'])
        do number = 1, 2
            top = one_top(number)
            call file%put('set title "'//trim(top%title)//'"')
            call file%put('plot \')
            do i = 1, size(solvers)
                if (solvers(i)%drift == 'flow') then
                    write (words, '(a,f5.2)') ', h =', setting(i, number)
                else
                    write (words, '(a,i0)') ', tolerance 1e', nint(log10(setting(i, number)))
                end if
                write (file%line, '(a,i0,a)') '  "heavy-top-energy-'//trim(top%name)// &
                    '.dat" index ', i - 1, ' using 1:2'//curve(solvers(i))//' title "'// &
                    trim(solvers(i)%with)//trim(words)//'"'//either(i == size(solvers), '', ', \')
                call file%put()
            end do
        end do
        call file%put('unset multiplot')
        call file%finish()
        call draw(options, 'heavy-top-energy')
    end subroutine chart_energy

    subroutine follow_energy(file, which, top, setting, longest, seconds)
        type(chart_file), intent(inout) :: file
        type(solver), intent(in) :: which
        type(top_at_start), intent(in) :: top
        real(wp), intent(in) :: setting, longest
        real(wp), intent(out) :: seconds
        type(top_at_start) :: moving
        type(rigid_body) :: body
        type(heavy_top) :: scene
        real(wp) :: m(3), q(4), energy, worst, time, end_time, part, torques
        integer :: k

        body = rigid_body(top%moments)
        scene%force = top%force
        energy = total_energy(body, scene, 0.0_wp, top%m0, top%q0)
        call file%put('# '//name_of(which))
        moving = top
        worst = 1.0e-17_wp
        time = 0.0_wp
        seconds = 0.0_wp
        do k = 1, samples
            end_time = max(longest**(real(k, wp)/samples), time + 1)
            ! Whole steps of 4, which all steps divide.
            end_time = time + 4*ceiling((end_time - time)/4)
            call run_solver(which, moving, end_time - time, setting, 1, m, q, part, torques)
            time = end_time
            seconds = seconds + part
            moving%m0 = m
            moving%q0 = q
            worst = max(worst, abs(total_energy(body, scene, time, m, q) - energy))
            write (file%line, '(2es13.5)') time, worst
            call file%put()
        end do
        write (file%line, '(a,es11.3)') '# time spent [s]:', seconds
        call file%put()
        call file%end_block()
    end subroutine follow_energy

end module frb_chart_heavy_top
